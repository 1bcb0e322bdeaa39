"""What is wrong with a pack, noted while reading goes on, so that all of it is told at once."""

from dataclasses import dataclass, field

from rdflib import URIRef

from adaptbot_cli.errors import PackError

NOTHING = URIRef("")
"""Stands for an IRI that is missing; its lack has been noted, so nothing more is said of it."""


@dataclass(slots=True)
class Notes:
    """The faults found so far, in the order found, each once.

    A doubt is a likely fault: it is told by a check, and keeps nothing from being loaded.
    """

    _found: dict[str, None] = field(default_factory=dict)
    _doubts: dict[str, None] = field(default_factory=dict)

    def add(self, where: str, problem: str, remedy: str) -> None:
        """Note a fault: "FILE, entry NAME: what is wrong; what to do"."""
        self._found[f"{where}: {problem}; {remedy}"] = None

    def doubt(self, where: str, problem: str, remedy: str) -> None:
        """Note a likely fault, in the same form."""
        self._doubts[f"{where}: {problem}; {remedy}"] = None

    @property
    def sentences(self) -> list[str]:
        """The faults as sentences, then the likely ones."""
        return [*self._found, *self._doubts]

    def refuse(self) -> None:
        """Raise PackError if there is a fault."""
        if not self._found:
            return
        first, *others = self._found
        more = f" (and {len(others)} more: see `adaptbot domain check`)" if others else ""
        raise PackError(f"{first}{more}")
