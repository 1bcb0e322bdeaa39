"""Word knowledge as values: what a lexicon says of a word."""

from dataclasses import dataclass
from typing import Literal, Protocol

Relation = Literal["synonym", "hypernym", "hyponym"]


@dataclass(frozen=True, slots=True)
class Related:
    """A word that a lexicon relates to the one looked up.

    `word` is a lemma in lower case with underscores; `sense` the 1-based rank of the sense of
    the looked-up word; `distance` the number of edges from that sense (0 for a synonym);
    `field` the lexicographer file, such as "noun.food"; `gloss` a short definition, maybe empty.
    """

    word: str
    relation: Relation
    distance: int
    sense: int
    field: str
    gloss: str


class Lexicon(Protocol):
    """Where word knowledge comes from."""

    def related(self, word: str, fields: frozenset[str]) -> tuple[Related, ...]:
        """Return the words related to `word` within `fields`: first senses, then near ones."""
        ...
