"""How a workspace stands, and everything that is wrong with its knowledge or a pack."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from adaptbot_cli.adapters.store.keeper import edit_faults, edited_plans
from adaptbot_cli.adapters.store.reading import check_files, load_kg
from adaptbot_cli.adapters.store.versions import PACK, facts_of
from adaptbot_cli.core.graph.faults import Fault, by_mistake
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.lint import lacking
from adaptbot_cli.core.graph.terms import Triple, kept, ordered
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.core.refine.goals import weak
from adaptbot_cli.core.view.changes import Changes, Status, Words
from adaptbot_cli.core.view.provenance import Origin
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.sources import load, settled
from adaptbot_cli.workspace import Workspace


def check_pack(workspace: Workspace, domain: str) -> tuple[Kg | None, list[Fault], list[Fault]]:
    """Return a domain's graph, the faults of its files and its plan library, and hints.

    Hints are of what tasks name and the home lacks, and of goals that say too little.
    With a fault the graph may be None, and is good for nothing but a look.

    Raises:
        UsageError: there is no such domain.
        KnowledgeError: its folder cannot be read.
    """
    kg, found = _checked(workspace, domain)
    hints = () if kg is None else lacking(kg) if found else (*lacking(kg), *weak(kg))
    return kg, found, [*hints]


def _checked(workspace: Workspace, domain: str) -> tuple[Kg | None, list[Fault]]:
    from adaptbot_cli.adapters.planner.library_faults import library_faults

    files = settled(workspace.root, lambda: workspace.files(domain))
    kg, found = check_files(files)
    if kg is not None and kg.domain.name not in ("", domain):
        text = f'rdfs:label is "{kg.domain.name}" in the folder {domain}'
        found.append(Fault(text, f'write "{domain}"', "domain.ttl", (kg.domain.name,)))
    return kg, by_mistake([*found, *library_faults(workspace.library(domain), kg)])


def validate(workspace: Workspace, domain: str, files: Sequence[Path] = ()) -> list[Fault]:
    """Return everything that is wrong with a domain's files, or with the facts of other files.

    What tasks need and is not there comes last, as hints.

    Raises:
        UsageError: there is no such domain.
        KnowledgeError: its folder, or one of the other files, cannot be read.
    """
    kg: Kg | None
    if files:
        kg = load(workspace, domain, files)
        where = ", ".join(map(str, files))
        found = [Fault(str(f), "correct the file", where) for f in by_mistake(faults(kg))]
    else:
        kg, bare = _checked(workspace, domain)
        origins = _origins(Home(workspace, domain), bare)
        found = [_explained(fault, domain, origins) for fault in bare]
    hints = () if kg is None else lacking(kg)
    return [*found, *(replace(hint, file=f"kg/{domain}/{hint.file}") for hint in hints)]


def _explained(fault: Fault, domain: str, origins: Mapping[Triple, Origin]) -> Fault:
    """Say of a fault where it stands, which answer caused it and how to get rid of it."""
    if not fault.entries:
        return Fault(str(fault), file=f"kg/{domain}")
    known = dict.fromkeys(origins[fact] for fact in ordered(fault.facts) if fact in origins)
    found = sorted(known, key=lambda origin: origin.when)
    remedy = fault.remedy or "edit the entry"
    answers = [origin.answer for origin in found if origin.answer]
    if answers:
        remedy += f", or adaptbot kg revert --answer {answers[-1]}"
    caused = "; ".join(dict.fromkeys(_origin_text(origin, domain) for origin in found))
    return replace(fault, file=f"kg/{domain}/{fault.file}", remedy=remedy, cause=caused)


def _origins(home: Home, found: Sequence[Fault]) -> dict[Triple, Origin]:
    """Where the facts of some faults come from, each as the graph has it."""
    slots = {fact[:2] for fault in found for fact in fault.facts}
    if not slots:
        return {}
    stated = {(*fact[:2], kept(fact[2])): fact for fact in home.facts if fact[:2] in slots}
    if home.versions is None:
        return dict.fromkeys(stated, PACK)
    origins = home.versions.origins(stated.values(), home.pack)
    return {fact: origins[written] for fact, written in stated.items()}


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
