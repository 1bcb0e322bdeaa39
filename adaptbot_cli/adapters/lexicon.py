"""Word knowledge from the shipped WordNet, read through nltk; and the lexicon that knows nothing.

nltk and its index take longer to open than most commands to run, so they are opened for related
words only, and what they were once asked is kept in the user's cache. Which senses a word has,
which every request asks, is looked up in the same files.
"""

import atexit
import io
import json
import sys
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import astuple
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple, get_args

from adaptbot_cli import cache
from adaptbot_cli.core.words import NoLexicon, Related, Relation, Sense
from adaptbot_cli.errors import LexiconError

TARGET: Final = Path(__file__).parents[1] / "wordnet" / "data" / "corpora" / "wordnet"
"""The files of the shipped WordNet, as `tools/wordnet.py` builds them."""
CHECKSUMS: Final = "CHECKSUMS"
OMITTED_FIELD: Final = "omitted"
"""The field of the one synset that stands for every sense that the shipped WordNet leaves out."""
MAX_HYPERNYM: Final = 3
MAX_HYPONYM: Final = 2
__all__ = ["NoLexicon", "WordNet"]

REMEDY: Final = "Install adaptbot-cli again to restore its WordNet."
POS: Final = {"n": "noun", "v": "verb"}
"""The parts of speech that are looked up, and how their files end."""
ENDINGS: Final = {
    "n": "s: ses:s ves:f xes:x zes:z ches:ch shes:sh men:man ies:y",
    "v": "s: ies:y es:e es: ed:e ed: ing:e ing:",
}
"""The inflections that WordNet detaches (morphy(7WN)), each with what is put in its place."""
_KIND: Final = "words"
_MOST_WORDS: Final = 5_000
"""How many words are kept with what is related to them."""
RELATIONS: Final[tuple[Relation, ...]] = get_args(Relation)


class WordNet:
    """WordNet 3.0 as shipped with this package: no network, no nltk configuration.

    Costs nothing until the first `related` call for words that were not asked for before, which
    imports nltk and loads the index.
    """

    def __init__(self, folder: Path = TARGET) -> None:
        """Use the files in `folder`, as `tools/wordnet.py` writes them."""
        self._folder = folder

    def senses(self, word: str) -> tuple[Sense, ...]:
        """Return the noun and verb senses of a word. Raises LexiconError as `related` does."""
        lemmas = _lemmas(self._folder)
        found = (tuple(lemmas.senses(spelling)) for spelling in _spellings(word))
        return next(filter(None, found), ())

    def related(self, word: str, fields: frozenset[str]) -> tuple[Related, ...]:
        """Return the words related to `word`: synonyms, hypernyms to distance 3, hyponyms to 2.

        Both the sense looked up and the related word lie in `fields` (such as "noun.food"), and
        so does all between them. Words come by sense, distance, relation, and alphabet; one that
        several paths lead to comes once per sense and relation, at its shortest distance. `word`
        may be inflected, in any case, and joined by spaces, hyphens or underscores; a word
        unknown to WordNet has no related ones.

        Raises LexiconError when a file is missing or damaged.
        """
        known = _answers(self._folder)
        key = " ".join((word, *sorted(fields)))
        if key not in known.answers:
            nearest: dict[tuple[object, ...], Related] = {}
            for related in sorted(self._related(word, fields - {OMITTED_FIELD}), key=_rank):
                same = (related.sense, related.relation, related.word, related.field)
                nearest.setdefault(same, related)
            known.add(key, tuple(nearest.values()))
        return known.answers[key]

    def _related(self, word: str, fields: frozenset[str]) -> Iterator[Related]:
        reader = _open(self._folder)
        found = (reader.senses(spelling) for spelling in _spellings(word))
        for sense in next(filter(None, found), []):
            if sense.synset.lexname() in fields:
                yield from _around(sense, fields)


class _Sense(NamedTuple):
    """A sense of a base form, its rank in all of WordNet, and nltk's synset."""

    form: str
    rank: int
    synset: Any


def _rank(related: Related) -> tuple[object, ...]:
    relation = RELATIONS.index(related.relation)
    by_words = (related.word, related.field, related.gloss)
    return (related.sense, related.distance, relation, *by_words)


def _spellings(word: str) -> Iterable[str]:
    """Return the ways to join a name's words, in the order that WordNet's own search tries them."""
    name = "_".join(word.lower().split())
    apart, hyphened = name.replace("-", "_"), name.replace("_", "-")
    return dict.fromkeys((name, apart, hyphened, apart.replace("_", "")))


def _around(sense: _Sense, fields: frozenset[str]) -> Iterator[Related]:
    yield from _words(sense, sense.synset, "synonym", 0)
    for distance, synset in _reach(sense.synset, "hypernyms", MAX_HYPERNYM, fields):
        yield from _words(sense, synset, "hypernym", distance)
    for distance, synset in _reach(sense.synset, "hyponyms", MAX_HYPONYM, fields):
        yield from _words(sense, synset, "hyponym", distance)


def _words(sense: _Sense, synset: Any, relation: Relation, distance: int) -> Iterator[Related]:
    for name in synset.lemma_names():
        word = name.lower()
        # A lemma can be its own synonym, and even its own hypernym in another sense.
        if word != sense.form:
            gloss = synset.definition()
            yield Related(word, relation, distance, sense.rank, synset.lexname(), gloss)


def _reach(start: Any, step: str, limit: int, fields: frozenset[str]) -> Iterator[tuple[int, Any]]:
    """Walk from a synset in rings by one of its methods, without leaving `fields`."""
    seen, ring = {start}, [start]
    for distance in range(1, limit + 1):
        reached = {other for synset in ring for other in getattr(synset, step)()} - seen
        ring = [synset for synset in reached if synset.lexname() in fields]
        seen |= reached
        for synset in ring:
            yield distance, synset


class _Files:
    """The files of a folder, checked against the sums that the build wrote."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def text(self, name: str) -> str:
        try:
            # Universal newlines: the offsets hold even where git checked out CRLF.
            text = (self._folder / name).read_text("ascii")
        except (OSError, ValueError) as error:
            raise LexiconError(f"Cannot read {self._folder / name} ({error}). {REMEDY}") from error
        if name != CHECKSUMS and self._sums.get(name) != f"{zlib.crc32(text.encode()):08x}":
            raise LexiconError(f"{self._folder / name} is damaged. {REMEDY}")
        return text

    @cached_property
    def _sums(self) -> dict[str, str]:
        lines = self.text(CHECKSUMS).splitlines()
        return {name: digest for digest, _, name in (line.partition(" ") for line in lines)}


class _Lemmas:
    """The senses of words, from the index and the data files, without nltk."""

    def __init__(self, folder: Path) -> None:
        files = _Files(folder)
        self._index = {pos: files.text(f"index.{name}") for pos, name in POS.items()}
        self._data = {pos: files.text(f"data.{name}") for pos, name in POS.items()}
        self._fields = [line.split()[1] for line in files.text("lexnames").splitlines()]
        lines = ((pos, files.text(f"{name}.exc")) for pos, name in POS.items())
        self._odd = {
            pos: {words[0]: words[1:] for words in map(str.split, text.splitlines())}
            for pos, text in lines
        }

    def senses(self, spelling: str) -> Iterator[Sense]:
        """Give each sense of the base forms of a word once, nouns first, in WordNet's order."""
        found = (
            Sense(form, self._fields[int(self._data[pos][offset + 9 : offset + 11])])
            for pos in POS
            for form in self._forms(spelling, pos)
            for offset in self._offsets(form, pos)
        )
        yield from dict.fromkeys(found)

    def _forms(self, spelling: str, pos: str) -> Iterable[str]:
        """The word itself and what it may be an inflection of; not all of them are words."""
        odd = self._odd[pos].get(spelling)
        rules = (rule.split(":") for rule in ENDINGS[pos].split())
        regular = (spelling.removesuffix(end) + new for end, new in rules if spelling.endswith(end))
        return dict.fromkeys((spelling, *(regular if odd is None else odd)))

    def _offsets(self, lemma: str, pos: str) -> list[int]:
        """Where the synsets of a lemma stand in the data file; none if it is no lemma."""
        start = self._index[pos].find(f"\n{lemma} {pos} ") if lemma else -1
        if start < 0:
            return []
        line = self._index[pos][start + 1 : self._index[pos].index("\n", start + 1)]
        return [int(offset) for offset in line.split()[-int(line.split()[2]) :]]


_lemmas = lru_cache(maxsize=1)(_Lemmas)


class _Answers:
    """The related words that were asked for, in this process or, from the cache, before."""

    def __init__(self, folder: Path) -> None:
        sums, code = _Files(folder).text(CHECKSUMS), Path(__file__).read_text("utf-8")
        self._key = cache.key_of(text.encode() for text in (str(folder), sums, code))
        self.answers: dict[str, tuple[Related, ...]] = {}
        with suppress(ValueError, TypeError, AttributeError):
            kept = json.loads(cache.read(_KIND, self._key) or b"{}")
            self.answers = {k: tuple(Related(*r) for r in found) for k, found in kept.items()}
        self._new = False

    def add(self, key: str, found: tuple[Related, ...]) -> None:
        """Remember an answer; it is kept when the process ends."""
        self.answers[key] = found
        if not self._new:
            self._new = True
            atexit.register(self._keep)

    def _keep(self) -> None:
        kept = [*self.answers.items()][-_MOST_WORDS:]
        record = {key: [astuple(related) for related in found] for key, found in kept}
        cache.write(_KIND, self._key, json.dumps(record).encode(), 1)


_answers = lru_cache(maxsize=1)(_Answers)


@lru_cache(maxsize=1)
def _open(folder: Path) -> Any:
    """Open the files of a folder: once in a process, for half a second's work each time."""
    if absent := "scipy" not in sys.modules:
        sys.modules["scipy"] = None  # type: ignore[assignment]
    try:  # nltk takes scipy if it is there, which takes a second and a half, and is not used
        from nltk.corpus.reader.wordnet import WordNetCorpusReader  # type: ignore[import-untyped]
        from nltk.data import PathPointer  # type: ignore[import-untyped]
    finally:
        if absent:
            del sys.modules["scipy"]

    files = _Files(folder)

    class ShippedReader(WordNetCorpusReader):  # type: ignore[misc]
        """nltk's reader, except for where bytes come from and what is done besides."""

        def open(self, file: str) -> io.StringIO:
            # nltk's own would have the folder on the global nltk.data.path, and refuses files
            # that are hard links (as uv installs them) or group-writable (as in many checkouts).
            # The text is ASCII, so WordNet's byte offsets are StringIO's positions.
            return io.StringIO(files.text(file))

        def map_wn(self, version: str = "wordnet") -> None:
            """Skip the mapping to WordNet 3.0, for which nltk searches the user's corpora."""

        def senses(self, spelling: str) -> list[_Sense]:
            return [
                _Sense(form, rank, self.synset_from_pos_and_offset(pos, offset))
                for pos in POS
                for form in self._morphy(spelling, pos)
                for rank, offset in enumerate(self._lemma_pos_offset_map[form][pos], start=1)
            ]

    # The reader only asks that its root be a PathPointer; a string would go through nltk's list
    # of allowed folders.
    PathPointer.register(_Files)
    # No multilingual data: None would warn of that.
    return ShippedReader(files, omw_reader=False)
