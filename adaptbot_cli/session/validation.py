"""How a workspace stands, and everything that is wrong with its knowledge or a pack."""

import re
from collections.abc import Sequence
from pathlib import Path

from rdflib import RDF
from rdflib.term import Node

from adaptbot_cli.adapters.store.keeper import edit_faults, edited_plans
from adaptbot_cli.adapters.store.reading import check_files, load_kg
from adaptbot_cli.adapters.store.versions import PACK, facts_of
from adaptbot_cli.core.changes import Changes, Status, Words, Wrong
from adaptbot_cli.core.faults import FAULT, by_mistake, faults
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.lint import lacking
from adaptbot_cli.core.provenance import Origin
from adaptbot_cli.core.refine.goals import weak
from adaptbot_cli.core.terms import Triple, local
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.knowledge import Home
from adaptbot_cli.session.sources import load, settled
from adaptbot_cli.workspace import Workspace


def check_pack(workspace: Workspace, domain: str) -> tuple["Kg | None", list[str], list[str]]:
    """Return a domain's graph, a sentence for each fault, and hints: file, entry, what to do.

    Hints are of what tasks name and the home lacks, and of goals that say too little.
    With a fault the graph may be None, and is good for nothing but a look.

    Raises:
        UsageError: there is no such domain.
        KnowledgeError: its folder cannot be read.
    """
    from adaptbot_cli.adapters.planner.checking import library_faults

    files = settled(workspace.root, lambda: workspace.files(domain))
    kg, found, hints = check_files(files)
    if kg is not None and kg.domain.name not in ("", domain):
        text = f'rdfs:label is "{kg.domain.name}" in the folder {domain}'
        found.append(f'domain.ttl, entry {kg.domain.name}: {text}; write "{domain}"')
    found = by_mistake([*found, *library_faults(workspace.library(domain), kg)])
    return kg, found, hints if found or kg is None else [*hints, *weak(kg)]


def validate(workspace: Workspace, domain: str, files: Sequence[Path] = ()) -> list[Wrong]:
    """Return everything that is wrong with a domain's files, or with the facts of other files.

    What tasks need and is not there comes last, as hints.

    Raises:
        UsageError: there is no such domain.
        KnowledgeError: its folder, or one of the other files, cannot be read.
    """
    if files:
        kg = load(workspace, domain, files)
        where = ", ".join(map(str, files))
        told = by_mistake([str(fault) for fault in faults(kg)])
        wrong = [Wrong(fault, where, "correct the file") for fault in told]
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
    match = FAULT.fullmatch(fault)
    if match is None:
        return Wrong(fault, f"kg/{domain}")
    file, remedy = f"kg/{domain}/{match['file']}", match["do"] or "edit the entry"
    if home is None or match["file"] not in ("attributes.ttl", "state.ttl"):
        return Wrong(f"{match['entry']}: {match['told']}", file, remedy)
    first = re.split(", | and ", match["entry"])[0]
    origins = _origins(home, _meant(first, match["told"], home))
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


def _origins(home: Home, triples: Sequence[Triple]) -> list[Origin]:
    if home.versions is None:
        return [PACK] if triples else []
    found = home.versions.origins(triples, home.pack)
    ordered = (found[triple] for triple in triples)
    return sorted(dict.fromkeys(ordered), key=lambda origin: origin.when)


def _origin_text(origin: Origin, domain: str) -> str:
    if origin.source == "answer":
        by = f" ({origin.by})" if origin.by else ""
        return f'answer {origin.answer}{by}: "{origin.question}" "{origin.said}"'
    known = {
        "pack": f"it came with the {domain} pack",
        "uncommitted": "edited by hand, not committed yet",
        "start": "it was there when the versions began",
    }
    return known.get(origin.source) or f'{origin.source} {origin.revision[:7]}: "{origin.subject}"'


def status(home: Home) -> Status:
    """Return how a workspace stands. Edits that cannot be read are told as a problem."""
    from adaptbot_cli.adapters.transcript.loading import unfinished

    root, versions = home.workspace.root, home.versions
    if versions is None:
        return Status(root, home.domain)
    last = next(versions.repo.log([versions.folder]), None)
    head = versions.repo.head()
    changes, problem, found = None, "", []
    if head:
        try:
            changes = versions.between(versions.files(head), versions.files(None))
            found = edit_faults(versions.repo, home.domain) if changes else []
        except KnowledgeError as error:
            problem = str(error)
    waiting = sorted(unfinished(home.workspace.transcripts))
    revision, subject = (last.sha, last.subject) if last else (head, "")
    edited = [*versions.edited(), *edited_plans(versions.repo, home.domain)]
    return Status(root, home.domain, revision, subject, edited, changes, problem, found, waiting)


def words_for(home: Home, changes: Changes) -> Words:
    """Return words that know the names of what a change adds and removes as well."""
    try:
        known = home.words
    except KnowledgeError:  # the files are no domain; the last commit is one
        files = home.needed().files("HEAD")
        known = Words.of(load_kg(files, "HEAD").domain, facts_of(files))
    return known.also(changes.delta.added).also(changes.delta.removed)
