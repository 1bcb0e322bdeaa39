"""Turtle that people and git can read: one fact a line, one order, edits that touch one line.

`patch` edits a document statement by statement and leaves all other text alone; `serialize`
writes a whole graph in the canonical style:

    ex:onion rdf:type ex:object ;
        ex:obj_name "onion" ;
        ex:Boilable false ;
    .

The type comes first, then the name, then the rest sorted as written.
"""

from adaptbot_cli.adapters.store.turtle.canonical import serialize
from adaptbot_cli.adapters.store.turtle.patching import patch
from adaptbot_cli.adapters.store.turtle.terms import Triple

__all__ = ["Triple", "patch", "serialize"]
