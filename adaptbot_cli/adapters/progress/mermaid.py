"""Progress lines as a Mermaid flowchart, which forges and notebooks draw."""

from collections.abc import Iterator

from adaptbot_cli.adapters.progress.spans import phrase
from adaptbot_cli.core.progress import Line, Progress
from adaptbot_cli.core.visible import visible


def mermaid(progress: Progress) -> str:
    """Return the flowchart: a row for each thing, its stations in order, the steps between them."""
    calls = dict(progress.steps)
    lines = ["flowchart LR"]
    # Mermaid stacks what is not connected from below.
    for number, line in reversed(list(enumerate(progress.lines))):
        lines.append(f"  subgraph t{number}[{_text(line.name)}]")
        lines.append("    direction LR")
        lines += [f"    {told}" for told in _stations(f"t{number}s", line, calls)]
        lines.append("  end")
    if not progress.lines:
        lines.append(f"  nothing[{_text('no step moves or changes anything')}]")
    return "\n".join(lines) + "\n"


def _stations(prefix: str, line: Line, calls: dict[int, str]) -> Iterator[str]:
    """The nodes of a thing's way: one for where it starts, one for each step it takes part in."""
    steps: dict[int, list[str]] = {}
    moved = set()
    for event in line.events:
        # A line that begins with + or − would be a list to Mermaid.
        words = phrase(event).replace("+ ", "with ", 1).replace("− ", "without ", 1)
        steps.setdefault(event.step, []).append(words)
        moved |= {event.step} if event.kind == "place" else set()
    yield f"{prefix}0([{_text(line.start or line.kind)}])"
    for count, (step, told) in enumerate(steps.items(), start=1):
        text = _text(*told)
        node = f"[{text}]" if step in moved else f"({text})"
        edge = _text(f"{step} {visible(calls[step]).partition('(')[0]}")
        yield f"{prefix}{count - 1} -->|{edge}| {prefix}{count}{node}"


def _text(*lines: str) -> str:
    """Return quoted text; what Mermaid or HTML would read as more than text is an entity code."""
    return '"' + "<br/>".join(map(_escaped, lines)) + '"'


def _escaped(text: str) -> str:
    return "".join(c if c.isalnum() or c in " _-,:()" else f"#{ord(c)};" for c in visible(text))
