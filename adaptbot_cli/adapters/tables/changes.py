"""What changed, for the terminal: by thing, each value with what it was and is."""

from collections.abc import Iterable, Iterator, Sequence

from rich.console import Group, RenderableType
from rich.text import Text

from adaptbot_cli.adapters.tables.words import cell, count, indented
from adaptbot_cli.core.changes import Changes, Edited, ValueChange, Words, by_thing

_SIGNS = {"added": ("+", "green"), "removed": ("-", "red"), "changed": ("~", "yellow")}
_WHOLE = {"added": "new", "removed": "gone", "changed": ""}
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
        sign, style = _SIGNS[entry.sign]
        parts.append(
            Text.assemble((f"{sign} ", style), cell(f"{entry.file}: {entry.name}"), " ", entry.sign)
        )
    parts.append(summary(changes, things))
    return Group(*parts)


def preview(changes: Changes, words: Words) -> RenderableType:
    """Show a change that is not made yet, cut to what a person can look through."""
    return difference(changes, words, _MOST_SHOWN)


def summary(changes: Changes, things: Sequence[Edited]) -> Text:
    """Count what a change comes to."""
    counted = [
        count(sum(1 for thing in things if thing.sign == sign), "thing") + f" {word}"
        for sign, word in (("added", "new"), ("removed", "gone"), ("changed", "changed"))
        if any(thing.sign == sign for thing in things)
    ]
    facts = f"{count(len(changes.delta.added), 'fact')} added, {len(changes.delta.removed)} removed"
    entries = [count(len(changes.entries), "entry", "entries")] if changes.entries else []
    return Text(" · ".join([", ".join(counted) or "nothing", facts, *entries]), "dim")


def _title(thing: Edited, words: Words) -> Text:
    sign, style = _SIGNS[thing.sign]
    word = _WHOLE[thing.sign]
    title = Text.assemble((f"{sign} ", style), cell(words.name(thing.entity), "bold"))
    return title + Text(f"  {word}", style) if word else title


def _row(edit: ValueChange, words: Words) -> tuple[Text, ...]:
    sign, style = _SIGNS[edit.sign]
    values = [words.value(value) for value in (edit.old, edit.new) if value is not None]
    return Text(sign, style), cell(words.label(edit.predicate), "dim"), cell(" → ".join(values))


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
