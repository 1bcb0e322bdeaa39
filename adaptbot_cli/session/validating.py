"""Everything that is wrong with the knowledge: where it stands, what caused it, what to do."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rdflib import RDF
from rdflib.term import Node

from adaptbot_cli.core.standing import Wrong
from adaptbot_cli.core.terms import Triple, local
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.knowing import Home
from adaptbot_cli.session.loading import load
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.core.kg import Kg
    from adaptbot_cli.core.provenance import Origin


def validate(workspace: Workspace, domain: str, files: Sequence[Path] = ()) -> list[Wrong]:
    """Return everything that is wrong with a domain's files, or with the facts of other files.

    Raises:
        UsageError: there is no such domain.
    """
    from adaptbot_cli.core.faults import faults

    where = workspace.folder(domain)
    try:
        kg = load(workspace, domain, files)
    except KnowledgeError as error:
        remedy = "correct the file; `adaptbot kg diff` and git tell what changed in it"
        return [Wrong(str(error), str(where), remedy)]
    found = faults(kg)
    if files:
        return [Wrong(fault, ", ".join(map(str, files)), "correct the file") for fault in found]
    home = Home(workspace, domain)
    return [_explained(fault, home, kg) for fault in found]


def _explained(fault: str, home: Home, kg: "Kg") -> Wrong:
    """Say of a fault what it stands in, which answer caused it and how to get rid of it."""
    file, _, _ = fault.partition(": ")
    if file.partition(",")[0] in ("domain.ttl", "actions.ttl", "tasks.ttl"):
        return Wrong(fault, f"kg/{home.domain}/{file.partition(',')[0]}", "edit the entry")
    triples = _meant(fault, home, kg)
    origins = _origins(home, triples)
    where = {f"kg/{home.domain}/{_file(kg, t)}" for t in triples} or {f"kg/{home.domain}"}
    caused = "; ".join(dict.fromkeys(_told(origin, home.domain) for origin in origins))
    answers = [origin.answer for origin in origins if origin.answer]
    name = fault.partition(": ")[0]
    remedy = f"adaptbot kg retract {name} {local(triples[0][1])}" if triples else "edit the file"
    if len(triples) > 1 and triples[0][1] != RDF.type:
        remedy = f"{remedy} VALUE"
    if triples and triples[0][1] == RDF.type:
        remedy = f"remove the wrong line of {name}"
    if answers:
        remedy += f", or adaptbot kg revert --answer {answers[-1]}"
    return Wrong(fault, ", ".join(sorted(where)), remedy, caused)


def _meant(fault: str, home: Home, kg: "Kg") -> list[Triple]:
    """The facts that a fault is about: those of its thing whose predicate or place it names."""
    name, _, said = fault.partition(": ")
    words = set(said.replace(":", " ").replace(",", " ").split())
    places = {k.location_property for k in kg.domain.kinds.values()}
    about = sorted(t for t in home.facts if name in (home.words.name(t[0]), local(t[0])))
    named = [t for t in about if local(t[1]) in words]
    if named:
        return named
    wanted: set[Node | None] = set(places) if "itself" in words else {RDF.type}
    return [t for t in about if t[1] in wanted]


def _file(kg: "Kg", triple: Triple) -> str:
    return "state.ttl" if local(kg.home_of(triple[1])) == "state" else "attributes.ttl"


def _origins(home: Home, triples: Sequence[Triple]) -> "list[Origin]":
    from adaptbot_cli.adapters.store.blame import PACK, origins

    if home.versions is None:
        return [PACK] if triples else []
    found = origins(home.versions, triples, home.pack)
    ordered = (found[triple] for triple in triples)
    return sorted(dict.fromkeys(ordered), key=lambda origin: origin.when)


def _told(origin: "Origin", domain: str) -> str:
    if origin.source == "answer":
        by = f" ({origin.by})" if origin.by else ""
        return f'answer {origin.answer}{by}: "{origin.question}" "{origin.said}"'
    known = {
        "pack": f"it came with the {domain} pack",
        "uncommitted": "edited by hand, not committed yet",
        "start": "it was there when the versions began",
    }
    return known.get(origin.source) or f'{origin.source} {origin.revision[:7]}: "{origin.subject}"'
