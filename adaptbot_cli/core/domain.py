"""A domain as a value: classes, properties, actions, tasks, goals (docs/domains.md)."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rdflib import RDF, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.graph.terms import Triple, local
from adaptbot_cli.core.plan import Constraint, Goal, Task


@dataclass(frozen=True, slots=True)
class Implication:
    """A value that follows from another fact: a liquid is not sliceable."""

    prop: URIRef
    equals: Node
    value: Node


@dataclass(frozen=True, slots=True)
class Property:
    """A predicate of the home. `graph` is "attribute" (G_k) or "state" (G_s)."""

    iri: URIRef
    label: str
    graph: str
    domain: URIRef
    range: URIRef
    question: str = ""
    functional: bool = False
    state_words: tuple[str, ...] = ()
    implied: tuple[Implication, ...] = ()


@dataclass(frozen=True, slots=True)
class InitialState:
    """A state that a new entity starts in, if the attribute `when` is true or none is named."""

    prop: URIRef
    value: Node
    when: URIRef | None


@dataclass(frozen=True, slots=True)
class ItemClass:
    """A class of things. The `superclasses` begin with itself; `order` makes it teachable.

    Prompts name the members of `prompted` classes. Nothing is kept in a `hand`.
    """

    iri: URIRef
    label: str
    comment: str
    superclasses: tuple[URIRef, ...]
    name_property: URIRef | None
    location_property: URIRef | None
    order: int | None
    asks: tuple[URIRef, ...]
    starts: tuple[InitialState, ...]
    prompted: bool = False
    hand: bool = False


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of an action: an item of some classes, or a value of a datatype.

    `default` is a SPARQL SELECT whose first row gives the value that the tool fills in; `instead`
    one that gives what is meant by a thing ?given that will not do, `instead_means` says how;
    `words` are the words that stand for a value, such as "on" for true; `units` the words that a
    number may carry, with what they multiply it by; `of_product` a SELECT of what is meant where
    the plan names what it makes; `prepositions` are the words that mark it in a phrase.
    """

    name: str
    classes: tuple[URIRef, ...] = ()
    datatype: URIRef | None = None
    optional: bool = False
    hidden: bool = False
    default: str = ""
    instead: str = ""
    instead_means: str = ""
    words: Mapping[str, Node] = field(default_factory=dict)
    units: Mapping[str, float] = field(default_factory=dict)
    of_product: str = ""
    prepositions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class AttributeRequirement:
    """An attribute that an argument must have. Unknown is neither true nor false: it is asked,
    unless the domain says that it may be taken to hold (`assume`)."""

    of: str
    prop: URIRef
    value: Node
    message: str
    assume: bool = False


@dataclass(frozen=True, slots=True)
class Condition:
    """A SPARQL ASK over the state at one point of the plan, and the sentence when it fails.

    `about` is a SELECT of further things with which missing steps may bring it about; `source` the
    ASK as its author wrote it.
    """

    query: str
    message: str
    predicates: frozenset[URIRef] = frozenset()
    about: str = ""
    source: str = ""


@dataclass(frozen=True, slots=True)
class Effect:
    """A SPARQL DELETE/INSERT … WHERE, as the SELECT of its WHERE and the triples of its templates.

    A `Variable` in a template stands for its value in each solution of the SELECT.
    """

    update: str
    select: str
    deletes: tuple[Triple, ...]
    inserts: tuple[Triple, ...]
    predicates: frozenset[URIRef] = frozenset()


@dataclass(frozen=True, slots=True)
class CalledAs:
    """Names of an action that also fix one argument: turn_on is switch with state on."""

    names: tuple[str, ...]
    parameter: str
    value: Node


@dataclass(frozen=True, slots=True)
class Action:
    """What the robot can do: parameters, requirements, effect and explanation.

    An action that `fetches` only takes a thing for a later step; `purpose` is what it is for:
    where it holds already, the step is not needed. Whether it is `irreversible` follows from the
    effects of all actions unless the domain says it.
    """

    iri: URIRef
    name: str
    explain: str
    parameters: tuple[Parameter, ...]
    attributes: tuple[AttributeRequirement, ...] = ()
    conditions: tuple[Condition, ...] = ()
    advises: tuple[Condition, ...] = ()
    effect: Effect | None = None
    aliases: tuple[str, ...] = ()
    called_as: tuple[CalledAs, ...] = ()
    family: str = ""
    verb: str = ""
    fetches: bool = False
    irreversible: bool | None = None
    purpose: Condition | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Its name and the other names that the domain gives it."""
        called = (name for part in self.called_as for name in part.names)
        return (self.name, *self.aliases, *called)

    @property
    def visible(self) -> tuple[Parameter, ...]:
        """The parameters that a plan may write, in order."""
        return tuple(p for p in self.parameters if not p.hidden)

    @property
    def required(self) -> tuple[Parameter, ...]:
        """The parameters that a plan must write."""
        return tuple(p for p in self.visible if not p.optional and not p.default)


@dataclass(frozen=True, slots=True)
class Domain:
    """Everything that the tool knows of a domain before it looks at the facts.

    `aliases` are the names under which recordings of experiments know it. `task_classes` are kinds
    of tasks that are not listed one by one, by name, with the goals that they share; `constraints`
    the diets and allergens; `part_words` what stands for the thing that it is a part of, as does
    "the door of the fridge"; `servings` is a SELECT of what has been served when a plan has run;
    `filed_by` the property by which a large home's files are split. `agent` is the robot that acts,
    `robot` its name where it is not the domain's own.
    """

    iri: URIRef
    name: str
    comment: str
    namespace: str
    agent: URIRef
    purpose: str
    noun_fields: frozenset[str]
    verb_fields: frozenset[str]
    fillers: frozenset[str]
    quantifiers: frozenset[str]
    part_words: frozenset[str]
    products: frozenset[str]
    classes: Mapping[URIRef, ItemClass]
    properties: Mapping[URIRef, Property]
    actions: Mapping[str, Action]
    tasks: tuple[Task, ...]
    task_names: Mapping[str, Task]
    goals: tuple[Goal, ...]
    advice: tuple[Goal, ...]
    aliases: tuple[str, ...] = ()
    task_classes: Mapping[str, Task] = field(default_factory=dict)
    constraints: tuple[Constraint, ...] = ()
    filed_by: URIRef = RDF.type
    servings: str = ""
    robot: str = ""

    @property
    def teachable(self) -> tuple[ItemClass, ...]:
        """The classes that a person can be asked to choose from, in the domain's order."""
        kinds = [kind for kind in self.classes.values() if kind.order is not None]
        return tuple(sorted(kinds, key=lambda kind: (kind.order or 0, kind.label)))

    @property
    def locations(self) -> tuple[URIRef, ...]:
        """The predicates that say what a thing is in or on."""
        found = {kind.location_property for kind in self.classes.values() if kind.location_property}
        return tuple(sorted(found))

    @property
    def moved(self) -> frozenset[URIRef]:
        """Those of them that some action changes: a thing that has one can be moved."""
        effects = (action.effect for action in self.actions.values())
        changed = {predicate for effect in effects if effect for predicate in effect.predicates}
        return frozenset(changed.intersection(self.locations))

    @property
    def places(self) -> frozenset[URIRef]:
        """The classes of what things can be in or on: the ranges of the location properties."""
        known = (self.properties[iri] for iri in self.locations if iri in self.properties)
        return frozenset(prop.range for prop in known)

    def label(self, iri: Node) -> str:
        """Return what people call a class or property: its label, or the end of its IRI."""
        known = self.classes.get(iri) or self.properties.get(iri)  # type: ignore[call-overload]
        return known.label if known is not None and known.label else local(iri)

    def name_properties(self) -> tuple[URIRef, ...]:
        """The predicates that give things their names."""
        found = {k.name_property for k in self.classes.values() if k.name_property is not None}
        return tuple(sorted(found))


class ActionIndex:
    """The actions of a domain by the predicates that their effects change."""

    def __init__(self, actions: Iterable[Action]) -> None:
        """Enter every action that has an effect, in the domain's order."""
        self._by: defaultdict[URIRef, list[tuple[int, Action]]] = defaultdict(list)
        for order, action in enumerate(actions):
            for predicate in action.effect.predicates if action.effect else ():
                self._by[predicate].append((order, action))

    def touching(self, predicates: Iterable[URIRef], things: frozenset[Node]) -> list[Action]:
        """Return the actions that change one of some predicates of what may be some things."""
        found = {order: a for p in predicates for order, a in self._by.get(p, ())}
        wanted = frozenset(predicates)
        return [found[order] for order in sorted(found) if _may(found[order], wanted, things)]


def _may(action: Action, predicates: frozenset[URIRef], things: frozenset[Node]) -> bool:
    """Whether an effect has a triple of some predicates whose constants are among some things."""
    effect = action.effect
    triples = (*effect.deletes, *effect.inserts) if effect else ()
    return any(
        (isinstance(p, Variable) or p in predicates)
        and all(not isinstance(node, URIRef) or node in things for node in (s, o))
        for s, p, o in triples
    )
