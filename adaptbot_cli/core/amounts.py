"""Amounts that models write around the name of a thing: "2 eggs", "a pinch of salt"."""

import re
from collections.abc import Iterator

from adaptbot_cli.core.names import normal

_NUMBER = r"(?:\d[\d./]*[a-z]*|[½¼¾])"
# Which words are measures is not known here: without an "of" only a number goes, not a word.
_AMOUNTS = (
    re.compile(rf"(?:{_NUMBER}|an?|some) (?:[a-z]+ ){{0,2}}of (.+)"),
    re.compile(rf"(?:{_NUMBER}|an?|the|some) (.+)"),
    re.compile(rf"(.+?) ?\({_NUMBER}[^()]*\)"),
)


def without_amount(name: str) -> Iterator[tuple[str, bool]]:
    """Give what a name may be without its amount, and whether that is the one thing ("the egg")."""
    said = normal(name).replace("_", " ")
    for amount in _AMOUNTS:
        match = amount.fullmatch(said)
        rest = match[1].removeprefix("the ") if match else ""
        if rest:
            yield rest, said.startswith("the ")
