"""The SPARQL of a pack: queries made ready to be asked, with a note of what is wrong in them."""

import re

import pyoxigraph

from adaptbot_cli.core.clock import LONGEST, within
from adaptbot_cli.core.pack.entry import EntryReader
from adaptbot_cli.core.sparql import (
    bindable,
    dollars,
    makes_text,
    one_newline,
    prefixed,
    reaches_out,
)

_CORRECT = "correct the query; its prefixes are those of the file"


def query_of(entry: EntryReader, text: str, what: str, form: str, gives: str = "") -> str:
    """Return an entry's query, ready to be asked with bindings; "" if it is not valid.

    `gives` is a variable that a SELECT must give values for.
    """
    text = one_newline(text).strip()
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
        message = " and ".join(f"?{name}" for name in given)
        entry.note(f"{what} must give ?{gives}, but gives {message}", f"select ?{gives}")
        return ""
    return bindable(query) if valid(entry, bindable(query), what) is not None else ""


def valid(entry: EntryReader, query: str, what: str) -> tuple[str, ...] | None:
    """Return the variables that a SELECT gives, none of an ASK; None if the query is not valid, or
    asks more than this graph. Raises EndlessError."""
    if refused_dollars(entry, query, what):
        return None
    if len(query) > LONGEST:
        entry.note(f"{what} has more than {LONGEST:,} characters", "make it shorter")
        return None
    if made := makes_text(query):
        entry.note(f"{what} has {made}, which can fill the memory", "compare what is there")
        return None
    try:
        if word := reaches_out(query):
            text = f"{what} has {word}, which reaches outside the graph"
            entry.note(text, "ask this graph alone")
            return None
        return within(lambda: _given(query), f"{entry.file}, entry {entry.entry}: {what}")
    except (SyntaxError, ValueError) as error:
        text = " ".join(str(error).split())
        text = text.removeprefix("this is no valid SPARQL: ")
        entry.note(f"{what} is no valid SPARQL: {text}", _CORRECT)
        return None


def _given(query: str) -> tuple[str, ...]:
    """The variables that a query gives, asked of an empty graph."""
    found = pyoxigraph.Store().query(query)
    if isinstance(found, pyoxigraph.QuerySolutions):
        return tuple(variable.value for variable in found.variables)
    return ()


def refused_dollars(entry: EntryReader, query: str, what: str) -> bool:
    """Note each variable that is written with a dollar, which could not be bound."""
    found = dict.fromkeys(dollars(query))
    for name in found:
        entry.note(f"{what} writes {name}", f"write ?{name[1:]}")
    return bool(found)
