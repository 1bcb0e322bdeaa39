"""Who taught what and when, and what a change comes to, for the terminal."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

from rdflib import URIRef
from rich.console import Group, RenderableType
from rich.text import Text

from adaptbot_cli.adapters.display.cells import Mark, cell, count, indented, joined, minute, noted
from adaptbot_cli.adapters.display.things import Plain, action
from adaptbot_cli.core.graph.terms import AB, Triple
from adaptbot_cli.core.view.changes import PARTS, Changes, Edited, ValueChange, Words, by_thing
from adaptbot_cli.core.view.provenance import Chapter, Origin, Turnover, answer_id

_SIGNS = {
    "added": Mark("+", "green"),
    "removed": Mark("-", "red"),
    "changed": Mark("~", "yellow"),
}
_WHOLE = {"added": "new", "removed": "gone", "changed": "changed"}
_MOST_SHOWN = 40


def difference(changes: Changes, words: Words, most: int | None = None) -> RenderableType:
    """Show a change by thing; of more than `most` things only the first, the rest counted."""
    things = by_thing(changes.delta, words)
    shown = things if most is None else things[:most]
    parts: list[RenderableType] = []
    for thing in shown:
        parts += [_title(thing, words), indented(_row(edit, words) for edit in thing.edits)]
    if len(shown) < len(things):
        parts.append(Text(f"… and {count(len(things) - len(shown), 'more thing')}", "dim"))
    for entry in changes.entries:
        parts.append(noted(_SIGNS[entry.sign], f"{entry.file}: {entry.name} {entry.sign}"))
    parts.append(summary(changes, things))
    return Group(*parts)


def preview(changes: Changes, words: Words) -> RenderableType:
    """Show a change that is not made yet, cut to what a person can look through."""
    return difference(changes, words, _MOST_SHOWN)


def summary(changes: Changes, things: Sequence[Edited]) -> Text:
    """Count what a change comes to."""
    tally: Counter[str] = Counter(thing.sign for thing in things)
    counted = [f"{count(tally[s], 'thing')} {word}" for s, word in _WHOLE.items() if tally[s]]
    facts = f"{count(len(changes.delta.added), 'fact')} added, {len(changes.delta.removed)} removed"
    entries = [count(len(changes.entries), "entry", "entries")] if changes.entries else []
    return Text(" · ".join([", ".join(counted) or "nothing", facts, *entries]), "dim")


def _title(thing: Edited, words: Words) -> Text:
    mark = _SIGNS[thing.sign]
    title = noted(mark, words.name(thing.entity), "bold")
    word = "" if thing.sign == "changed" else f"  {_WHOLE[thing.sign]}"
    return title.append(word, mark.style)


def _row(edit: ValueChange, words: Words) -> tuple[Text, ...]:
    mark = _SIGNS[edit.sign]
    values = [words.value(value) for value in (edit.old, edit.new) if value is not None]
    return (
        Text(mark.sign, mark.style),
        cell(words.label(edit.predicate), "dim"),
        cell(" → ".join(values)),
    )


def patch_notes(changes: Changes) -> Iterator[str]:
    """Give what a patch cannot hold, as comment lines."""
    for entry in changes.entries:
        yield f"# not in this patch: {entry.file}, entry {entry.name}: {entry.sign}"


def verdicts(changed: Iterable[tuple[str, str, str]]) -> RenderableType:
    """Show which tasks' library plans are judged otherwise."""
    rows = [(cell(task), cell(f"{old} → {new}")) for task, old, new in changed]
    if not rows:
        return Text("no plan of the library is judged otherwise", "dim")
    title = Text(f"{count(len(rows), 'plan')} of the library would be judged otherwise", "yellow")
    return Group(title, indented(rows))


_SOURCES = {
    "pack": "came with the {domain} pack",
    "start": "was there when the versions began",
    "state": "the state that an executed plan left",
    "hand edit": "edited by hand",
    "import": "imported",
    "retract": "retracted",
    "revert": "reverted",
    "update": "changed by a SPARQL update",
    "git": "committed with git",
    "uncommitted": "edited by hand, not committed yet",
}


def log(chapters: Sequence[Chapter], words: Words, detailed: bool) -> RenderableType:
    """Show what each commit taught, newest first; with `detailed` every fact of it."""
    parts: list[RenderableType] = []
    for chapter in chapters:
        parts.append(_head(chapter))
        if chapter.start:
            text = f"{count(len(chapter.changes.delta.added), 'fact')} to begin with"
            parts.append(indented([(Text(text, "dim"),)]))
        elif detailed or not chapter.answers:
            known = words.also(chapter.changes.delta.added).also(chapter.changes.delta.removed)
            parts.append(indented([(difference(chapter.changes, known, 12),)]))
        else:
            parts.append(indented(_answers(chapter)))
            rest = _beside(chapter)
            parts += [indented([(rest,)])] if rest else []
    return Group(*parts)


def _head(chapter: Chapter) -> RenderableType:
    origin = chapter.origin
    planner = "" if origin.planner == "none" else origin.planner
    text = joined((chapter.by(), origin.task, origin.robot, planner), "")
    first = Text.assemble((origin.revision[:7], "yellow"), f"  {minute(origin.when)}  ", text)
    if chapter.answers:
        return first
    return Group(first, indented([(cell(origin.subject, "bold"),)]))


def _answers(chapter: Chapter) -> Iterable[tuple[Text, ...]]:
    for answer, sentence in zip(chapter.answers, chapter.sentences, strict=True):
        number = answer_id(chapter.origin.revision, answer.number)
        yield Text(number, "dim"), cell(sentence) + _likely(answer.suggestion)


def _likely(reason: str) -> Text:
    """A note that a likely answer was accepted as it stood."""
    return cell(f"  accepted suggestion, {reason}", "yellow") if reason else Text()


def _beside(chapter: Chapter) -> Text | None:
    """What a run's commit took along that no answer taught."""
    value = sum(len(answer.facts) for answer in chapter.answers)
    delta = chapter.changes.delta
    more = len(delta.added) + len(delta.removed) - value
    entries = [f"{entry.file}: {entry.name} {entry.sign}" for entry in chapter.changes.entries]
    parts = [*([f"{count(more, 'fact')} edited by hand"] if more > 0 else []), *entries]
    return cell(f"and {', '.join(parts)}", "dim") if parts else None


def why(
    name: str,
    facts: Mapping[Triple, Origin],
    past: Sequence[Turnover],
    words: Words,
    about: Plain | None = None,
) -> RenderableType:
    """Show where facts come from: one block an origin, the pack's last. Of an action that nobody
    taught (`about`) what it does is shown, as its file has it."""
    by_origin: dict[Origin, list[Triple]] = {}
    parts_shown = {value for _, predicate, value in facts if predicate in PARTS}
    explained = {subject for subject, predicate, _ in facts if predicate == AB.explain}
    for triple, origin in facts.items():
        if triple[0] in parts_shown or (triple[1] == AB.effect and triple[0] in explained):
            continue  # shown with the action, in words
        by_origin.setdefault(origin, []).append(triple)
    ordered = sorted(by_origin, key=lambda origin: (origin.when, origin.answer), reverse=True)
    parts: list[RenderableType] = [cell(name, "bold")]
    for origin in ordered:
        triples = sorted(by_origin[origin], key=lambda t: words.order(t[1]))
        rows = [(cell(words.label(p), "dim"), cell(words.value(value))) for _, p, value in triples]
        parts += [origin_of(origin, words), indented(rows)]
    if about is not None and not any(subject == URIRef(about["iri"]) for subject, _, _ in facts):
        parts += [cell("nobody taught it: it is as actions.ttl has it", "cyan"), action(about)]
    if past:
        parts += [Text("before and since", "bold"), indented(_past(past, words))]
    return Group(*parts)


def origin_of(origin: Origin, words: Words) -> RenderableType:
    """Show where something comes from: question and answer, or what else made it so."""
    about = (
        origin.answer or origin.revision[:7],
        origin.by or origin.author,
        minute(origin.at or origin.when),
        origin.task,
        origin.robot,
        "" if origin.planner == "none" else origin.planner,
        origin.transcript,
    )
    if origin.source != "answer":
        lines = [cell(_source(origin, words), "cyan")]
        if origin.source in ("import", "git", "hand edit", "revert", "update", "retract"):
            lines.append(cell(origin.subject))
    else:
        lines = [
            Text.assemble(("? ", "cyan"), cell(origin.question)),
            Text.assemble(("> ", "cyan"), cell(origin.said), _likely(origin.suggestion)),
        ]
    last = joined(about)
    return Group(*lines, *([last] if last.plain else []))


def _source(origin: Origin, words: Words) -> str:
    """Where a fact comes from that no answer has taught; a robot's step by its call."""
    step = origin.subject.removeprefix("state: ")
    if origin.source == "state" and step[:1].isdigit():
        return f"the robot's step {step}"
    return _SOURCES.get(origin.source, origin.source).format(domain=words.domain.name)


def _past(past: Sequence[Turnover], words: Words) -> Iterable[tuple[Text, ...]]:
    for turn in past:
        origin = turn.origin
        style = "green" if turn.sign == "+" else "red"
        text = origin.question if origin.source == "answer" else _source(origin, words)
        yield (
            Text(turn.sign, style),
            cell(words.value(turn.triple[2])),
            joined((origin.answer or origin.revision[:7], minute(origin.when), text)),
        )
