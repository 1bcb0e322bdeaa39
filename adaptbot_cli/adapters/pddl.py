"""A domain in PDDL, the planning domain definition language, as a pack (STRIPS and ADL).

Types become classes, predicates properties (of one thing: true; of two: a link between them; of
none: true of the robot), actions what they are, with each conjunct of a precondition as a condition
of its own. What PDDL does not say is false, and so it is here. A predicate that no action changes
and that is said of one thing is an attribute: a person can be asked for it.
"""

import itertools
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rdflib import RDFS, Literal

from adaptbot_cli.bounded import PLAN, read_bytes
from adaptbot_cli.core.graph.clock import EndlessError, within
from adaptbot_cli.core.names import normal, sound
from adaptbot_cli.errors import KnowledgeError, UsageError

_SECONDS = 30
"""How long a text may take to be read. Domains of competitions take two seconds at most."""

INSTALL = "pip install 'adaptbot-cli[pddl]'"

_HEAD = """@prefix ab: <urn:adaptbot:> .
@prefix ex: <http://example.org/> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .

"""


_DOMAIN = """ab:{name} a ab:Domain ;
    rdfs:label "{name}" ;
    rdfs:comment {source} ;
    ab:namespace "http://example.org/" ;
    ab:agent ex:TheRobot ;
    ab:wordField "noun.artifact", "noun.object", "noun.food" ;
    ab:verbField "verb.contact", "verb.possession", "verb.change", "verb.motion" ;
    ab:filler "a", "an", "the", "please" .

ex:Type_robot a rdfs:Class ; rdfs:label "robot" .

ex:Type_anything a rdfs:Class ; rdfs:label "thing" .

ex:Name a rdf:Property ; rdfs:label "name" ; ab:graph ab:attribute ;
    rdfs:domain ex:Type_anything ; rdfs:range xsd:string ; ab:functional true .

"""


def packed(domain: Path, problem: Path | None, name: str) -> dict[str, bytes]:
    """Return the files of a pack for a PDDL domain, and for the things and goal of a problem.

    Raises:
        UsageError: no parser is installed, or a file cannot be read.
        KnowledgeError: a file is no PDDL, or has what a graph of facts about two things cannot
            hold: numbers, durations, predicates of more than two things.
    """
    try:
        from unified_planning.environment import get_environment
        from unified_planning.io import PDDLReader
    except ImportError:
        raise UsageError(f"reading PDDL needs a parser: {INSTALL}") from None
    texts = [_text(path) for path in (domain, problem) if path]
    text = " and ".join(str(path) for path in (domain, problem) if path)
    environment = get_environment()  # its reader works in no other
    strict, environment.error_used_name = environment.error_used_name, False
    try:  # an action may be called as a predicate is; that is warned of
        with warnings.catch_warnings(action="ignore"):
            read = within(lambda: PDDLReader().parse_problem_string(*texts), text, _SECONDS)
    except EndlessError:
        raise KnowledgeError(f"{text} could not be read in {_SECONDS} s: make it smaller") from None
    except Exception as error:  # its grammar's, and its own checks of types, of many kinds
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise KnowledgeError(f"{text} is no PDDL that can be read: {reason}") from None
    finally:
        environment.error_used_name = strict
    return _Pack(name, domain.stem, read, problem.stem if problem else "").files()


def _text(path: Path) -> str:
    """Read a file within its bounds. Raises UsageError, KnowledgeError."""
    text = read_bytes(path, PLAN, UsageError).decode("utf-8", "replace")
    depth = itertools.accumulate(1 if c == "(" else -1 if c == ")" else 0 for c in text)
    if max(depth, default=0) > 100:
        raise KnowledgeError(f"{path} is nested more than 100 deep: so deep a file is not read")
    return text


@dataclass
class _Pack:
    """What a domain, and a problem of it, become."""

    name: str
    source: str
    read: Any
    problem: str
    changed: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        read = self.read
        costs = {f.name for f in read.fluents if f.type.is_int_type() or f.type.is_real_type()}
        refused = [f"the number {name}" for name in sorted(costs - {"total-cost"})]
        wide = [f for f in read.fluents if len(f.signature) > 2]
        refused += [f"{f.name}, which is said of {len(f.signature)} things" for f in wide]
        refused += [f"the durative action {a.name}" for a in read.actions if hasattr(a, "duration")]
        for what, these in (("things", read.all_objects), ("types", read.user_types),
                            ("actions", read.actions), ("predicates", read.fluents)):  # fmt: skip
            names = Counter(normal(each.name) for each in these)
            refused += [f"{what} that are called {name} alike" for name in names if names[name] > 1]
            odd = [name for name in (*names, self.task) if not re.fullmatch(r"[a-z0-9_]+", name)]
            refused += [f"{name!r}, which is no name" for name in odd]
        if refused:
            cure = "Rewrite it without."
            for name, (first, second, *_) in ((f.name, f.signature) for f in wide[:1]):
                cure = (
                    f"Give {name} a type of its own, whose things are what is so related, "
                    f"with a predicate of two things for each part: ({name}-{first.name} ?it "
                    f"?{first.name}), ({name}-{second.name} ?it ?{second.name}) and so on."
                )
            raise KnowledgeError(
                f"{self.source} has {', '.join(refused[:5])}: a pack, a graph of facts about two "
                f"things, cannot hold that. {cure}"
            )
        effects = (effect for action in read.actions for effect in action.effects)
        self.changed = {effect.fluent.fluent().name for effect in effects}

    @property
    def task(self) -> str:
        """The name of the problem's task."""
        return normal(self.read.name or self.problem or "problem")

    def files(self) -> dict[str, bytes]:
        """The five files."""
        texts = {
            "domain.ttl": "".join(self._domain()),
            "actions.ttl": "".join(map(self._action, self.read.actions)),
            "tasks.ttl": self._task() if self.problem else "",
            "attributes.ttl": "".join(self._attributes()),
            "state.ttl": "".join(self._state()),
        }
        return {file: (_HEAD + text).encode() for file, text in texts.items()}

    # what there can be ------------------------------------------------------------------------

    def _fluents(self) -> list[Any]:
        return sorted((f for f in self.read.fluents if f.type.is_bool_type()), key=str)

    def _domain(self) -> Iterator[str]:
        source = Literal(f"The PDDL domain {sound(self.source)}.").n3()
        yield _DOMAIN.format(name=self.name, source=source)
        for order, kind in enumerate(self.read.user_types, start=1):
            above = _type(kind.father) if kind.father else "ex:Type_anything"
            yield (
                f"{_type(kind)} a rdfs:Class ; rdfs:subClassOf {above} ;\n"
                f'    rdfs:label "{normal(kind.name)}" ; ab:nameProperty ex:Name ;\n'
                f"    ab:kindOrder {order} ; ab:prompted true .\n\n"
            )
        for fluent in self._fluents():
            kinds = [_type(parameter.type) for parameter in fluent.signature]
            graph = "attribute" if self._lasts(fluent) else "state"
            text = normal(fluent.name).replace("_", " ")
            lines = [
                f'{_predicate(fluent)} a rdf:Property ; rdfs:label "{text}" ;',
                f"    ab:graph ab:{graph} ; rdfs:domain {(kinds or ['ex:Type_robot'])[0]} ; "
                f"rdfs:range {kinds[1] if len(kinds) > 1 else 'xsd:boolean'}",
            ]
            lines[1] += f' ; ab:functional true ; ab:stateWord "{text}"' if len(kinds) < 2 else ""
            if graph == "attribute":
                lines[1] += f' ; ab:question "Is it true of {{name}}: {text}?"'
            yield "\n".join(lines) + " .\n\n"

    def _lasts(self, fluent: Any) -> bool:
        """Whether a predicate is of one thing, for ever: an attribute, which can be asked for."""
        return len(fluent.signature) == 1 and fluent.name not in self.changed

    # what can be done -------------------------------------------------------------------------

    def _action(self, action: Any) -> str:
        names = _Names(action.parameters)
        name = normal(action.name)
        parameters = " ".join(
            f'[ ab:name "{names[p.name]}" ; ab:class {_type(p.type)} ]' for p in action.parameters
        )
        parts = [
            f'ex:Do_{name} a ab:Action ;\n    rdfs:label "{name}"',
            f'    ab:explain "{name.replace("_", " ")}"',
            f"    ab:parameters ( {parameters} )",
        ]
        wanted = self._conditions(action.preconditions, names, "{{{}}}".format)
        parts += [f"    ab:requires\n{wanted}"] if wanted else []
        parts.append(f'    ab:effect """\n{self._effect(action, names)}"""')
        return " ;\n".join(parts) + " .\n\n"

    def _conditions(
        self, formulas: Iterable[Any], names: "_Names", shown: Callable[[str], str]
    ) -> str:
        """Each conjunct as a condition with a sentence, which names parameters as `shown` does."""
        found = []
        for order, formula in enumerate(_conjuncts(formulas), start=1):
            ask, text = _written(formula, names, shown)
            ask = _atom(formula, names) if formula.is_fluent_exp() else f"FILTER({ask})"
            what = f'ab:ask "ASK {{ {ask} }}"'
            if formula.is_fluent_exp() and self._lasts(formula.fluent()):
                (term,) = formula.args
                if term.is_parameter_exp():  # what is unknown of it becomes a question
                    of, prop = names[term.parameter().name], _predicate(formula.fluent())
                    what = f'ab:of "{of}" ; ab:attribute {prop} ; ab:value true'
            if formula.is_not():
                text = f"{_written(formula.args[0], names, shown)[1]} must not hold"
            else:
                text = f"{text} must hold"
            found.append(f'        [ ab:order {order} ; {what} ;\n          ab:message "{text}" ]')
        return " ,\n".join(found)

    def _effect(self, action: Any, names: "_Names") -> str:
        """An effect as an update: what holds only for some is bound in a branch of its own."""
        changes: dict[bool, list[str]] = {False: [], True: []}
        branches = ["{ }"]
        for number, effect in enumerate(action.effects):
            if effect.is_increase():
                continue  # of the total cost: other numbers were refused
            scope, value = names.within(effect.forall), ""
            if effect.forall or effect.is_conditional():
                value = f"?value_{number}"
                last = scope.term(effect.fluent.args[1]) if len(effect.fluent.args) > 1 else "true"
                only = f"FILTER({_written(effect.condition, scope, str)[0]})"
                every = _every(effect.forall, scope)
                # BIND knows a parameter only where a pattern beside it names it.
                known = f"{last} a ?kind_{number} ." if last.startswith("?") else ""
                branches.append(f"{{ {every} {known} {only} BIND({last} AS {value}) }}")
            changes[effect.value.is_true()].append(_atom(effect.fluent, scope, value))
        removed, added = (" ".join(dict.fromkeys(changes[held])) for held in (False, True))
        where = " UNION ".join(branches)
        lines = (f"DELETE {{ {removed} }}", f"INSERT {{ {added} }}", f"WHERE {{ {where} }}")
        return "\n".join(f"        {line}" for line in lines)

    # what there is ----------------------------------------------------------------------------

    def _facts(self) -> Iterator[Any]:
        if self.problem:
            for atom, value in self.read.explicit_initial_values.items():
                if value.is_true():
                    yield atom

    def _attributes(self) -> Iterator[str]:
        true = {str(atom) for atom in self._facts()}
        for thing in sorted(self.read.all_objects, key=str):
            lines = [f"{_thing(thing)} rdf:type {_type(thing.type)} ;",
                     f'    ex:Name "{normal(thing.name)}" ;']  # fmt: skip
            for fluent in filter(self._lasts, self._fluents()):
                if fluent.signature[0].type in [*_above(thing.type)]:
                    text = str(str(fluent(thing)) in true).lower()
                    lines.append(f"    {_predicate(fluent)} {text} ;")
            yield "\n".join([*lines, ".\n\n"])
        yield "ex:TheRobot rdf:type ex:Type_robot ;\n.\n"

    def _state(self) -> Iterator[str]:
        for atom in sorted(self._facts(), key=str):
            if not self._lasts(atom.fluent()):
                yield _atom(atom, _Names(())).replace("?agent", "ex:TheRobot") + "\n"

    def _task(self) -> str:
        name = self.task
        goals = self._conditions(self.read.goals, _Names(()), str)
        return (
            f'ab:task_{name} a ab:Task ;\n    rdfs:label "{name.replace("_", " ")}" ;\n'
            f"    ab:goal\n{goals} .\n"
        )


class _Names:
    """The SPARQL variables of PDDL's parameters and variables."""

    def __init__(self, variables: Iterable[Any], above: Mapping[str, str] | None = None) -> None:
        self.known = dict(above or {})
        for variable in variables:
            name, taken = normal(variable.name), {*self.known.values(), "agent"}
            free = (f"{name}{n}" if n else name for n in itertools.count())
            self.known[variable.name] = next(n for n in free if n not in taken)

    def __getitem__(self, name: str) -> str:
        return self.known[name]

    def term(self, term: Any) -> str:
        if term.is_object_exp():
            return _thing(term.object())
        return f"?{self[(term.parameter() if term.is_parameter_exp() else term.variable()).name]}"

    def within(self, variables: Iterable[Any]) -> "_Names":
        return _Names(variables, self.known)


def _conjuncts(formulas: Iterable[Any]) -> Iterator[Any]:
    for formula in formulas:
        if formula.is_and():
            yield from _conjuncts(formula.args)
        elif not formula.is_true():
            yield formula


def _every(variables: Iterable[Any], names: _Names) -> str:
    """A pattern that binds variables to all things of their types."""
    return " ".join(f"?{names[v.name]} a/<{RDFS.subClassOf}>* {_type(v.type)} ." for v in variables)


def _atom(atom: Any, names: _Names, value: str = "") -> str:
    """A predicate as a triple; with a variable `value` in the place of its object."""
    terms = [names.term(term) for term in atom.args]
    subject = terms[0] if terms else "?agent"
    return f"{subject} {_predicate(atom.fluent())} {value or (terms[1:] or ['true'])[0]} ."


def _written(formula: Any, names: _Names, shown: Callable[[str], str]) -> tuple[str, str]:
    """A formula as a SPARQL expression, and in words with its parameters as `shown` writes them.

    Raises:
        KnowledgeError: it is no condition.
    """

    def term(part: Any) -> str:
        named = names.term(part)
        if named.startswith("?") and not part.is_variable_exp():
            return shown(named[1:])
        return normal(named.removeprefix("ex:").removeprefix("?")).replace("_", " ")

    if formula.is_fluent_exp():
        name = normal(formula.fluent().name).replace("_", " ")
        return f"(EXISTS {{ {_atom(formula, names)} }})", " ".join([name, *map(term, formula.args)])
    if formula.is_equals():
        return f"({' = '.join(map(names.term, formula.args))})", " is ".join(
            map(term, formula.args)
        )
    if formula.is_bool_constant():
        return str(formula.is_true()).lower(), str(formula.is_true()).lower()
    variables = formula.variables() if formula.is_exists() or formula.is_forall() else ()
    inner = names.within(variables)
    parts = [_written(part, inner, shown) for part in formula.args]
    asks, texts = [ask for ask, _ in parts], [text for _, text in parts]
    if variables:
        every = formula.is_forall()
        these = " and ".join(inner[v.name].replace("_", " ") for v in variables)
        held = f"(!{asks[0]})" if every else asks[0]
        found = f"EXISTS {{ {_every(variables, inner)} FILTER({held}) }}"
        which = "for every" if every else "for some"
        return f"(!{found})" if every else f"({found})", f"({which} {these}: {texts[0]})"
    if formula.is_not():
        return f"(!{asks[0]})", f"not ({texts[0]})"
    if formula.is_implies():
        return f"((!{asks[0]}) || {asks[1]})", f"({texts[1]} if {texts[0]})"
    if formula.is_and() or formula.is_or():
        sign, word = (" && ", " and ") if formula.is_and() else (" || ", " or ")
        return f"({sign.join(asks)})", f"({word.join(texts)})"
    raise KnowledgeError(f"{formula} is no condition that can be taken over")


def _above(kind: Any) -> Iterator[Any]:
    while kind is not None:
        yield kind
        kind = kind.father


# Things have small letters alone, so that no other name here can be one of them.


def _type(kind: Any) -> str:
    return f"ex:Type_{normal(kind.name)}"


def _predicate(fluent: Any) -> str:
    return f"ex:Is_{normal(fluent.name)}"


def _thing(thing: Any) -> str:
    return f"ex:{normal(thing.name)}"
