; A briefcase that takes along what is in it: effects for every thing, and with a condition, that
; name what only the action itself knows.
(define (domain briefcase)
  (:requirements :adl)
  (:types item place)
  (:predicates (at ?i - item ?p - place) (packed ?i - item) (here ?p - place) (raining)
               (muddy ?from - place ?to - place))
  (:action put-in
    :parameters (?i - item ?p - place)
    :precondition (and (at ?i ?p) (here ?p) (not (packed ?i)))
    :effect (packed ?i))
  (:action take-out
    :parameters (?i - item)
    :precondition (packed ?i)
    :effect (not (packed ?i)))
  (:action carry
    :parameters (?from - place ?to - place)
    :precondition (and (here ?from) (not (= ?from ?to)))
    :effect (and (here ?to) (not (here ?from)) (when (raining) (muddy ?from ?to))
                 (forall (?i - item)
                   (when (packed ?i) (and (at ?i ?to) (not (at ?i ?from))))))))
