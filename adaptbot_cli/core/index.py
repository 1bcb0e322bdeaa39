"""An index of the names of a home's things: which of them a spelling or a slip may mean."""

import sqlite3
from collections.abc import Iterable, Iterator
from typing import Final

from adaptbot_cli.core.names import folded, normal, without_s, words

FOLDED, WITHOUT_S, WORD, BASE, PAIR = range(5)
"""What a thing is found by: its name without accents, case and separators; without any "s"; a word
of it; its normal form without a number at its end; two letters that stand side by side in it."""

_TABLES: Final = """
    CREATE TABLE IF NOT EXISTS things (id INTEGER PRIMARY KEY, iri TEXT UNIQUE, keys INTEGER);
    CREATE TABLE IF NOT EXISTS keys (
        form INTEGER, key TEXT, thing INTEGER, PRIMARY KEY (form, key, thing)
    ) WITHOUT ROWID;
"""
_ALIKE: Final = """
    SELECT iri FROM things JOIN (
        SELECT thing, COUNT(*) AS shared FROM keys WHERE form = ? AND key IN ({}) GROUP BY thing
    ) ON id = thing ORDER BY shared DESC, things.keys, iri
"""


class NameIndex:
    """The things of a home by what their names have in common with other names.

    It never forgets a name, so that it can serve several versions of a home: what it finds is
    looked at in the graph. `place` is a database of SQLite, in memory or a file.

    Raises:
        sqlite3.Error: the file is none, is damaged or cannot be written.
    """

    def __init__(self, place: str = ":memory:") -> None:
        self._database = sqlite3.connect(place, check_same_thread=False)
        self._database.executescript(_TABLES)

    def add(self, named: Iterable[tuple[str, str]]) -> None:
        """Enter things, each as its IRI and one of its names."""
        with self._database:
            for iri, name in named:
                keys = {key for key in _keys(name) if key[1]}
                enter = "INSERT OR IGNORE INTO things (iri, keys) VALUES (?, ?)"
                new = self._database.execute(enter, (iri, len(keys)))
                at = new.lastrowid
                if not new.rowcount:
                    [(at,)] = self._database.execute("SELECT id FROM things WHERE iri = ?", (iri,))
                enter = "INSERT OR IGNORE INTO keys VALUES (?, ?, ?)"
                self._database.executemany(enter, ((*key, at) for key in keys))

    def things(self, form: int, key: str) -> list[str]:
        """Return the IRIs of the things that may have a name with this key, sorted."""
        query = "SELECT iri FROM keys JOIN things ON id = thing WHERE form = ? AND key = ?"
        return sorted(iri for (iri,) in self._database.execute(query, (form, key)))

    def bases(self) -> Iterator[str]:
        """Give the normal form of every name without the number at its end, each once."""
        query = "SELECT DISTINCT key FROM keys WHERE form = ?"
        return (key for (key,) in self._database.execute(query, (BASE,)))

    def alike(self, name: str) -> Iterator[str]:
        """Give the IRIs of the things with a pair of letters that a name has, too: those with the
        most such pairs first, of these those with the shortest names."""
        pairs = sorted(_pairs(name))
        query = _ALIKE.format(", ".join("?" * len(pairs)))
        return (iri for (iri,) in self._database.execute(query, (PAIR, *pairs)))


def key_of(form: int, name: str) -> str:
    """Return the key of a name in one of the forms that give it a single one."""
    if form == FOLDED:
        return folded(name)
    if form == WITHOUT_S:
        return " ".join(without_s(name))
    base, _, number = normal(name).rpartition("_")
    return base if base and number.isdigit() else normal(name)


def _keys(name: str) -> Iterator[tuple[int, str]]:
    yield from ((form, key_of(form, name)) for form in (FOLDED, WITHOUT_S, BASE))
    yield from ((WORD, word) for word in words(name))
    yield from ((PAIR, pair) for pair in _pairs(name))


def _pairs(name: str) -> set[str]:
    text = f"_{normal(name)}_"
    return {text[n : n + 2] for n in range(len(text) - 1)}
