"""The datatypes that a property's values can have: the one table of them."""

from collections.abc import Mapping

from rdflib import XSD, Literal, URIRef
from rdflib.term import Node

DATATYPES: Mapping[URIRef, str] = {
    XSD.boolean: "true or false",
    XSD.string: 'a text in quotes, such as "egg"',
    XSD.integer: "a whole number, such as 3",
    XSD.decimal: "a number, such as 1.75",
    XSD.double: "a number, such as 1.75e0",
    XSD.float: 'a number, such as "1.75"^^xsd:float',
    XSD.date: 'a date, such as "2024-05-31"^^xsd:date',
    XSD.dateTime: 'a date and time, such as "2024-05-31T12:00:00"^^xsd:dateTime',
}
"""How a value of each is written in a file."""

NUMBERS: Mapping[URIRef, str] = {
    XSD.integer: "whole number",
    XSD.decimal: "number",
    XSD.double: "number",
    XSD.float: "number",
}
"""What a person is asked for."""

WRITTEN: tuple[URIRef, ...] = (XSD.boolean, *NUMBERS, XSD.string)
"""Those that an argument of a call in a plan can have."""


def is_value(value: Node, datatype: URIRef) -> bool:
    """Tell whether a term is a value of a datatype; a whole number is a decimal too, and a text in
    a language is a text."""
    if not isinstance(value, Literal) or value.ill_typed:
        return False
    if value.language:
        return datatype == XSD.string
    is_decimal = datatype == XSD.decimal and value.datatype == XSD.integer
    return is_decimal or (value.datatype or XSD.string) == datatype
