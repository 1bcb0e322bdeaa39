"""The SPARQL of a pack: queries made ready to be asked, with a note of what is wrong in them."""

import re

import pyoxigraph

from adaptbot_cli.core.pack.entry import Entry
from adaptbot_cli.core.sparql import bindable, dollars, prefixed

_CORRECT = "correct the query; its prefixes are those of the file"


def query_of(entry: Entry, text: str, what: str, form: str, gives: str = "") -> str:
    """Return an entry's query, ready to be asked with bindings; "" if it is not valid.

    `gives` is a variable that a SELECT must give values for.
    """
    text = text.strip()
    if not text:
        return ""
    if not re.match(rf"{form}\b", text, re.IGNORECASE):
        entry.note(f"{what} must be a SPARQL {form}", f"begin it with {form}")
        return ""
    if re.match(r"SELECT\s+(DISTINCT\s+|REDUCED\s+)?\*", text, re.IGNORECASE):
        problem = f"{what} must name the variables that it gives, not *"
        entry.note(problem, f"write SELECT ?{gives or 'item'}")
        return ""
    query = prefixed(entry.graph, text) + form + text[len(form) :]
    given = valid(entry, query, what)
    if given is None:
        return ""
    if gives and gives not in given:
        told = " and ".join(f"?{name}" for name in given)
        entry.note(f"{what} must give ?{gives}, but gives {told}", f"select ?{gives}")
        return ""
    return bindable(query) if valid(entry, bindable(query), what) is not None else ""


def valid(entry: Entry, query: str, what: str) -> tuple[str, ...] | None:
    """Return the variables that a SELECT gives, none of an ASK; None if the query is not valid."""
    if refused_dollars(entry, query, what):
        return None
    try:
        found = pyoxigraph.Store().query(query)
    except (SyntaxError, ValueError) as error:
        told = " ".join(str(error).split())
        entry.note(f"{what} is no valid SPARQL: {told}", _CORRECT)
        return None
    if isinstance(found, pyoxigraph.QuerySolutions):
        return tuple(variable.value for variable in found.variables)
    return ()


def refused_dollars(entry: Entry, query: str, what: str) -> bool:
    """Note each variable that is written with a dollar, which could not be bound."""
    found = dict.fromkeys(dollars(query))
    for name in found:
        entry.note(f"{what} writes {name}", f"write ?{name[1:]}")
    return bool(found)
