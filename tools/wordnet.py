"""Builds the shipped copy of WordNet from an installed WordNet 3.0.

Usage: python tools/wordnet.py SOURCE_DICT_DIR [TARGET_DIR]

adaptbot_cli/wordnet/README.md says what is kept and why.
"""

import sys
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from adaptbot_cli.adapters.lexicon import CHECKSUMS, OMITTED_FIELD, TARGET

MAX_GLOSS: Final = 60

# Part of speech -> suffix of its files; only the first two are filled.
FILES: Final = {"n": "noun", "v": "verb", "a": "adj", "r": "adv"}
KEPT_POS: Final = ("n", "v")

# The lexicographer files of WordNet 3.0 in the order of their numbers (lexnames(5WN)). Debian's
# wordnet-base leaves this table out; nltk cannot do without it.
LEXICOGRAPHER_FILES: Final = """
adj.all adj.pert adv.all noun.Tops noun.act noun.animal noun.artifact noun.attribute noun.body
noun.cognition noun.communication noun.event noun.feeling noun.food noun.group noun.location
noun.motive noun.object noun.person noun.phenomenon noun.plant noun.possession noun.process
noun.quantity noun.relation noun.shape noun.state noun.substance noun.time verb.body verb.change
verb.cognition verb.communication verb.competition verb.consumption verb.contact verb.creation
verb.emotion verb.motion verb.perception verb.possession verb.social verb.stative verb.weather
adj.ppl
"""
FIELDS: Final = tuple(LEXICOGRAPHER_FILES.split())

# Not one of WordNet's: the one synset that stands for every sense left out, so that a lemma's
# remaining senses keep the numbers WordNet gave them.
OMITTED_WORD: Final = "omitted_sense"
OMITTED_GLOSS: Final = "a sense of WordNet 3.0 that this copy leaves out"

# The pointers kept. What is an instance ("Eiffel Tower", "Amazon") is left out itself, unless
# something kept stands below it.
INSTANCE_OF: Final = "@i"
ABOVE: Final = ("@", INSTANCE_OF)
BELOW: Final = ("~", "~i")

KEPT_NOUNS: Final = ("animal", "artifact", "body", "food", "object", "plant", "substance")
KEPT_FIELDS: Final = frozenset(
    field
    for field in FIELDS
    if field.startswith("verb.") or field.removeprefix("noun.") in KEPT_NOUNS
)

# Of plants, a synset that nothing stands below is kept only with a plain one-word name: most
# others are species ("bee orchid").
PLAIN_FIELDS: Final = frozenset({"noun.plant"})

# Of these, a synset is kept only if WordNet's own tagged corpus uses it.
USED_FIELDS: Final = frozenset(
    {
        "noun.animal",
        "noun.body",
        "verb.cognition",
        "verb.communication",
        "verb.competition",
        "verb.emotion",
        "verb.social",
        "verb.stative",
        "verb.weather",
    }
)

# Genera, families and orders fill half of noun.plant and noun.animal under this lemma's sense 1.
TAXA: Final = "taxonomic_group"

NOTICE: Final = "  30 This is a trimmed copy; README.md of adaptbot_cli.wordnet says how.  "


class Pointer(NamedTuple):
    """A relation of a synset to another one of the same part of speech."""

    symbol: str
    target: int


@dataclass(frozen=True, slots=True)
class Synset:
    """One line of a data file, as far as it is kept."""

    offset: int
    field: str
    words: tuple[str, ...]
    pointers: tuple[Pointer, ...]
    gloss: str


class Entry(NamedTuple):
    """One line of an index file: a lemma, its tagged senses and its synsets, first sense first."""

    lemma: str
    tagged: str
    offsets: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Part:
    """What a WordNet directory holds for one part of speech."""

    pos: str
    header: tuple[str, ...]
    synsets: dict[int, Synset]
    entries: tuple[Entry, ...]
    exceptions: tuple[str, ...]


def build(source: Path, target: Path = TARGET) -> None:
    """Write the trimmed copy of the WordNet in `source` to `target`.

    Raises OSError when a file of `source` cannot be read, ValueError when it is not WordNet's.
    """
    files = dict(_files(source))
    files[CHECKSUMS] = "".join(
        f"{zlib.crc32(text.encode('ascii')):08x} {name}\n" for name, text in sorted(files.items())
    )
    target.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (target / name).write_bytes(text.encode("ascii"))


def _files(source: Path) -> Iterator[tuple[str, str]]:
    yield "lexnames", _lexnames()
    for pos, suffix in FILES.items():
        part = _trim(_read(source, pos)) if pos in KEPT_POS else _empty(source, pos)
        offsets, data = _data(part)
        yield f"data.{suffix}", data
        yield f"index.{suffix}", _index(part, offsets)
        yield f"{suffix}.exc", "".join(f"{line}\n" for line in part.exceptions)


def _lexnames() -> str:
    numbers = {"noun": 1, "verb": 2, "adj": 3, "adv": 4, OMITTED_FIELD: 1}
    return "".join(
        f"{index:02d}\t{field}\t{numbers[field.split('.')[0]]}\n"
        for index, field in enumerate((*FIELDS, OMITTED_FIELD))
    )


# --- reading ---


def _read(source: Path, pos: str) -> Part:
    suffix = FILES[pos]
    header, lines = _split(source / f"data.{suffix}")
    synsets = [_synset(line, pos) for line in lines]
    return Part(
        pos,
        header,
        {synset.offset: synset for synset in synsets},
        tuple(_entry(line) for line in _split(source / f"index.{suffix}")[1]),
        tuple((source / f"{suffix}.exc").read_text("ascii").splitlines()),
    )


def _empty(source: Path, pos: str) -> Part:
    return Part(pos, _split(source / f"data.{FILES[pos]}")[0], {}, (), ())


def _split(path: Path) -> tuple[tuple[str, ...], list[str]]:
    """Return the licence a WordNet file begins with, and its other lines."""
    lines = path.read_text("ascii").splitlines()
    header = tuple(line for line in lines if line.startswith("  "))
    return header, lines[len(header) :]


def _synset(line: str, pos: str) -> Synset:
    columns, _, gloss = line.partition("|")
    offset, field, _, count, *rest = columns.split()
    size = 2 * int(count, 16)
    # The number after each word (lex_id) is part of its sense key, and stays with it.
    words = tuple(f"{word} {lex_id}" for word, lex_id in _in_tuples(rest[:size], 2))
    pointers = rest[size + 1 : size + 1 + 4 * int(rest[size])]
    return Synset(
        int(offset),
        FIELDS[int(field)],
        words,
        tuple(
            Pointer(symbol, int(other))
            for symbol, other, other_pos, _ in _in_tuples(pointers, 4)
            if other_pos == pos
        ),
        _short(gloss),
    )


def _in_tuples(tokens: list[str], size: int) -> Iterator[tuple[str, ...]]:
    return zip(*[iter(tokens)] * size, strict=True)


def _short(gloss: str) -> str:
    """Return the first definition of a gloss, without examples, cut between words."""
    definition = gloss.split(' "')[0].split(";")[0].strip(" ,:")
    if len(definition) <= MAX_GLOSS:
        return definition
    return definition[: MAX_GLOSS - 3].rsplit(" ", 1)[0].rstrip(",(") + "..."


def _entry(line: str) -> Entry:
    lemma, _, _, symbols, *rest = line.split()
    _, tagged, *offsets = rest[int(symbols) :]
    return Entry(lemma, tagged, tuple(map(int, offsets)))


# --- trimming ---


def _trim(part: Part) -> Part:
    kept = _kept(part)
    ambiguous = _ambiguous(part)
    synsets = {
        offset: synset if offset in ambiguous else replace(synset, gloss="")
        for offset, synset in part.synsets.items()
        if offset in kept
    }
    entries = tuple(
        Entry(entry.lemma, entry.tagged, _ranked(entry.offsets, kept))
        for entry in part.entries
        if not kept.isdisjoint(entry.offsets)
    )
    lemmas = {entry.lemma for entry in entries}
    exceptions = tuple(line for line in part.exceptions if not lemmas.isdisjoint(line.split()[1:]))
    return _with_omitted(Part(part.pos, part.header, synsets, entries, exceptions))


def _kept(part: Part) -> set[int]:
    """Return the synsets worth keeping and all that stands above them."""
    dropped = _below(part, _first_sense(part, TAXA))
    used = _used(part)
    kept = {
        synset.offset
        for synset in part.synsets.values()
        if synset.offset not in dropped and _is_useful(synset, used)
    }
    return _closed(part, kept, *ABOVE)


def _is_useful(synset: Synset, used: set[int]) -> bool:
    if synset.field not in KEPT_FIELDS or _targets(synset, INSTANCE_OF):
        return False
    if synset.field in USED_FIELDS:
        return synset.offset in used
    return (
        synset.field not in PLAIN_FIELDS
        or bool(_targets(synset, *BELOW))
        or any(word.split()[0].isalpha() and word.islower() for word in synset.words)
    )


def _used(part: Part) -> set[int]:
    """Return the synsets with a word tagged in the corpus: those senses come first in an entry."""
    return {offset for entry in part.entries for offset in entry.offsets[: int(entry.tagged)]}


def _ambiguous(part: Part) -> set[int]:
    """Return the synsets with a word of several senses: only there does a gloss tell them apart."""
    return {offset for entry in part.entries if len(entry.offsets) > 1 for offset in entry.offsets}


def _below(part: Part, roots: Iterable[int]) -> set[int]:
    return _closed(part, set(roots), *BELOW)


def _closed(part: Part, start: set[int], *symbols: str) -> set[int]:
    found, todo = set(start), list(start)
    while todo:
        new = set(_targets(part.synsets[todo.pop()], *symbols)) - found
        found |= new
        todo.extend(new)
    return found


def _targets(synset: Synset, *symbols: str) -> list[int]:
    return [pointer.target for pointer in synset.pointers if pointer.symbol in symbols]


def _first_sense(part: Part, lemma: str) -> list[int]:
    return [entry.offsets[0] for entry in part.entries if entry.lemma == lemma]


def _ranked(offsets: tuple[int, ...], kept: set[int]) -> tuple[int, ...]:
    """Return the offsets with 0 for each sense left out, as far as the last one kept."""
    last = max(rank for rank, offset in enumerate(offsets) if offset in kept)
    return tuple(offset if offset in kept else 0 for offset in offsets[: last + 1])


def _with_omitted(part: Part) -> Part:
    omitted = Synset(0, OMITTED_FIELD, (f"{OMITTED_WORD} 0",), (), OMITTED_GLOSS)
    entries = sorted([*part.entries, Entry(OMITTED_WORD, "0", (0,))])
    return Part(
        part.pos, part.header, {0: omitted, **part.synsets}, tuple(entries), part.exceptions
    )


# --- writing ---


def _data(part: Part) -> tuple[dict[int, int], str]:
    """Return where each synset begins in the new data file, and the file."""
    head = _head(part)
    offsets: dict[int, int] = {}
    at = len(head)
    for offset, synset in part.synsets.items():
        offsets[offset] = at
        # Every offset has eight digits, so a line is as long before as after renumbering.
        at += len(_line(synset, part, {}))
    lines = [_line(synset, part, offsets) for synset in part.synsets.values()]
    return offsets, head + "".join(lines)


def _line(synset: Synset, part: Part, offsets: dict[int, int]) -> str:
    pointers = [
        f"{symbol} {offsets.get(target, 0):08d} {part.pos} 0000"
        for symbol, target in synset.pointers
        if symbol in (*ABOVE, *BELOW) and target in part.synsets
    ]
    number = FIELDS.index(synset.field) if synset.field in FIELDS else len(FIELDS)
    columns = [
        f"{offsets.get(synset.offset, 0):08d} {number:02d} {part.pos} {len(synset.words):02x}",
        *synset.words,
        f"{len(pointers):03d}",
        *pointers,
    ]
    return f"{' '.join(columns)} |{synset.gloss}\n"


def _index(part: Part, offsets: dict[int, int]) -> str:
    return _head(part) + "".join(
        f"{lemma} {part.pos} {len(senses)} 0 {len(senses)} {tagged} "
        f"{' '.join(f'{offsets[sense]:08d}' for sense in senses)}\n"
        for lemma, tagged, senses in part.entries
    )


def _head(part: Part) -> str:
    return "".join(f"{line}\n" for line in (*part.header, NOTICE))


def main(arguments: list[str]) -> int:
    """Build from the command line's directories; return the exit code."""
    if len(arguments) not in (1, 2):
        print(__doc__, file=sys.stderr)
        return 2
    build(*map(Path, arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
