"""In which file a thing's facts stand, where a large home has many.

One file of attributes and one of states serve most homes. `split` divides each among files of a
folder of its name, by class or by what the pack says (`ab:filedBy`): a commit of one fact then
writes one small file.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

import pyoxigraph
from rdflib.term import Node

from adaptbot_cli.adapters.store.files import MOST
from adaptbot_cli.adapters.store.reading import FACT_FILES, fact_files, main_file
from adaptbot_cli.adapters.store.turtle import (
    KNOWN_PREFIXES,
    Writer,
    declaration,
    engine_term,
    parsed,
)
from adaptbot_cli.core.ask.learning import safe_name
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import Triple, local, node_of
from adaptbot_cli.errors import KnowledgeError

SIZE: Final = 256 * 1024
"""Bytes after which new things go into the next file."""

_PREFIX = re.compile(rb"@prefix ([^\s:<]*): <([^<>\n]*)> \.\n")
_ENTRY = rb"(?:\A|[\n\r.>])[ \t]*(?:(?:[^\s<>:.]*:|<[^<>\n]*)%b[\s<>#]|[^\s\".>]*\\)"
"""Where an entry may begin: behind another one or a directive, with the end of its name or with a
name in which something is escaped."""
_A_FACT = 60
"""About how many bytes a fact takes in a file."""


@dataclass
class Filing:
    """The files of a domain, and which of them its things stand in."""

    files: Mapping[str, bytes]
    kg: Kg
    _grown: dict[str, int] = field(default_factory=dict)

    def holding(self, file: str, subject: Node) -> list[str]:
        """Return the files, `file` or in its folder, in which there may be facts of a subject."""
        family = self._family(file)
        return [n for n in family if self._has(n, subject)] if len(family) > 1 else family or [file]

    def filed(self, file: str, subject: Node, facts: int, added: Collection[Triple]) -> str:
        """Return the file, `file` or one in its folder, in which so many new facts of a subject are
        to stand: that of the subject, else the one that things of its sort are filed in."""
        # What the graph does not know stands in no file: none is searched for it.
        is_known = len(self._family(file)) < 2 or (subject, None, None) in self.kg.facts
        if is_known and (found := self.holding(file, subject)):
            return found[-1]
        name = self._next(file, self._sort(subject, added))
        self._grown[name] = self._grown.get(name, 0) + facts * _A_FACT
        return name

    def heading(self, name: str) -> bytes:
        """Return what a new file begins with: the prefixes of the first of its kind."""
        return _declared(self._prefixes(main_file(name)))

    def split(self) -> dict[str, bytes | None]:
        """Return the files of facts as they are after the split; None for one that is no more.

        Comments go with it.

        Raises:
            KnowledgeError: an entry has no name of its own, or the files would be too many.
        """
        found: dict[str, bytes | None] = {}
        for file in FACT_FILES:
            writer, sizes = Writer(self._prefixes(file)), dict[str, int]()
            parts: dict[str, list[str]] = {file: []}
            for subject, triples in self._about(file):
                sort, block = self._sort(subject, ()), writer.block(engine_term(subject), triples)
                sizes[sort] = sizes.get(sort, 0) + len(block)
                parts.setdefault(_named(file, sort, sizes[sort] // SIZE + 1), []).append(block)
            spare = {name: KNOWN_PREFIXES[name] for name in writer.used}
            heading = _declared({**writer.prefixes, **spare})
            found |= dict.fromkeys(self._family(file))
            for name, blocks in parts.items():
                found[name] = heading + "".join(f"\n{block}\n" for block in blocks).encode()
        many = sum(data is not None for data in found.values())
        if many > MOST // 2:  # more will come with what is learned
            raise KnowledgeError(
                f"{local(self.kg.domain.filed_by)} has so many values that there would be {many:,} "
                f"files, of which a home has {MOST:,} at most; let ab:filedBy in domain.ttl name a "
                "property with fewer."
            )
        return found

    def _about(self, file: str) -> Iterator[tuple[Node, list[Any]]]:
        """The things of the files of one kind, in order, each with what is said of it."""
        about: dict[Any, list[Any]] = {}
        for name in self._family(file):
            for triple in parsed(self.files[name], name):
                terms = (triple.subject, triple.object)
                if any(isinstance(term, pyoxigraph.BlankNode) for term in terms):
                    raise KnowledgeError(
                        f"{name} has an entry without a name of its own (a blank node); give it "
                        "an IRI, then split the files."
                    )
                about.setdefault(triple.subject, []).append(triple)
        yield from sorted((node_of(subject), about[subject]) for subject in about)

    def _family(self, file: str) -> list[str]:
        return self._families.get(file, [])

    @cached_property
    def _families(self) -> dict[str, list[str]]:
        found: dict[str, list[str]] = {}
        for name in fact_files(self.files):
            found.setdefault(main_file(name), []).append(name)
        return found

    def _has(self, name: str, subject: Node) -> bool:
        """Whether a file may have an entry of a subject, however that is written."""
        data, end = self.files[name], re.split("[/#:]", str(subject))[-1].encode()
        if end not in data and b"\\" not in data:
            return False
        return re.search(_ENTRY % re.escape(end), data) is not None

    def _prefixes(self, name: str) -> dict[str, str]:
        data = self.files.get(name, b"")
        found = _PREFIX.finditer(data, 0, data.find(b" ;\n") + 1 or len(data))
        return {match[1].decode(): match[2].decode() for match in found}

    def _sort(self, subject: Node, added: Collection[Triple]) -> str:
        """The name of what a thing is filed by, "" if it has nothing of the sort."""
        by = self.kg.domain.filed_by
        values = [o for s, p, o in added if s == subject and p == by]
        values = values or list(self.kg.facts.objects(subject, by))
        return safe_name(local(min(values))) if values else ""  # type: ignore[type-var]

    def _next(self, file: str, sort: str) -> str:
        """The last file of a sort, or a new one if that is full and there may be more files."""
        if not sort or len(self.files) + len(self._grown) >= MOST:
            return file
        number = 1
        while (name := _named(file, sort, number + 1)) in self.files or name in self._grown:
            number += 1
        name = _named(file, sort, number)
        size = len(self.files.get(name, b"")) + self._grown.get(name, 0)
        return _named(file, sort, number + (size > SIZE))


def _declared(prefixes: Mapping[str, str]) -> bytes:
    return "".join(f"{declaration(n, prefixes[n])}\n" for n in sorted(prefixes)).encode()


def _named(file: str, sort: str, number: int) -> str:
    return f"{file.removesuffix('.ttl')}/{sort}-{number}.ttl" if sort else file
