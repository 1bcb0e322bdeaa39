"""`domain check` finds every fault of a pack at once, and says of each what to do."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from adaptbot_cli.resources import bundled
from adaptbot_cli.session import packs, sources, validation
from adaptbot_cli.workspace import Workspace

FORM = re.compile(r"\S+\.(ttl|plan)(, line \d+|, entr(y|ies) [^:]+)?: .+; .+", re.DOTALL)
"""What every fault looks like: file, line or entry, problem, what to do."""

STARTER = bundled("starter")
Check = Callable[..., list[str]]


@pytest.fixture
def check(tmp_path: Path) -> Check:
    """Return a function that breaks a fresh starting pack and gives what is told of it."""
    home = Workspace(tmp_path / "robot")
    packs.start(home, "starting")
    pack = home.root / "kg" / "starting"
    library = home.root / "prompts" / "library" / "starting"

    def broken(*changes: tuple[str, str, str | bytes]) -> list[str]:
        for file, old, new in changes:
            path = (library if file.endswith(".plan") else pack) / file
            if isinstance(new, bytes):
                path.write_bytes(new)
                continue
            text = path.read_text(encoding="utf-8")
            assert old in text, f"{old!r} is not in {file}"
            path.write_text(text.replace(old, new, 1), encoding="utf-8")
        found = [*map(str, validation.check_pack(home, "starting")[1])]
        for fault in found:
            assert FORM.fullmatch(fault.replace(f"{library}/", "")), fault
        return found

    return broken


TWIN = 'ab:task_z a ab:Task ; rdfs:label "Pack_the vase" ; ab:needs "book" .'
BREAKS = {
    # what a newcomer's hand slips on in domain.ttl
    "a misspelt ab: term": (
        ("domain.ttl", "ab:kindOrder 1", "ab:kindOder 1"),
        ["domain.ttl, entry thing: there is no ab:kindOder; the nearest is ab:kindOrder"],
    ),
    "a misspelt rdfs: term": (
        ("domain.ttl", 'rdfs:label "thing"', 'rdfs:lable "thing"'),
        ["domain.ttl, entry thing: there is no rdfs:lable; the nearest is rdfs:label"],
    ),
    "a misspelt class of classes": (
        ("domain.ttl", "ex:place a rdfs:Class", "ex:place a rdfs:Clas"),
        ["domain.ttl, entry place: there is no rdfs:Clas; the nearest is rdfs:Class"],
    ),
    "an entry that is nothing": (
        ("domain.ttl", "ex:agent a rdfs:Class ;", "ex:agent rdfs:seeAlso ex:robot ;"),
        ["domain.ttl, entry agent: says not what it is; "],
    ),
    "a class hierarchy in a circle": (
        (
            "domain.ttl",
            "ex:item a rdfs:Class ;",
            "ex:item a rdfs:Class ; rdfs:subClassOf ex:thing ;",
        ),
        ["domain.ttl, entry thing: is a class below itself: ", "take one rdfs:subClassOf away"],
    ),
    "an undeclared superclass": (
        (
            "domain.ttl",
            'rdfs:subClassOf ex:item ;\n    rdfs:label "place"',
            'rdfs:subClassOf ex:itm ; rdfs:label "place"',
        ),
        ["domain.ttl, entry place: rdfs:subClassOf itm is no class of it; the nearest there is i"],
    ),
    "a question for an unknown property": (
        ("domain.ttl", "ex:lies_in ex:is_fragile )", "ex:lies_in ex:is_fragil )"),
        ["domain.ttl, entry thing: is_fragil is no property of it; the nearest there is is_fra"],
    ),
    "questions that are no list": (
        ("domain.ttl", "ab:asks ( ex:is_workplace )", "ab:asks ex:is_workplace"),
        ["domain.ttl, entry place: needs a list as ab:asks; put it in parentheses"],
    ),
    "a text among the questions": (
        ("domain.ttl", "ab:asks ( ex:is_workplace )", 'ab:asks ( "is_workplace" )'),
        ["domain.ttl, entry place: ab:asks lists is_workplace, which is no property; "],
    ),
    "a start with a value that is none": (
        (
            "domain.ttl",
            "ab:property ex:wrapped ; ab:value false",
            'ab:property ex:wrapped ; ab:value "no"',
        ),
        ["domain.ttl, entry thing: ab:starts gives wrapped the value no; write true or false"],
    ),
    "a location property that is not there": (
        ("domain.ttl", "ab:locationProperty ex:lies_in", "ab:locationProperty ex:lies_on"),
        ["domain.ttl, entry thing: lies_on is no property of it; the nearest there is lies_in"],
    ),
    "a wording that names something else": (
        ("domain.ttl", "Does {name} break", "Does {thing} break"),
        ["domain.ttl, entry is_fragile: the message", "names {thing}; it may name {name}"],
    ),
    "a graph that there is not": (
        (
            "domain.ttl",
            'rdfs:label "wrapped" ;\n    ab:graph ab:state',
            'rdfs:label "wrapped" ;\n    ab:graph ab:states',
        ),
        ["domain.ttl, entry wrapped: ab:graph must be ab:attribute or ab:state; "],
    ),
    "a range that there is not": (
        (
            "domain.ttl",
            "rdfs:domain ex:thing ; rdfs:range xsd:boolean",
            "rdfs:domain ex:thing ; rdfs:range xsd:bool",
        ),
        ["domain.ttl, entry is_fragile: rdfs:range bool is no class or datatype; the nearest"],
    ),
    "a flag in quotes": (
        ("domain.ttl", "ab:prompted true", 'ab:prompted "true"'),
        ["domain.ttl, entry place: needs true or false as ab:prompted, not true; write true"],
    ),
    "an order in words": (
        ("domain.ttl", "ab:kindOrder 2", 'ab:kindOrder "second"'),
        ["domain.ttl, entry place: needs a whole number as ab:kindOrder; write one"],
    ),
    "no robot": (
        ("domain.ttl", "ab:agent ex:robot ;", "ab:agent ex:robto ;"),
        ["domain.ttl, entry starting: ab:agent is robto, which attributes.ttl does not have; "],
    ),
    "no domain": (
        ("domain.ttl", "ab:starting a ab:Domain ;", "ab:starting rdfs:seeAlso ex:robot ;"),
        ["domain.ttl: needs exactly one entry typed ab:Domain, has 0; write"],
    ),
    "a label that is not the folder's": (
        ("domain.ttl", 'rdfs:label "starting"', 'rdfs:label "beginning"'),
        ['domain.ttl, entry beginning: rdfs:label is "beginning" in the folder starting; write'],
    ),
    "a goal without a query": (
        ("domain.ttl", 'ab:ask "ASK { FILTER NOT EXISTS { ?agent ex:holds ?something } }" ;', ""),
        ["domain.ttl, entry starting: a goal needs either ab:ask or ab:select; "],
    ),
    # actions.ttl
    "a missing label": (
        ("actions.ttl", 'rdfs:label "wrap" ;', ""),
        ["actions.ttl, entry wrap: lacks rdfs:label; add it"],
    ),
    "a bad effect": (
        ("actions.ttl", "INSERT { ?thing ex:wrapped true }", "INSERT { ?thing ex:wrapped }"),
        ["actions.ttl, entry wrap: ab:effect is no valid SPARQL: "],
    ),
    "an effect on an unknown predicate": (
        ("actions.ttl", "INSERT { ?thing ex:wrapped true }", "INSERT { ?thing ex:wraped true }"),
        ["actions.ttl, entry wrap: ab:effect: wraped is not declared in domain.ttl; the nearest"],
    ),
    "a condition that is no ASK": (
        ("actions.ttl", '"ASK { ?agent ex:holds ?thing }"', '"SELECT { ?agent ex:holds ?thing }"'),
        ["actions.ttl, entry put_down: ab:ask must be a SPARQL ASK; begin it with ASK"],
    ),
    "a prefix that is not declared": (
        ("actions.ttl", '"ASK { ?agent ex:holds ?thing }"', '"ASK { ?agent my:holds ?thing }"'),
        ["actions.ttl, entry put_down: ab:ask is no valid SPARQL: ", "prefixes are those of the"],
    ),
    "a condition on a misspelt predicate": (
        ("actions.ttl", '"ASK { ?agent ex:holds ?thing }"', '"ASK { ?agent ex:hold ?thing }"'),
        ["actions.ttl, entry put_down: hold in ", "is not declared in domain.ttl; the nearest"],
    ),
    "a default that gives something else": (
        ("actions.ttl", "SELECT ?place WHERE", "SELECT ?spot WHERE"),
        ['ab:default of parameter "place" must give ?place, but gives ?spot; select ?place'],
    ),
    "an alias that means two actions": (
        ("actions.ttl", 'ab:alias "put", "place", "lay"', 'ab:alias "put", "place", "take"'),
        ['its other name "take" means ', " too; take it from one of them"],
    ),
    "two actions of one name": (
        ("actions.ttl", 'rdfs:label "put_down"', 'rdfs:label "pick_up"'),
        ['"pick_up" is the rdfs:label of pick_up too; change one'],
    ),
    "a parameter without a class": (
        ("actions.ttl", '[ ab:name "thing" ; ab:class ex:thing ] )', '[ ab:name "thing" ] )'),
        ['actions.ttl, entry pick_up: parameter "thing" needs either ab:class or ab:datatype; '],
    ),
    "a parameter of an unknown class": (
        (
            "actions.ttl",
            '[ ab:name "place" ; ab:class ex:place',
            '[ ab:name "place" ; ab:class ex:palce',
        ),
        ["actions.ttl, entry put_down: parameter place: palce is no class of domain.ttl; the n"],
    ),
    "a parameter of an unknown datatype": (
        (
            "actions.ttl",
            '[ ab:name "thing" ; ab:class ex:thing ] )',
            '[ ab:name "thing" ; ab:datatype xsd:bool ] )',
        ),
        ["ab:datatype bool is nothing a plan can write; write one of xsd:boolean"],
    ),
    "a requirement of no parameter": (
        ("actions.ttl", 'ab:of "thing" ; ab:attribute', 'ab:of "item" ; ab:attribute'),
        ['actions.ttl, entry wrap: ab:of "item" is none of its parameters; its parameters are thi'],
    ),
    "a state where an attribute is asked": (
        ("actions.ttl", "ab:attribute ex:is_fragile", "ab:attribute ex:wrapped"),
        ["ab:attribute wrapped is a state, which is never asked for; write a condition"],
    ),
    "a requirement of an unknown attribute": (
        ("actions.ttl", "ab:attribute ex:is_fragile", "ab:attribute ex:is_fragil"),
        ["ab:attribute is_fragil is not declared in domain.ttl; the nearest there is is_fragile"],
    ),
    "a message that names no parameter": (
        ("actions.ttl", '"{thing} must lie where', '"{item} must lie where'),
        ["names {item}; it may name {thing}"],
    ),
    # facts
    "a fact of an unknown predicate": (
        ("attributes.ttl", "ex:is_fragile true", "ex:is_frail true"),
        ["attributes.ttl, entry vase: is_frail is not declared in domain.ttl; the nearest there"],
    ),
    "a thing of an unknown class": (
        ("attributes.ttl", "ex:vase rdf:type ex:thing", "ex:vase rdf:type ex:ting"),
        ["attributes.ttl, entry vase: ting is no class of domain.ttl; the nearest there is thing"],
    ),
    "a thing without a name": (
        ("attributes.ttl", 'ex:name "crate" ;', ""),
        ["attributes.ttl, entry crate: lacks its name, name; add it"],
    ),
    "two things of one name": (
        ("attributes.ttl", 'ex:name "crate" ;', 'ex:name "bench" ;'),
        ['attributes.ttl, entry crate: its name "bench" is that of bench too; change one'],
    ),
    "a state that cannot be": (
        ("state.ttl", "ex:wrapped false", 'ex:wrapped "maybe"'),
        ["state.ttl, entry book: wrapped must be a boolean, not maybe; write true or false"],
    ),
    "two places at once": (
        ("state.ttl", "ex:book ex:lies_in ex:shelf", "ex:book ex:lies_in ex:shelf, ex:bench"),
        ["state.ttl, entry book: place (lies_in) has 2 values: "],
    ),
    "a place that is not there": (
        ("state.ttl", "ex:book ex:lies_in ex:shelf", "ex:book ex:lies_in ex:shelve"),
        [
            "state.ttl, entry book: place (lies_in) is ",
            "shelve, which is nothing known; the nearest there",
        ],
    ),
    "a place that is none": (
        ("state.ttl", "ex:book ex:lies_in ex:shelf", "ex:book ex:lies_in ex:vase"),
        ["state.ttl, entry book: place (lies_in) must be a place, vase is not; name a place"],
    ),
    "a fact in the other file": (
        ("attributes.ttl", "ex:is_fragile true", "ex:is_fragile true ; ex:lies_in ex:crate"),
        ["attributes.ttl, entry vase: lies_in does not belong here; move it to state.ttl"],
    ),
    # tasks and plans
    "a task that needs nothing and has no goal": (
        (
            "tasks.ttl",
            'ab:needs "vase" ;                          # items that no plan may lose, '
            "by name\n    ab:goal",
            "rdfs:seeAlso",
        ),
        ["tasks.ttl, entry task_pack_the_vase: says neither what it requires nor its goal"],
    ),
    "a goal on a misspelt property": (
        ("tasks.ttl", "ex:vase ex:lies_in ex:crate", "ex:vase ex:lies_im ex:crate"),
        ['tasks.ttl, entry "pack the vase": lies_im in "the vase is not in the crate"', "lies_in"],
    ),
    "a word outside an effect's groups": (
        (
            "actions.ttl",
            "INSERT { ?agent ex:holds ?thing }",
            "then INSERT { ?agent ex:holds ?thing }",
        ),
        ['actions.ttl, entry pick_up: ab:effect has "then INSERT" where only DELETE, INSERT or '],
    ),
    "a misspelt group of an effect": (
        ("actions.ttl", "DELETE { ?thing ex:wrapped", "DELETEE { ?thing ex:wrapped"),
        ['actions.ttl, entry wrap: ab:effect has "DELETEE" where only DELETE, INSERT or WHERE may'],
    ),
    "a word behind an effect": (
        (
            "actions.ttl",
            "OPTIONAL { ?thing ex:wrapped ?before } }",
            "OPTIONAL { ?thing ex:wrapped ?before } } LIMIT 1",
        ),
        ['actions.ttl, entry wrap: ab:effect has "LIMIT 1" where only'],
    ),
    "two groups of one kind": (
        (
            "actions.ttl",
            "DELETE { ?agent ex:holds ?thing }",
            "DELETE { ?thing ex:lies_in ?place } DELETE { ?agent ex:holds ?thing }",
        ),
        ["actions.ttl, entry put_down: ab:effect may have each of DELETE, INSERT and WHERE once"],
    ),
    "an effect on an unbound variable": (
        ("actions.ttl", "INSERT { ?thing ex:wrapped true }", "INSERT { ?thng ex:wrapped true }"),
        [
            "actions.ttl, entry wrap: ab:effect writes ?thng, which is no parameter and not bound",
            "the nearest there is ?thing",
        ],
    ),
    "an effect on a variable that only a filter names": (
        (
            "actions.ttl",
            "INSERT { ?thing ex:lies_in ?place }\n        WHERE { }",
            "INSERT { ?thing ex:lies_in ?spot }\n        WHERE { FILTER(?spot != ?place) }",
        ),
        ["actions.ttl, entry put_down: ab:effect writes ?spot, which is no parameter and"],
    ),
    "an effect that looks for a misspelt parameter": (
        (
            "actions.ttl",
            "OPTIONAL { ?thing ex:wrapped ?before }",
            "OPTIONAL { ?thig ex:wrapped ?before }",
        ),
        ["actions.ttl, entry wrap: ab:effect names ?thig, which stands there once", "is ?thing"],
    ),
    "a condition on a misspelt parameter": (
        ("actions.ttl", '"ASK { ?agent ex:holds ?thing }"', '"ASK { ?agent ex:holds ?thng }"'),
        ["actions.ttl, entry put_down: ab:ask names ?thng, which stands there once", "is ?thing"],
    ),
    "a condition on a misspelt robot": (
        ("actions.ttl", '"ASK { ?agent ex:holds ?thing }"', '"ASK { ?agnet ex:holds ?thing }"'),
        ["actions.ttl, entry put_down: ab:ask names ?agnet, which stands", "is ?agent"],
    ),
    "an effect with a value of another datatype": (
        ("actions.ttl", "INSERT { ?thing ex:wrapped true }", "INSERT { ?thing ex:wrapped 'yes' }"),
        ['actions.ttl, entry wrap: ab:effect writes "yes" as wrapped, which must be a boolean; '],
    ),
    "an effect with a text for a place": (
        (
            "actions.ttl",
            "INSERT { ?thing ex:lies_in ?place }",
            "INSERT { ?thing ex:lies_in 'shelf' }",
        ),
        ['actions.ttl, entry put_down: ab:effect writes "shelf" as lies_in, which must be a place'],
    ),
    "an effect on an attribute": (
        (
            "actions.ttl",
            "INSERT { ?thing ex:wrapped true }",
            "INSERT { ?thing ex:wrapped true ; ex:is_fragile false }",
        ),
        ["actions.ttl, entry wrap: ab:effect changes is_fragile, which is an attribute; let"],
    ),
    "a goal before an unknown action": (
        ("tasks.ttl", '"the vase is not wrapped"', '"it is bare" ; ab:before ex:put_dwn'),
        ['ab:before put_dwn of "it is bare" is no action of actions.ttl; the nearest there is put'],
    ),
    "two tasks of one name": (
        ("tasks.ttl", "ab:task_pack_the_vase a ab:Task", f"{TWIN} ab:task_pack_the_vase a ab:Task"),
        ["tasks.ttl, entry task_z: its name", "is that of task_pack_the_vase too; change one"],
    ),
    "a plan with an unknown action": (
        ("pack.plan", 'wrap("{{ item }}")', 'wrapp("{{ item }}")'),
        ["pack.plan: wrapp is no action of actions.ttl; the nearest there is wrap"],
    ),
    "a plan that cannot be rendered": (
        ("pack.plan", "{% endfor %}", "{{ itms + 1 }}{% endfor %}"),
        ["pack.plan", "'itms' is undefined; correct the template there"],
    ),
    "a template that never ends": (
        ("pack.plan", "{% endfor %}", ""),
        ["pack.plan, line ", "; correct the template there"],
    ),
    "a template that reaches out": (
        ("pack.plan", "{% endfor %}", "{{ ''.__class__.__mro__[1].__subclasses__() }}{% endfor %}"),
        ["pack.plan, line ", "may not use the method __subclasses__; correct the template there"],
    ),
    "a plan without names": (
        ("pack.plan", "names: [pack, wrap, crate]", "names: pack"),
        ["pack.plan: its front matter lacks or garbles `names`, which is a list"],
    ),
    "a plan without front matter": (
        ("pack.plan", "", b'pick_up("vase")\n'),
        ["pack.plan: has no front matter; write YAML between two lines of ---"],
    ),
    "a plan that is no text": (
        ("pack.plan", "", b"\xff\xfe\x00"),
        ["pack.plan: is no UTF-8 text; save it as UTF-8"],
    ),
    "no Turtle": (
        ("state.ttl", "ex:book ex:lies_in ex:shelf ;", "ex:book ex:lies_in ex:shelf"),
        ["state.ttl, line ", "this is no valid Turtle: ", "; correct it there or just before"],
    ),
    "no UTF-8": (
        ("actions.ttl", "", b"# one line\n# \xe9t\xe9\n"),
        ["actions.ttl, line 2: is no UTF-8 text; save the file as UTF-8"],
    ),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_a_fault_is_told(kind: str, check: Check) -> None:
    change, parts = BREAKS[kind]
    found = check(change)
    assert [fault for fault in found if all(part in fault for part in parts)], found


LACKS = {
    ('ab:needs "vase"', 'ab:needs "vaze"'): "vaze is not in attributes.ttl, and is named by pack t",
    ("ex:vase ex:lies_in ex:crate", "ex:vase ex:lies_in ex:craet"): "craet is not in attributes.t",
}


@pytest.mark.parametrize("change", LACKS)
def test_what_a_task_names_and_the_home_lacks_is_a_hint(
    change: tuple[str, str], check: Check, tmp_path: Path
) -> None:
    assert check(("tasks.ttl", *change)) == []
    [hint] = map(str, validation.check_pack(Workspace(tmp_path / "robot"), "starting")[2])
    assert FORM.fullmatch(hint) and LACKS[change] in hint and "the nearest there is " in hint


WEAK = {
    "its goal holds here before": ("ex:vase ex:wrapped false", "ex:vase ex:lies_in ex:shelf"),
    '("the vase is not wrapped" otherwise) is about no item': (
        "?any ex:wrapped true",
        "?any ex:lies_in ?place . ?place ex:wrapped true",
    ),
}


@pytest.mark.parametrize("told", WEAK)
def test_a_goal_that_says_too_little_is_a_hint(told: str, check: Check, tmp_path: Path) -> None:
    wrapped, packed = WEAK[told]
    first = ("tasks.ttl", "ex:vase ex:wrapped true", wrapped)
    assert check(first, ("tasks.ttl", "ex:vase ex:lies_in ex:crate", packed)) == []
    [hint] = map(str, validation.check_pack(Workspace(tmp_path / "robot"), "starting")[2])
    assert FORM.fullmatch(hint) and "entry pack the vase: " in hint and told in hint


def test_one_goal_that_says_enough_is_enough(check: Check, tmp_path: Path) -> None:
    assert check(("tasks.ttl", "ex:vase ex:wrapped true", "?any ex:wrapped true")) == []
    assert validation.check_pack(Workspace(tmp_path / "robot"), "starting")[2] == []


DELIBERATE = [
    "ASK { ?agent ex:holds ?thing . FILTER NOT EXISTS { ?thing2 ex:lies_in ?place } }",
    "ASK { ?agent ex:holds ?thing . FILTER NOT EXISTS { ?other_thing ex:lies_in ?place } }",
    "ASK { ?agent ex:holds ?thing } # ?thng",
    "ASK { ?agent ex:holds ?thing . ?thong ex:lies_in ?p . FILTER(?thong != ?thing) }",
]


@pytest.mark.parametrize("ask", DELIBERATE)
def test_a_variable_that_is_meant_is_no_slip(ask: str, check: Check) -> None:
    old = '"ASK { ?agent ex:holds ?thing }"'
    assert check(("actions.ttl", old, f'"""{ask}\n"""')) == []


def test_a_likely_slip_keeps_no_pack_from_being_loaded(check: Check, tmp_path: Path) -> None:
    old = '"ASK { ?agent ex:holds ?thing }"'
    assert check(("actions.ttl", old, old.replace("?thing", "?thng")))
    assert "put_down" in sources.load(Workspace(tmp_path / "robot"), "starting").domain.actions


def test_a_sound_pack_has_no_fault(check: Check) -> None:
    assert check() == []


def test_a_missing_file_is_told(check: Check, tmp_path: Path) -> None:
    (tmp_path / "robot/kg/starting/tasks.ttl").unlink()
    (tmp_path / "robot/kg/starting/state.ttl").unlink()
    assert [fault.split(":")[0] for fault in check()] == ["tasks.ttl", "state.ttl"]


def test_faults_in_every_file_are_told_at_once(check: Check) -> None:
    kinds = (
        "a misspelt ab: term",
        "a wording that names something else",
        "a bad effect",
        "a parameter without a class",
        "a requirement of no parameter",
        "a thing without a name",
        "a state that cannot be",
        "a goal on a misspelt property",
        "a plan with an unknown action",
    )
    found = check(*(BREAKS[kind][0] for kind in kinds))
    for kind in kinds:
        parts = BREAKS[kind][1]
        assert [fault for fault in found if all(part in fault for part in parts)], kind
    assert len(found) == len(kinds)


def test_broken_files_do_not_hide_each_other(check: Check) -> None:
    kinds = ("no Turtle", "no UTF-8", "a plan that is no text")
    assert len(check(*(BREAKS[kind][0] for kind in kinds))) == len(kinds)


LINES = [
    (path.name, number)
    for path in sorted(STARTER.glob("*.ttl"))
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines())
    if line.strip() and not line.startswith(("#", "@"))
]


def test_any_line_may_be_missing(tmp_path: Path) -> None:
    """Whatever line is lost, what is told has the form of a fault, and there is no traceback."""
    home = Workspace(tmp_path / "robot")
    packs.start(home, "starting")
    told = 0
    for file, number in LINES:
        path = home.root / "kg/starting" / file
        whole = path.read_text(encoding="utf-8")
        lines = whole.splitlines(keepends=True)
        path.write_text("".join(lines[:number] + lines[number + 1 :]), encoding="utf-8")
        found = [*map(str, validation.check_pack(home, "starting")[1])]
        told += bool(found)
        assert [fault for fault in found if not FORM.fullmatch(fault)] == []
        path.write_text(whole, encoding="utf-8")
    assert told > len(LINES) / 2


@pytest.mark.parametrize("name", ["kitchen", "household"])
def test_a_bundled_pack_and_its_copy_have_no_fault(name: str, tmp_path: Path) -> None:
    home = Workspace(tmp_path / "robot")
    assert validation.check_pack(home, name)[1] == []
    packs.start(home, "copied", name)
    shutil.rmtree(home.root / ".git")
    assert validation.check_pack(home, "copied")[1] == []


ONE_MISTAKE = {
    "a class at its declaration": ("domain.ttl", "ex:object a rdfs:", "ex:objekt a rdfs:", 1),
    "a class of one thing": ("attributes.ttl", "ex:egg rdf:type ex:o", "ex:egg rdf:type ex:x", 1),
    "a property at its declaration": ("domain.ttl", "ex:IsSliceable a", "ex:Slicable a", 1),
    "a property everywhere": ("attributes.ttl", "ex:IsSliceable ", "ex:IsSlicable ", -1),
    "a mark missing": ("attributes.ttl", " ;\n    ex:obj_name", "\n    ex:obj_name", 1),
}  # fmt: skip


@pytest.mark.parametrize("name", ONE_MISTAKE)
def test_one_mistake_is_one_fault(tmp_path: Path, name: str) -> None:
    home = Workspace(tmp_path / "robot")
    packs.start(home, "mine", "kitchen")
    file, old, new, times = ONE_MISTAKE[name]
    path = home.root / "kg" / "mine" / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, times), encoding="utf-8")

    _, *both = validation.check_pack(home, "mine")
    found, hints = ([*map(str, faults)] for faults in both)

    assert len(found) == 1, found
    assert FORM.fullmatch(found[0])
    assert not any("nearest" in hint for hint in hints)
    if "property" in name:
        assert "all_purpose_flour, apple, avocado and 63 more" in found[0]
