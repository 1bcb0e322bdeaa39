"""Reads a domain pack's Turtle files into a domain and a knowledge graph."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import groupby
from pathlib import Path

import pyoxigraph
from rdflib import RDF, RDFS, Graph, URIRef

from adaptbot_cli import bounded
from adaptbot_cli.adapters.store import domains, turtle
from adaptbot_cli.adapters.store.files import FOLDERS
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, ATTRIBUTES, STATES, Triple, local, triple_of
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.core.pack import Sources, examine_domain, with_tasks
from adaptbot_cli.errors import KnowledgeError, PackError

DOMAIN_FILES = ("domain.ttl", "actions.ttl", "tasks.ttl")
FACT_FILES = {
    f"{name}.ttl": graph for name, graph in zip(FOLDERS, (ATTRIBUTES, STATES), strict=True)
}
"""The files of the facts, and the named graph that each is read into. A large home has more of
each in a folder: `attributes/` and `state/`."""

_ORDER = (*FACT_FILES, "actions.ttl", "tasks.ttl", "domain.ttl")


def graph_of(name: str) -> URIRef | None:
    """Return the named graph that a file of a domain is read into; None if it holds no facts."""
    return FACT_FILES.get(main_file(name))


def main_file(name: str) -> str:
    """Return the file beside whose folder a file of facts stands, such as state.ttl for
    state/1.ttl; of any other file itself."""
    folder, inside, _ = name.partition("/")
    return f"{folder}.ttl" if inside else name


def in_order(names: Iterable[str]) -> list[str]:
    """Return the names of a domain's files, each once: facts first, what they rest on last."""
    known = {name for name in names if name in _ORDER or graph_of(name) is not None}
    return sorted(known, key=lambda name: (_ORDER.index(main_file(name)), name))


def fact_files(names: Iterable[str]) -> list[str]:
    """Return those of a domain's files that hold facts, in order."""
    return [name for name in in_order(names) if graph_of(name) is not None]


def load_kg(
    files: Mapping[str, bytes],
    where: str,
    instead: Sequence[Triple] | None = None,
    large: int | None = None,
) -> Kg:
    """Build the graph of a domain from the bytes of its five files.

    With `instead`, the facts are these triples, split by the domain's properties, and not those
    of the files; tasks among them are known too. From `large` lines of facts on, the graph is one
    that is kept on disk (`copies`), where there is one or one can be made.

    Raises:
        KnowledgeError: a file is missing or is no valid Turtle; the message names file and line.
        PackError: an entry of the domain does not make sense.
    """
    domain = load_domain(files, where)
    if instead is not None:
        return Kg.load(with_tasks(domain, instead), *split(instead, domain))

    def fill(store: pyoxigraph.Store) -> None:
        for name in fact_files(files):
            _fill(store, files[name], f"{where}/{name}", graph_of(name))

    if large is not None and is_large(files, large):
        from adaptbot_cli.adapters.store import copies

        kept = copies.open_copy(parts_of(files), domain, fill)
        if kept is not None:
            return kept
    engine = pyoxigraph.Store()
    fill(engine)
    return Kg.over(domain, engine)


def is_large(files: Mapping[str, bytes], large: int) -> bool:
    """Tell whether a domain's files have more than so many lines."""
    return sum(data.count(b"\n") for data in files.values()) > large


def parts_of(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return those of a domain's files that make its graph: the facts and the classes."""
    return {name: files[name] for name in ("domain.ttl", *fact_files(files))}


def load_domain(files: Mapping[str, bytes], where: str) -> Domain:
    """Read a domain from the bytes of a pack's files. Raises as `load_kg` does."""
    for name in (*DOMAIN_FILES, *FACT_FILES):
        if name not in files:
            raise KnowledgeError(f"{where} lacks {name}; a domain has five .ttl files")
    return _examined(where, *(files[name] for name in DOMAIN_FILES))[0]


@lru_cache(maxsize=8)
def _examined(where: str, *parts: bytes) -> domains.Read:
    """Read a domain, and what is doubtful in it; nothing is read that was read before."""

    def read() -> domains.Read:
        given = zip(DOMAIN_FILES, parts, strict=True)
        domain, notes = examine_domain(Sources(*(parse(d, f"{where}/{n}") for n, d in given)))
        try:
            notes.refuse()
        except PackError as error:  # it begins with the file's name
            raise PackError(f"{where}/{error}") from error
        return domain, notes.faults

    return domains.kept(parts, read)


def _fill(store: pyoxigraph.Store, data: bytes, path: str, graph: URIRef | None) -> None:
    """Let the engine read a Turtle file into a named graph. Raises KnowledgeError."""
    bounded.check_graph(data, path)
    with turtle.blaming(path):
        if b"<<" in data:
            # Only a reading in Python finds triples in triples, which rdflib cannot hold.
            triples(data, path)
        data = data.removeprefix(turtle.BOM.encode())
        store.bulk_load(data, turtle.TURTLE, to_graph=pyoxigraph.NamedNode(graph or ATTRIBUTES))


def paths_of(domain: str, *files: Iterable[str]) -> list[str]:
    """Return the files of a domain as they are named in a workspace: the five that each has, and
    what else of some `files` is one."""
    names = in_order([*_ORDER, *(name for each in files for name in each)])
    return [f"kg/{domain}/{name}" for name in names]


def check_files(files: Mapping[str, bytes]) -> tuple[Kg | None, list[Fault]]:
    """Look at a pack as `load_kg` reads it, and return every fault rather than raise the first.

    The graph is None if the files hold none; with faults it is good for further checks only.
    """
    graphs: dict[str, Graph] = {}
    store, unread = pyoxigraph.Store(), sorted(files.keys() - in_order(files))
    text, remedy = "is no file of a domain, and not read", "move it away, or its facts to state.ttl"
    found = [Fault(text, remedy, name) for name in unread]
    for name in (*DOMAIN_FILES, *dict.fromkeys((*FACT_FILES, *fact_files(files)))):
        if unreadable := _unreadable(files, name):
            found.append(unreadable)
            continue
        try:
            if graph_of(name) is not None:
                _fill(store, files[name], name, graph_of(name))
            else:
                graphs[name] = parse(files[name], name)
        except KnowledgeError as error:
            syntax = "no valid Turtle" in str(error)
            found.append(Fault(str(error), "correct it there or just before" if syntax else ""))
    if "domain.ttl" not in graphs:
        return None, found
    whole = len(found) == len(unread)
    domain, doubts = _domain_of(files, graphs)
    found += doubts
    if not whole:
        return None, found
    kg = Kg.over(domain, store)
    return kg, [*found, *misplaced(kg), *faults(kg)]


def _domain_of(files: Mapping[str, bytes], graphs: Mapping[str, Graph]) -> domains.Read:
    """A domain that may have faults, with these."""
    try:
        return _examined("", *(files.get(name, b"") for name in DOMAIN_FILES))
    except KnowledgeError:
        domain, notes = examine_domain(Sources(*(graphs.get(n, Graph()) for n in DOMAIN_FILES)))
        return domain, notes.faults


def _unreadable(files: Mapping[str, bytes], name: str) -> Fault | None:
    if name not in files:
        return Fault("is missing", "write it, a domain has five .ttl files", name)
    try:
        files[name].decode("utf-8")
    except UnicodeDecodeError as error:
        line = files[name].count(b"\n", 0, error.start) + 1
        return Fault("is no UTF-8 text", "save the file as UTF-8", f"{name}, line {line}")
    return None


def misplaced(kg: Kg) -> Iterator[Fault]:
    """Give a fault for each property of a thing that stands in the file of the other graph."""
    attributes, states = FACT_FILES
    classes = {*kg.graph(STATES).triples((None, RDF.type, None))}
    for home, file, at in ((states, attributes, STATES), (attributes, states, ATTRIBUTES)):
        astray = {fact for fact in kg.strays if kg.home_of(fact[1]) == at}
        astray |= classes if file == states else set()
        for (subject, predicate), facts in groupby(sorted(astray), key=lambda fact: fact[:2]):
            text, entry = f"{local(predicate)} does not belong here", (local(subject),)
            yield Fault(text, f"move it to {home}", file, entry, subject, frozenset(facts))


def split(facts: Sequence[Triple], domain: Domain) -> tuple[list[Triple], list[Triple]]:
    """Split one graph into G_k and G_s; declarations and unknown predicates are left out."""
    attributes: list[Triple] = []
    states: list[Triple] = []
    for triple in facts:
        prop = domain.properties.get(triple[1])  # type: ignore[call-overload]
        if prop is not None and prop.graph == "state":
            states.append(triple)
        elif prop is not None or triple[1] == AB.alias or triple[2] in domain.classes:
            attributes.append(triple)
    declared = {t[0] for t in facts if t[1] == RDF.type and t[2] in (RDFS.Class, RDF.Property)}
    return [t for t in attributes if t[0] not in declared], states


def read_graphs(paths: Sequence[Path]) -> list[Triple] | None:
    """Return the triples of some Turtle files, None if none is named. Raises KnowledgeError."""
    if not paths:
        return None
    data = ((bounded.read_bytes(path, bounded.GRAPH, piped=True), str(path)) for path in paths)
    return [triple for given in data for triple in triples(*given)]


def parse(data: bytes, path: str) -> Graph:
    """Parse a Turtle file into a graph that remembers its prefixes. Raises KnowledgeError."""
    graph = Graph(bind_namespaces="none")
    with turtle.blaming(path):
        parser = turtle.parse(data, path)
        for quad in parser:
            graph.add(triple_of(quad.triple))
    for prefix, iri in parser.prefixes.items():
        graph.bind(prefix, iri)
    return graph


def triples(data: bytes, path: str) -> list[Triple]:
    """Parse a Turtle file into its triples. Raises KnowledgeError."""
    with turtle.blaming(path):
        return [triple_of(quad.triple) for quad in turtle.parse(data, path)]
