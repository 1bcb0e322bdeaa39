"""Changes of a home's knowledge that somebody asks for: seen first, then committed."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rdflib import RDF, URIRef

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.store.filing import Filing
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import (
    CommitSource,
    Held,
    Keeper,
    commit_hand_edits,
    edit_faults,
    edited_plans,
)
from adaptbot_cli.adapters.store.trailers import answers, compose, of_lessons
from adaptbot_cli.core.ask.learning import Lesson, attribute, attribute_question, attribute_value
from adaptbot_cli.core.ask.questions import UNKNOWN, Answer
from adaptbot_cli.core.ask.teach import in_words
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.faults import by_mistake
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.retraction import Known, following, taken_back
from adaptbot_cli.core.graph.terms import AB, Triple, local
from adaptbot_cli.core.names import nearest, normal, sentence_list
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.request.understand import understand
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.core.view.changes import Changes, about
from adaptbot_cli.errors import KnowledgeError, ModelError, UsageError
from adaptbot_cli.session.author import now, person, stamp
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.knowledge import called, chapters, known_as, near_it
from adaptbot_cli.session.replay import check
from adaptbot_cli.session.sources import started_on

_ANSWER = re.compile(r"[0-9a-f]{4,40}\.[0-9]+")

_PLAINLY = {"true": "yes", "on": "yes", "1": "yes", "false": "no", "off": "no", "0": "no"}
"""What people write for yes and no."""

_MOST = 3
"""How many faults of an edit are told; `kg validate` tells all."""


@dataclass(frozen=True, slots=True)
class ProposedChange:
    """A change that is not made yet.

    `subject` and `trailers` are its commit's; `notes` what the person should know besides;
    `plans` are files by their paths in the workspace, and what they are to hold: None to go.
    """

    delta: Delta
    subject: str
    trailers: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    plans: Mapping[str, bytes | None] = field(default_factory=dict)

    @property
    def changes(self) -> Changes:
        """The change, as a difference is told."""
        return Changes(self.delta)


def commit(home: Home, proposal: ProposedChange) -> str | None:
    """Make a proposed change and commit it; return the revision.

    Raises:
        KnowledgeError: it cannot be written, or would leave what the domain does not allow;
            nothing has changed then.
    """
    message = signed(proposal.subject, *proposal.trailers)
    return keeper(home).change(proposal.delta, message, others=proposal.plans)


def signed(subject: str, *trailers: tuple[str, str]) -> str:
    """Return a commit's message that names the person at this machine, if that is known."""
    by = person()
    return compose(subject, [*trailers, *([("By", by)] if by else [])])


def last_plan(home: Home) -> ProposedChange | None:
    """Propose to take back that a plan was kept or dropped last, if that still stands and nothing
    was learned since.

    Raises:
        KnowledgeError: it was edited since: what is to become of that is the person's to say.
    """
    root, folder = home.workspace.root, f"plans/{home.domain}"
    repo = Repo.open(root) if home.workspace.exists else None
    if repo is None:
        return None
    learned = last_learned(home)
    seen: set[str] = set()
    for commit in repo.log([folder]):
        if learned is not None and not repo.leads_to(learned, commit.sha):
            return None
        before = repo.folder(folder, next(iter(commit.parents), None))
        after = repo.folder(folder, commit.sha)
        for name in sorted(before.keys() | after.keys()):
            path = f"{folder}/{name}"
            if before.get(name) == after.get(name) or path in seen:
                continue
            seen.add(path)  # what was done to it before that is not what stands now
            if not (answers(commit.trailers) or ("Source", "drop") in commit.trailers):
                continue
            if repo.dirty([path]):
                raise KnowledgeError(
                    f"{path} was edited since it was kept; commit that with git, or take the edit "
                    f"back, or drop the plan: adaptbot plans drop {name.removesuffix('.plan')}"
                )
            old = repo.blob(before[name]) if name in before else None
            text = f"drop the kept plan {name}" if old is None else f"put back {name} as it was"
            return ProposedChange(Delta(), text, (("Source", "revert"),), plans={path: old})
    return None


def split_files(home: Home) -> str | None:
    """Divide the files of facts as the pack says, in a commit that changes no fact; return the
    revision, None if they are divided so already.

    Raises:
        KnowledgeError: they cannot be, or hold edits that are not committed.
    """
    keeps = keeper(home)
    if home.versions is not None and (edited := home.versions.edited()):
        raise KnowledgeError(
            f"{sentence_list(edited)} holds edits that are not committed; commit them first: "
            'adaptbot kg commit -m "…"'
        )
    held = keeps.held or held_by(home)
    others = {
        f"kg/{home.domain}/{name}": data
        for name, data in Filing(held.files, held.kg).split().items()
        if data != held.files.get(name)
    }
    if not others:
        return None
    message = compose("split: the files of facts", [("Source", "split")])
    return keeps.change(Delta(), message, others=others)


def judge(home: Home, delta: Delta) -> None:
    """Judge a change as its commit would. Raises KnowledgeError: the domain does not allow it."""
    held_by(home).judged(delta)


def keeper(home: Home) -> Keeper:
    """Make the workspace ready; return what commits changes that are no run's."""
    begun = started_on(home.domain, home.workspace)
    held = Held(f"kg/{home.domain}", begun.files, begun.kg)
    source, large = CommitSource("none", "", now), home.workspace.large
    return Keeper(home.workspace.root, home.domain, source, held, large=large)


def after(home: Home, delta: Delta) -> Kg:
    """Return the graph as a change would leave it. Raises KnowledgeError."""
    held = held_by(home)
    held.learn(delta, held.after(delta))
    return held.kg


def held_by(home: Home) -> Held:
    """Return a home's files, with the graph that they hold. Raises KnowledgeError."""
    files = home.workspace.files(home.domain)
    return Held.of(files, f"kg/{home.domain}", home.workspace.large)


def revert(home: Home, revision: str) -> ProposedChange:
    """Propose to undo what a commit, or an answer such as `3fa2b1c.2`, taught, with all that
    follows from it.

    Raises:
        KnowledgeError: there is no such commit or answer, or it is none that can be undone.
    """
    if _ANSWER.fullmatch(revision):
        return revert_answer(home, revision)
    found = home.needed().commit_of(revision)
    if found is None:
        see = f"see adaptbot kg log --domain {home.domain}"
        raise KnowledgeError(f"{revision} changed nothing of the {home.domain}; {see}")
    commit, taught = found
    sha, changes = commit.sha, taught.changes
    if taught.first:
        raise KnowledgeError(
            f"{sha[:7]} is where the versions begin; what it holds cannot be undone as a whole. "
            "`adaptbot kg retract NAME` takes back a single thing"
        )
    entries = changes.entries
    if entries and not changes.delta:
        text = ", ".join(f"{entry.file}: {entry.name}" for entry in entries)
        raise KnowledgeError(
            f"{sha[:7]} changed entries that are not made of single facts ({text}); undo it with "
            f"`git -C {home.workspace.root} revert {sha[:7]}`"
        )
    notes = tuple(
        f"{e.file}: {e.name} was {e.sign} too; that stays: edit the file" for e in entries
    )
    delta = taken_back(changes.delta, Known(home.kg.domain, home.facts))
    subject = f'revert: "{commit.subject}"'
    return ProposedChange(delta, subject, (("Source", "revert"), ("Reverts", sha)), notes)


def last_learned(home: Home) -> str | None:
    """Return the newest commit of a person's answers that has not been undone and of which
    something still stands, if any."""
    undone = set[str]()
    for chapter in chapters(home, None):
        revision = chapter.origin.revision
        if revision in undone:
            continue
        if chapter.origin.source == "revert":
            fields = dict(home.needed().repo.commit_of(revision).trailers)
            undone |= {fields.get("Reverts", "")} if "Takes-back" not in fields else set()
        elif chapter.answers and not chapter.changes.delta.added.isdisjoint(home.facts):
            return revision
    return None


def last_done(home: Home) -> str | None:
    """Return the newest commit if it holds what a robot did or saw, which is no answer."""
    newest = next(iter(chapters(home, None)), None)
    return newest.origin.revision if newest and newest.origin.source == "state" else None


def suggestions(home: Home) -> ProposedChange:
    """Propose to take back all that was taken as it was suggested and that nobody has said since.

    Raises:
        UsageError: there is no such answer.
    """
    origins = home.versions.origins(home.facts, home.pack) if home.versions else {}
    found = {triple for triple, origin in origins.items() if origin.suggestion}
    if not found:
        raise UsageError(f"no suggestion that was accepted for the {home.domain} is left")
    gone = following(found, Known(home.kg.domain, home.facts))
    subject = f"take back: {len(found)} accepted suggestion{'s' * (len(found) != 1)}"
    return ProposedChange(Delta(removed=gone), subject, (("Source", "revert"),))


def revert_answer(home: Home, answer: str) -> ProposedChange:
    """Propose to undo what one answer taught. Raises KnowledgeError if there is none such."""
    commit, delta, question = home.needed().answered(answer)
    delta = taken_back(delta, Known(home.kg.domain, home.facts))
    trailers = (("Source", "revert"), ("Reverts", commit.sha), ("Takes-back", answer))
    return ProposedChange(delta, f"take back: the answer to {question}", trailers)


def put(home: Home, name: str, prop: str, value: str) -> ProposedChange:
    """Propose a value for a property of a thing in place of what is known, as a person's answer.

    `prop` is its label or short name; `value` yes or no, a place, a number or a text.

    Raises:
        UsageError: there is no such thing, property or value.
    """
    kg, thing = home.kg, _thing(home, name)
    if thing in kg.robots:
        raise UsageError(
            "what a robot holds and where it is, is kept as it acts; adaptbot kg retract "
            f"{name} takes back what is not so"
        )
    own = {p.iri: p for p in kg.domain.properties.values() if kg.is_a(thing, [p.domain])}
    asked = [own[iri] for iri in own.keys() - {*kg.domain.name_properties()}]
    found = next((p for p in asked if called(prop, p.iri, home.words)), None)
    if found is None:
        labels = sorted(p.label for p in asked)
        known = ", ".join(nearest(prop, labels) or labels)
        raise UsageError(f"{name} has no property {prop}; it has {known}")
    question = attribute_question(kg, normal(kg.name(thing)), found, "")
    text = normal(value).removeprefix("the_") if question.choices else value
    answer = Answer(_PLAINLY.get(text, text), person(), stamp())
    term = attribute_value(kg, found, answer.value)
    places = {choice.value for choice in question.choices} if question.kind == "place" else set()
    if term is None or (places and kg.name(term) not in places):
        labels = [choice.label for choice in question.choices if choice.value != UNKNOWN]
        choices = nearest(value, labels) or labels
        what = ", ".join(choices) or f"a {question.number or 'text'}"
        raise UsageError(f'{found.label} of {name} cannot be "{value}"; it may be: {what}')
    delta = attribute(kg, thing, found, term)
    if places:  # what has a place is with no robot
        held = {t for robot in kg.robots for t in kg.facts.triples((robot, None, thing))}
        delta = Delta(delta.removed | held, delta.added)
    sentence = in_words((thing, found.iri, term), kg)
    lesson = Lesson(delta, question, answer, sentence)
    return ProposedChange(delta, f"learn: {sentence}", tuple(of_lessons([lesson])))


def retract(home: Home, name: str, prop: str = "", value: str = "") -> ProposedChange:
    """Propose to take back an absence, another name, a thing, or one of its facts.

    Raises:
        UsageError: nothing is called so, several things are, or there is no such fact.
    """
    taken, text = _absence(home, name) if not prop else _fact(home, name, prop, value)
    if not taken:
        thing = _thing(home, name)
        taken, text = {t for t in home.facts if t[0] == thing}, f"there is {name}"
    gone = following(taken, Known(home.kg.domain, home.facts))
    return ProposedChange(Delta(removed=gone), f"retract: {text}", (("Source", "retract"),))


def _fact(home: Home, name: str, prop: str, value: str) -> tuple[set[Triple], str]:
    thing, words = _thing(home, name), home.words
    about = {t for t in home.facts if t[0] == thing}
    found = {t for t in about if called(prop, t[1], words)}
    if value:
        wanted = normal(value)
        found = {t for t in found if wanted in (normal(words.value(t[2])), normal(local(t[2])))}
    if not found:
        known = ", ".join(sorted({local(p) for _, p, _ in about}))
        what = f"{prop} {value}".strip()
        raise UsageError(f"nothing says of {name}: {what}; what is known: {known}")
    if len(found) > 1:
        values = ", ".join(sorted(words.value(t[2]) for t in found))
        raise UsageError(f"{name} has several values for {prop}: {values}; name one of them")
    [triple] = found
    if triple[1] in home.kg.domain.name_properties():
        raise UsageError(f"{name} cannot be without a name; to take it back: kg retract {name}")
    return found, words.sentence(triple)


def _absence(home: Home, name: str) -> tuple[set[Triple], str]:
    """The facts that something is not here or not possible; else those by which something is also
    called so, unless it is a thing's own name."""
    called_so = {t for t in home.facts if str(t[2]) == normal(name)}
    if found := {t for t in called_so if t[1] in (AB.absentItem, AB.absentAction)}:
        return found, f"{normal(name)} is not here"
    own = {normal(home.kg.name(entity)) for entity in home.kg.find(name)}
    found = {t for t in called_so if t[1] == AB.alias and normal(name) not in own}
    text = ", ".join(sorted(home.words.name(t[0]) for t in found))
    return found, f"{normal(name)} is another name for {text}"


def _thing(home: Home, name: str) -> URIRef:
    found = known_as(home, name)
    # Of an action of the pack only what was taught of it besides is among the facts.
    whole = {t[0] for t in home.facts if t[1] == RDF.type}
    mine = [n for n in sorted(found, key=str) if n in whole and isinstance(n, URIRef)]
    if not mine:
        if found:
            raise UsageError(f"{name} is described in actions.ttl; edit the file to take it back")
        near = near_it(home.kg, name)
        raise UsageError(f"nothing is called {name}, and nobody said it is not here{near}")
    if len(mine) > 1:
        text = ", ".join(f"{home.kg.kind_label(node)} {home.words.name(node)}" for node in mine)
        raise UsageError(f"several things are called {name}: {text}")
    return mine[0]


def commit_edits(home: Home, message: str) -> str | None:
    """Commit hand edits of a domain's files and of its kept plans; None if there are none.

    Raises:
        KnowledgeError: the edits leave what the domain does not allow, or no domain; they stay
            as they are, uncommitted.
    """
    versions = home.needed()
    with versions.repo.writing():
        plans = edited_plans(versions.repo, home.domain)
        edited = [*(f"{versions.folder}/{name}" for name in versions.edited()), *plans]
        if not edited:
            return None
        found = by_mistake(edit_faults(versions.repo, home.domain))
        if found:
            text = "; ".join(map(str, found[:_MOST]))
            more = len(found) - _MOST
            see = f"see adaptbot kg validate --domain {home.domain}"
            rest = f"; and {more} more: {see}" if more > 0 else ""
            raise KnowledgeError(f"the edits were not committed and stay as they are: {text}{rest}")
        return commit_hand_edits(versions.repo, edited, message, now(), person())


def verdicts(home: Home, delta: Delta) -> list[tuple[str, str, str]]:
    """Return the tasks whose library plan is judged otherwise after a change: task, old, new."""
    if not delta:
        return []
    before, now = home.kg, after(home, delta)
    found = []
    for task, plan in _plans(before, home.workspace.library(home.domain)):
        if _matters(delta, task, plan, before, now):
            old, new = _verdict(task, plan, before), _verdict(task, plan, now)
            if old != new:
                found.append((task.name, old, new))
    return found


def _plans(kg: Kg, folders: Sequence[Path]) -> Iterator[tuple[Task, str]]:
    """The library's plans for the domain's tasks, and for the names that they bear themselves."""
    from adaptbot_cli.adapters.planner.library import Library, names_in, read_library

    library = Library(tuple(folders), kg.domain, kg=kg)
    names = [task.name for task in kg.domain.tasks]
    names += [plan.names[0] for plan in read_library(*folders)]
    dishes, words = names_in(*folders), WordNet()
    read = (understand(name, kg, words, dishes=dishes).tasks for name in names)
    for task in {task.name: task for tasks in read for task in tasks}.values():
        try:
            yield task, library.propose(Propose(task)).text
        except ModelError:
            continue


def _matters(delta: Delta, task: Task, plan: str, before: Kg, now: Kg) -> bool:
    """Whether a change can touch a plan: it names a thing of it, or may use one without a name."""
    changed = about(delta)
    subjects = {subject for subject, _, _ in delta.removed | delta.added}
    for kg in (before, now):  # a step may use an action, a place or a tool without its name
        prompted = [kind.iri for kind in kg.domain.classes.values() if kind.prompted]
        actions = {action.iri for action in kg.domain.actions.values()}
        if any(node in actions or kg.is_a(node, prompted) for node in subjects):
            return True
    names = {normal(str(value)) for _, _, value in delta.removed | delta.added}
    written = {arg for call in parse(plan).calls for arg in (call.call.action, *call.call.args)}
    return any(
        normal(name) in names or changed & {*before.find(name), *now.find(name)}
        for name in (*written, *task.required)
    )


def _verdict(task: Task, plan: str, kg: Kg) -> str:
    result = check(plan, task, kg)
    return "goal met" if result.goal_met else result.verdict.replace("_", " ")
