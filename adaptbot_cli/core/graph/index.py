"""An index of the names of a home's things: which of them a spelling or a slip may mean."""

import re
from collections.abc import Iterable, Iterator
from typing import Final

from adaptbot_cli.core.names import folded, normal, without_s, words

BASE, FOLDED, WITHOUT_S, WORD, PAIR = range(5)
"""What a name is found by, each without a number at its end: its normal form; the same without
accents and separators; without any "s"; a word of it; two letters side by side in it."""

_TABLES: Final = """
    CREATE TABLE IF NOT EXISTS bases (id INTEGER PRIMARY KEY, base TEXT UNIQUE, keys INTEGER);
    CREATE TABLE IF NOT EXISTS keys (
        form INTEGER, key TEXT, base INTEGER, PRIMARY KEY (form, key, base)
    ) WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS things (
        base INTEGER, number TEXT, iri TEXT, PRIMARY KEY (base, number, iri)
    ) WITHOUT ROWID;
"""
_ALIKE: Final = """
    SELECT iri FROM things JOIN (
        SELECT base AS at, COUNT(*) AS shared FROM keys WHERE form = ? AND key IN ({}) GROUP BY base
    ) ON things.base = at JOIN bases ON id = at
    ORDER BY shared DESC, keys, number != ?, number, iri LIMIT ?
"""
_NUMBER = re.compile(r"(.*[^\W\d])_*(\d+)")


class NameIndex:
    """The things of a home by what their names have in common with other names.

    It never forgets a name, so that it can serve several versions of a home: what it finds is
    looked at in the graph. `place` is a database of SQLite, in memory or a file.

    Raises:
        sqlite3.Error: the file is none, is damaged or cannot be written.
    """

    def __init__(self, place: str = ":memory:") -> None:
        import sqlite3  # many commands need no index

        self._database = sqlite3.connect(place, check_same_thread=False)
        self._database.executescript(_TABLES)

    def add(self, named: Iterable[tuple[str, str]]) -> None:
        """Enter things, each as its IRI and one of its names."""
        known: dict[str, int] = {}
        with self._database as database:
            for iri, name in named:
                base, number = parted(name)
                if base not in known:
                    known[base] = self._enter(base)
                row = (known[base], number, iri)
                database.execute("INSERT OR IGNORE INTO things VALUES (?, ?, ?)", row)

    def _enter(self, base: str) -> int:
        [found] = self._database.execute("SELECT MAX(id) FROM bases WHERE base = ?", (base,))
        if found[0] is not None:
            return int(found[0])
        keys = {key for key in _keys(base) if key[1]}
        enter = "INSERT INTO bases (base, keys) VALUES (?, ?)"
        at = self._database.execute(enter, (base, len(keys))).lastrowid or 0
        self._database.executemany("INSERT INTO keys VALUES (?, ?, ?)", ((*k, at) for k in keys))
        return at

    def copy(self, place: str) -> None:
        """Write the whole index into a new database."""
        import sqlite3

        with sqlite3.connect(place) as database:
            self._database.backup(database)
        database.close()

    def things(self, form: int, key: str, number: str | None = None) -> list[str]:
        """Return the IRIs of the things that may have a name with this key, and with this number
        ("" for none) or any, sorted."""
        query = "SELECT iri FROM keys JOIN things USING (base) WHERE form = ? AND key = ?"
        given: tuple[object, ...] = (form, key)
        if number is not None:
            query, given = f"{query} AND number = ?", (form, key, number)
        return sorted({iri for (iri,) in self._database.execute(query, given)})

    def bases(self) -> list[str]:
        """Return the normal form of every name without its number, each once."""
        return [base for (base,) in self._database.execute("SELECT base FROM bases ORDER BY base")]

    def alike(self, name: str, most: int) -> list[str]:
        """Return the IRIs of at most so many things whose names share a pair of letters with a
        name: those with the most such pairs first, then the shortest, then those of its number.
        A thing with several such names stands there once for each."""
        base, number = parted(name)
        pairs = sorted(_pairs(base))
        query = _ALIKE.format(", ".join("?" * len(pairs)))
        found = self._database.execute(query, (PAIR, *pairs, number, most))
        return [iri for (iri,) in found]


def parted(name: str) -> tuple[str, str]:
    """Return the normal form of a name without the number at its end, and the number: "toy_1" as
    toy and 1."""
    whole = normal(name)
    found = _NUMBER.fullmatch(whole)
    return (found[1].rstrip("_"), found[2]) if found else (whole, "")


def _keys(base: str) -> Iterator[tuple[int, str]]:
    yield from ((BASE, base), (FOLDED, folded(base)), (WITHOUT_S, " ".join(without_s(base))))
    yield from ((WORD, word) for word in words(base))
    yield from ((PAIR, pair) for pair in _pairs(base))


def _pairs(base: str) -> set[str]:
    text = f"_{base}_"
    return {text[n : n + 2] for n in range(len(text) - 1)}
