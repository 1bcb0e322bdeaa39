"""The hostile files that are too large to keep: how each is made."""

_DEEP = 50_000
_XML = 'xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:e="http://example.org/"'

TURTLE = {
    "blank nodes": "<x:a> <x:p> " + "[ <x:p> " * _DEEP + "1" + "]" * _DEEP + " .",
    "collections": "<x:a> <x:p> " + "(" * _DEEP + ")" * _DEEP + " .",
    "triples in triples": "<x:a> <x:p> " + "<<( <x:a> <x:p> " * _DEEP + "1" + ")>>" * _DEEP + " .",
    "behind an escaped quote": "@prefix e: <x:> . e:a\\' e:p " + "[ e:p " * _DEEP + "'",
}
_VALUE = '<x:a> <x:p> "{}"^^<http://www.w3.org/2001/XMLSchema#{}> .'
GRAPHS = {
    "decimal.ttl": _VALUE.format("1E999999999", "decimal"),
    "duration.ttl": _VALUE.format("P" + "9" * 1000 + "Y", "duration"),
    **{f"{name}.ttl": text for name, text in TURTLE.items()},
    "elements.rdf": f"<rdf:RDF {_XML}>" + "<e:C><e:p>" * _DEEP,
    "objects.jsonld": '{"@id":"x:a","x:p":' * _DEEP + "1" + "}" * _DEEP,
}
YAML = {
    "flow": "adaptbot: 1\ntask: " + "[" * _DEEP,
    "block": "adaptbot: 1\ntask:\n" + "- " * _DEEP,
    "nine hundred deep": "adaptbot: 1\ntask: " + "[" * 900 + "]" * 900,
    "base sixty": "adaptbot: 1\ntask: 1" + ":1" * 300_000,
    "digits": "adaptbot: 1\ntask: " + "1" * 1_000_000,
    "entries": "adaptbot: 1\ntask: [" + "1," * 1_000_000 + "]",
    "documents": "---\n" * 300_000,
    "large": "adaptbot: 1\ntask: " + "x" * 5_000_000,
    "task": "adaptbot: 1\ndomain: kitchen\ntask: " + "egg " * 900_000,
}
TOML = {
    "arrays": "domain = " + "[" * 30_000,
    "tables": "domain = " + "{a=" * 15_000,
    "digits": "seed = " + "1" * 30_000,
    "dots": ".".join("a" * 30_000) + " = 1",
    "large": "# " + "x" * 100_000,
}
PACK = {
    "classes in a chain": "".join(
        f'ex:C{i} a rdfs:Class ; rdfs:label "c{i}" ; rdfs:subClassOf ex:C{i + 1} .\n'
        for i in range(1500)
    ),
}
JSON = {
    "arrays": "[" * _DEEP,
    "objects": '{"a":' * _DEEP,
    "two hundred deep": "[" * 200 + "]" * 200,
    "digits": "1" * 100_000,
}
PLANS = {
    "brackets": "(" * _DEEP,
    "calls": "pick_up_obj(" * 20_000,
    "json": '{"plan": ' + "[" * _DEEP,
    "quotes": '"' * _DEEP,
    "large": "x" * 2_000_000,
}
