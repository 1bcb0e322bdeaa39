"""What the pictures of progress lines share: where a thing is from when to when, and the words."""

from collections.abc import Iterator
from dataclasses import dataclass

from adaptbot_cli.core.progress import Event, Line, Progress
from adaptbot_cli.core.visible import visible


@dataclass(frozen=True, slots=True)
class Span:
    """A stay of a thing at one place, from one column to before another; column 0 is the start."""

    place: str
    start: int
    end: int


def columns(progress: Progress) -> dict[int, int]:
    """Return the column of each step that was taken, from 1."""
    return {number: at for at, (number, _) in enumerate(progress.steps, start=1)}


def spans(line: Line, progress: Progress) -> Iterator[Span]:
    """Give the stays of a thing in order; a place that is not known gives none."""
    at = columns(progress)
    place, start = line.start, 0
    for event in line.events:
        if event.kind == "place":
            if place:
                yield Span(visible(place), start, at[event.step])
            place, start = event.what[0], at[event.step]
    if place:
        yield Span(visible(place), start, len(at) + 1)


def phrase(event: Event) -> str:
    """Say an event in a few words; a change of place is no phrase but a new span."""
    what = visible(", ".join(event.what))
    match event.kind:
        case "with" | "gained":
            return f"+ {what}"
        case "lost":
            return f"− {what}"
        case "carried":
            return f"in {visible(event.of)} to {what}"
        case "state" if event.of:
            return f"{visible(event.of)}: {what}"
        case _:
            return what


def places(progress: Progress) -> list[str]:
    """Return the places of all spans in the order in which they appear, the hands left out."""
    found = (span.place for line in progress.lines for span in spans(line, progress))
    return [place for place in dict.fromkeys(found) if place not in progress.hands]
