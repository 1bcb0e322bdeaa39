"""Everything that is wrong with the knowledge: where it stands, what caused it, what to do."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rdflib import RDF
from rdflib.term import Node

from adaptbot_cli.core.standing import Wrong
from adaptbot_cli.core.terms import Triple, local
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.inspecting import check_pack
from adaptbot_cli.session.knowing import Home
from adaptbot_cli.session.loading import load
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.core.provenance import Origin

_FAULT = re.compile(r"(?P<file>[\w.]+\.ttl), entry (?P<entry>.+?): (?P<told>.+?)(; (?P<do>.+))?")


def validate(workspace: Workspace, domain: str, files: Sequence[Path] = ()) -> list[Wrong]:
    """Return everything that is wrong with a domain's files, or with the facts of other files.

    What tasks need and is not there comes last, as hints.

    Raises:
        UsageError: there is no such domain.
        KnowledgeError: its folder, or one of the other files, cannot be read.
    """
    from adaptbot_cli.core.faults import faults
    from adaptbot_cli.core.misnamed import lacking

    if files:
        kg = load(workspace, domain, files)
        where = ", ".join(map(str, files))
        wrong = [Wrong(str(fault), where, "correct the file") for fault in faults(kg)]
        return [*wrong, *(_hinted(hint, domain) for hint in lacking(kg))]
    kg_, found, _ = check_pack(workspace, domain)
    home: Home | None = Home(workspace, domain) if found else None
    try:
        home = home if home is not None and home.kg and home.facts else None
    except KnowledgeError:
        home = None  # what cannot be loaded has no facts to look the origin up of
    wrong = [_explained(str(fault), domain, home) for fault in found]
    return [*wrong, *(_hinted(hint, domain) for hint in (lacking(kg_) if kg_ else ()))]


def _hinted(hint: str, domain: str) -> Wrong:
    """A hint of the tasks, in the parts of its sentence."""
    file, _, text = hint.partition(": ")
    message, _, remedy = text.partition("; ")
    return Wrong(message, f"kg/{domain}/{file}", remedy, hint=True)


def _explained(fault: str, domain: str, home: Home | None) -> Wrong:
    """Say of a fault where it stands, which answer caused it and how to get rid of it."""
    match = _FAULT.fullmatch(fault)
    if match is None:
        return Wrong(fault, f"kg/{domain}")
    file, remedy = f"kg/{domain}/{match['file']}", match["do"] or "edit the entry"
    if home is None or match["file"] not in ("attributes.ttl", "state.ttl"):
        return Wrong(f"{match['entry']}: {match['told']}", file, remedy)
    origins = _origins(home, _meant(match["entry"], match["told"], home))
    caused = "; ".join(dict.fromkeys(_origin_text(origin, domain) for origin in origins))
    answers = [origin.answer for origin in origins if origin.answer]
    if answers:
        remedy += f", or adaptbot kg revert --answer {answers[-1]}"
    return Wrong(f"{match['entry']}: {match['told']}", file, remedy, caused)


def _meant(name: str, text: str, home: Home) -> list[Triple]:
    """The facts that a fault is about: those of its thing whose predicate or place it names."""
    words = set(re.split(r"[\s:,()]+", text))
    places = {kind.location_property for kind in home.kg.domain.kinds.values()}
    about = sorted(t for t in home.facts if name in (home.words.name(t[0]), local(t[0])))
    named = [t for t in about if local(t[1]) in words]
    if named:
        return named
    wanted: set[Node | None] = set(places) if "itself" in words else {RDF.type}
    return [t for t in about if t[1] in wanted]


def _origins(home: Home, triples: Sequence[Triple]) -> "list[Origin]":
    from adaptbot_cli.adapters.store.versions import PACK

    if home.versions is None:
        return [PACK] if triples else []
    found = home.versions.origins(triples, home.pack)
    ordered = (found[triple] for triple in triples)
    return sorted(dict.fromkeys(ordered), key=lambda origin: origin.when)


def _origin_text(origin: "Origin", domain: str) -> str:
    if origin.source == "answer":
        by = f" ({origin.by})" if origin.by else ""
        return f'answer {origin.answer}{by}: "{origin.question}" "{origin.said}"'
    known = {
        "pack": f"it came with the {domain} pack",
        "uncommitted": "edited by hand, not committed yet",
        "start": "it was there when the versions began",
    }
    return known.get(origin.source) or f'{origin.source} {origin.revision[:7]}: "{origin.subject}"'
