; A home with washing: ADL with or, exists, forall, when, imply and equality.
(define (domain laundry)
  (:requirements :adl)
  (:types cloth container place - object
          washer basket - container)
  (:constants balcony - place)
  (:predicates (in ?c - cloth ?b - container) (stands ?b - container ?p - place) (held ?c - cloth)
               (hand-free) (open ?b - container) (running ?w - washer) (washed ?c - cloth)
               (wet ?c - cloth) (hung ?c - cloth) (woollen ?c - cloth) (near ?p - place)
               (dry-day))
  (:action walk
    :parameters (?to - place)
    :precondition (not (near ?to))
    :effect (and (near ?to) (forall (?p - place) (when (not (= ?p ?to)) (not (near ?p))))))
  (:action take
    :parameters (?c - cloth ?from - container)
    :precondition (and (hand-free) (in ?c ?from)
                       (imply (exists (?w - washer) (= ?w ?from)) (open ?from))
                       (exists (?p - place) (and (near ?p) (stands ?from ?p))))
    :effect (and (held ?c) (not (hand-free)) (not (in ?c ?from))))
  (:action put
    :parameters (?c - cloth ?into - container)
    :precondition (and (held ?c) (exists (?p - place) (and (near ?p) (stands ?into ?p)))
                       (or (open ?into) (not (exists (?w - washer) (= ?w ?into)))))
    :effect (and (in ?c ?into) (hand-free) (not (held ?c))))
  (:action open-door
    :parameters (?w - washer)
    :precondition (and (not (open ?w)) (not (running ?w)) (hand-free))
    :effect (open ?w))
  (:action close-door
    :parameters (?w - washer)
    :precondition (and (open ?w) (hand-free))
    :effect (not (open ?w)))
  (:action wash
    :parameters (?w - washer)
    :precondition (and (not (open ?w)) (not (running ?w))
                       (forall (?c - cloth) (imply (in ?c ?w) (not (woollen ?c)))))
    :effect (and (running ?w)
                 (forall (?c - cloth) (when (in ?c ?w) (and (washed ?c) (wet ?c))))))
  (:action stop
    :parameters (?w - washer)
    :precondition (running ?w)
    :effect (not (running ?w)))
  (:action hang
    :parameters (?c - cloth)
    :precondition (and (held ?c) (wet ?c) (near balcony))
    :effect (and (hung ?c) (hand-free) (not (held ?c)) (when (dry-day) (not (wet ?c))))))
