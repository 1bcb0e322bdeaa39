"""Word knowledge as values: senses and related words of a lexicon."""

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


@dataclass(frozen=True, slots=True)
class Sense:
    """A meaning of a word: its base form ("boil" of "boiled") and its lexicographer file."""

    base: str
    field: str


class Lexicon(Protocol):
    """Where word knowledge comes from."""

    def senses(self, word: str) -> tuple[Sense, ...]:
        """Return the noun and verb senses of a word, inflected or not; none if it is unknown."""
        ...

    def related(self, word: str, fields: frozenset[str]) -> tuple[Related, ...]:
        """Return the words related to `word` within `fields`: first senses, then near ones."""
        ...


class NoLexicon:
    """A lexicon without words."""

    def senses(self, word: str) -> tuple[Sense, ...]:
        """Return nothing, whatever the word."""
        return ()

    def related(self, word: str, fields: frozenset[str]) -> tuple[Related, ...]:
        """Return nothing, whatever the word."""
        return ()
