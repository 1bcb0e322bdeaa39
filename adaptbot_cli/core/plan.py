"""Plans as values: a call, a step and what became of it, a finding."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

from rdflib import URIRef

Status = Literal["ok", "changed", "inserted", "dropped", "finding"]
Approved = Literal["rule", "human"]
Done = Literal["done", "failed", "not tried"]


@dataclass(frozen=True, slots=True)
class Call:
    """An action and its arguments, all by name: `slice("onion", "knife")`.

    `names` are the keywords of the arguments, as in `slice(obj="onion")`, with "" for an argument
    that has none; it is empty if none has one.
    """

    action: str
    args: tuple[str, ...] = ()
    names: tuple[str, ...] = ()

    def named(self) -> tuple[tuple[str, str], ...]:
        """Return each argument behind its keyword, or behind "" if it has none."""
        return tuple(zip(self.names or ("",) * len(self.args), self.args, strict=True))

    def render(self) -> str:
        """Write the call as a plan line; `parse` reads it back to the same call."""
        lines = (f"{name}={_literal(a)}" if name else _literal(a) for name, a in self.named())
        return f"{self.action}({', '.join(lines)})"


def keyworded(action: str, named: Iterable[tuple[str, str]]) -> Call:
    """Return a call of arguments that each stand behind a keyword or behind ""."""
    pairs = tuple(named)
    names = tuple(name for name, _ in pairs)
    return Call(action, tuple(arg for _, arg in pairs), names if any(names) else ())


def _literal(arg: str) -> str:
    """A number as it is, any other argument in quotes."""
    digits = arg.isascii() and arg.replace(".", "", 1).isdigit() and "." not in (arg[0], arg[-1])
    return arg if digits else json.dumps(arg, ensure_ascii=False)


@dataclass(frozen=True, slots=True)
class Written:
    """A call as it stands in a text: `source` as written, `line` and `column` counted from 1."""

    call: Call
    source: str
    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Change:
    """One substitution: `source` became `target` by a remedy, on some evidence (paper, III-B)."""

    source: str
    target: str
    by: str
    evidence: str
    approved: Approved = "rule"


@dataclass(frozen=True, slots=True)
class Finding:
    """Something about a plan that a check found.

    `code` is a key of `findings.CODES`; `subject` the entity or action that it concerns; `step` the
    number of its step (counted from 1), if it has one, and `steps` those of all, if it has several;
    `candidates` the nearest names that would do; `prop` the local name of its attribute;
    `remedy` a step that would mend it, and where, in words. Findings that differ only in `remedy`
    or `steps` are equal. A `blocking` one keeps the plan from being executed though others of its
    code do not.
    """

    code: str
    message: str
    subject: str = ""
    step: int | None = None
    candidates: tuple[str, ...] = ()
    line: int | None = None
    column: int | None = None
    remedy: str = field(default="", compare=False)
    prop: str = ""
    steps: tuple[int, ...] = field(default=(), compare=False)
    blocking: bool = False

    @property
    def places(self) -> tuple[int, ...]:
        """The numbers of all the steps that it is about, in order."""
        return self.steps or (() if self.step is None else (self.step,))


@dataclass(frozen=True, slots=True)
class Step:
    """One step on its way from the model's text to an executable call.

    `source` is None for an inserted step; `reason` says why a step was changed, inserted, dropped;
    `place` is the number of the written call that it comes from, counted from 0; `done` is what
    came of it in a world outside, None where it was only rehearsed.
    """

    call: Call
    source: str | None = None
    line: int | None = None
    status: Status = "ok"
    changes: tuple[Change, ...] = ()
    reason: str = ""
    codes: tuple[str, ...] = ()
    place: int | None = None
    done: Done | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """What is to be done. `required` are the items that the result must use, by name.

    `goals` are the task's own conditions, `known` whether the domain pack lists the task; `iri` is
    the entry of the pack whose goals are judged and `judged_by` its name, both empty if no goal is
    known (`thin`), `like` the names of classes of tasks whose goals could be.

    The rest is what was asked besides (core/request/): `excluded` are names of what must not be
    used, `barred` further words for it, `rules` named constraints; `refused` the actions that are
    not to be done, each with the thing it is not to be done to, or "" for any; `amount` is how many
    are wanted; `place` where things are to be brought, `inside` pairs of a content and its vessel,
    `states` pairs of an item and a state that it must end in; `unread` are phrases nobody
    understood, `said` the person's own words.
    """

    name: str
    required: tuple[str, ...] = ()
    goals: tuple["Goal", ...] = ()
    known: bool = False
    iri: URIRef | None = None
    judged_by: str = ""
    thin: bool = False
    like: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    barred: frozenset[str] = frozenset()
    rules: tuple["Constraint", ...] = ()
    refused: tuple[tuple[str, str], ...] = ()
    amount: int = 1
    place: str = ""
    inside: tuple[tuple[str, str], ...] = ()
    states: tuple[tuple[str, URIRef], ...] = ()
    unread: tuple[str, ...] = ()
    said: str = ""


@dataclass(frozen=True, slots=True)
class KeptPlan:
    """A plan's text, one call a line, that is kept for a task."""

    task: Task
    text: str


@dataclass(frozen=True, slots=True)
class Constraint:
    """A diet or an allergen of the domain: what an item must be to be used at all.

    It holds for things of `classes`. `query` is a SPARQL ASK that holds of an ?item that is safe;
    `props` are the attributes it rests on: with one of them unknown, it is unknown whether an item
    is safe. `names` call for it by themselves if it is a `diet` ("vegan"), else where something is
    excluded ("no dairy"); `strict` are names of an allergen that only an allergy calls so ("milk").
    """

    name: str
    names: tuple[str, ...]
    classes: tuple[URIRef, ...]
    props: tuple[URIRef, ...]
    query: str
    message: str
    diet: bool = False
    strict: tuple[str, ...] = ()
    source: str = ""


@dataclass(frozen=True, slots=True)
class Goal:
    """A condition on the state after the plan.

    `query` is a SPARQL ASK that must hold, or a SELECT of every ?item that spoils it. With
    `classes` the ASK is asked of each required item of those classes, as ?item: of `items` only, if
    there are any. `about` is a SELECT of the things with which missing steps may bring it about,
    likeliest first; `helped_by` is such a SELECT for steps that are only suggested; `before` are
    the actions before which it should be brought about, by IRI; `source` is the query as its author
    wrote it. A goal with `places` is about a ?place: where the request says, else any of these.
    """

    query: str
    message: str
    classes: tuple[str, ...] = ()
    about: str = ""
    before: frozenset[str] = frozenset()
    source: str = ""
    helped_by: str = ""
    places: str = ""
    items: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Parsed:
    """A text as a plan: its calls in order, and the findings of what cannot be read."""

    calls: tuple[Written, ...] = ()
    findings: tuple[Finding, ...] = field(default=())
