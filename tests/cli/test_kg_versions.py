"""A story: taught in a run, edited by hand, changed, taken back; and who did each of it."""

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.session import additions, change, knowledge, queries, validation
from adaptbot_cli.session.home import Home as Known
from adaptbot_cli.workspace import Workspace
from tests.cli.command import Ended, Home

EX = "http://example.org/"
ANSWERS = "chives: {existence: exists, kind: object, obj_location: fridge}\n"
LEEK = (
    "leek: {kind: object, obj_location: fridge, IsLiquid: no, IsSliceable: yes, Boilable: unknown,"
    " Fryable: unknown, NeedsToBeCleaned: no, IsBig: no}\n"
)
MOVED = (
    "DELETE WHERE { ex:THING ex:obj_location ?x } ;"
    " INSERT DATA { ex:THING ex:obj_location ex:table }"
)
Fresh = Callable[[], Known]


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """A home in which a run has taught chives, and leek was added after it."""
    home = Home(tmp_path_factory.mktemp("taught"))
    answers = home.write("answers.yaml", ANSWERS)
    assert home.adaptbot("run", "make omelette", "--answers", answers).code == 0
    leek = home.write("leek.yaml", LEEK)
    assert home.adaptbot("kg", "add", "leek", "--answers", leek, "--yes").code == 0
    return home


@pytest.fixture
def fresh(taught: Home, tmp_path: Path) -> Fresh:
    """What is known in a copy of that home, read anew at each call."""
    shutil.copytree(taught.workspace, tmp_path / "robot")
    return lambda: Known(Workspace(tmp_path / "robot"), "kitchen")


def edit(home: Known, file: str, old: str, new: str) -> None:
    path = home.workspace.root / "kg" / "kitchen" / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def facts(home: Known, name: str) -> set[str]:
    return {home.words.sentence(t) for t in home.facts if home.words.name(t[0]) == name}


def answer_about(home: Known, text: str) -> str:
    """The id of the answer that taught something."""
    [told] = [
        f"{chapter.origin.revision[:7]}.{told.number}"
        for chapter in knowledge.chapters(home, None)
        for told, sentence in zip(chapter.answers, chapter.sentences, strict=True)
        if text in sentence
    ]
    return told


def test_the_log_tells_who_taught_what_and_for_what(taught: Home) -> None:
    shown, told, one, none = taught.adaptbots(
        [["kg", "log"], ["kg", "log", "--json"], ["kg", "log", "chives"], ["kg", "log", "nothing"]]
    )
    assert "leek: sliceable yes" in shown.said and "omelette · plan library" in shown.said
    added, learned, start = told.json()
    assert (learned["task"], learned["planner"]) == ("omelette", "plan library")
    assert learned["transcript"].endswith("make_omelette.yaml")
    assert learned["answers"][1]["question"] == 'Where is "chives" kept?'
    assert learned["answers"][1]["answer"] == "fridge" and learned["answers"][1]["by"]
    assert added["task"] == "add leek" and start["start"] and start["added"] > 1000
    assert "leek" not in one.out and "chives" in one.out
    assert (none.code, "Traceback" in none.err) == (2, False)


def test_why_of_a_fact_outlives_later_commits(fresh: Fresh) -> None:
    change.commit(fresh(), change.retract(fresh(), "leek"))
    edit(fresh(), "state.ttl", "ex:chives ", "# moved by hand\nex:chives ")
    told = knowledge.why(fresh(), "chives place")
    [origin] = told.facts.values()
    assert (origin.source, origin.question) == ("answer", 'Where is "chives" kept?')
    assert (origin.said, origin.task, origin.planner) == ("fridge", "omelette", "plan library")
    assert origin.transcript.endswith(".yaml") and origin.when and origin.by
    assert {o.source for o in knowledge.why(fresh(), "egg").facts.values()} == {"pack"}


def test_every_kind_of_origin_is_told(fresh: Fresh, tmp_path: Path) -> None:
    edit(fresh(), "state.ttl", "ex:egg ex:IsBoiled false", "ex:egg ex:IsBoiled true")
    [origin] = knowledge.why(fresh(), "egg", "boiled").facts.values()
    assert origin.source == "uncommitted"
    assert change.commit_edits(fresh(), "the egg is boiled")
    [origin] = knowledge.why(fresh(), "egg", "IsBoiled").facts.values()
    assert (origin.source, origin.subject) == ("hand edit", "the egg is boiled")
    past = knowledge.why(fresh(), "egg", "boiled").history
    assert [(turn.sign, turn.origin.source) for turn in past][-1] == ("+", "pack")

    update = MOVED.replace("THING", "egg")
    change.commit(fresh(), queries.update(fresh(), update))
    [origin] = knowledge.why(fresh(), "egg", "place").facts.values()
    assert origin.source == "update" and origin.by

    path = tmp_path / "moved.ttl"
    path.write_text(f"<{EX}egg> <{EX}obj_location> <{EX}fridge> .", encoding="utf-8")
    change.commit(fresh(), queries.imported(fresh(), [path], False)[1])
    [origin] = knowledge.why(fresh(), "egg", "place").facts.values()
    assert (origin.source, origin.subject) == ("import", "import: moved.ttl")


def test_a_fact_committed_with_git_is_told_as_such(fresh: Fresh) -> None:
    if not shutil.which("git"):
        pytest.skip("needs git")
    root = fresh().workspace.root
    edit(fresh(), "state.ttl", "ex:egg ex:IsBoiled false", "ex:egg ex:IsBoiled true")
    who = ["-c", "user.name=Someone", "-c", "user.email=s@example.org"]
    subprocess.run(["git", "-C", root, *who, "commit", "-qam", "boiled"], check=True)
    [origin] = knowledge.why(fresh(), "egg", "boiled").facts.values()
    assert (origin.source, origin.author, origin.subject) == ("git", "Someone", "boiled")


def test_taking_back_that_a_thing_exists_takes_all_of_it_and_nothing_else(fresh: Fresh) -> None:
    before = fresh()
    [fridge] = before.kg.find("fridge")
    update = 'INSERT DATA { ex:leek ab:alias "poireau" }'
    change.commit(before, queries.update(before, update))
    later = fresh()
    proposal = change.revert_answer(later, answer_about(later, "there is leek"))
    change.commit(later, proposal)
    now = fresh()
    leek = {t for t in later.facts if str(t[0]) == f"{EX}leek"}
    assert later.facts - now.facts == leek and len(leek) > 8
    assert now.facts <= later.facts and not now.kg.find("poireau") and now.kg.find("chives")
    assert fridge in now.kg.find("fridge")


def test_taking_back_an_attribute_takes_the_state_that_it_brought(fresh: Fresh) -> None:
    home = fresh()
    update = "DELETE { ex:leek ex:sliced false } INSERT { ex:leek ex:sliced true } WHERE {}"
    change.commit(home, queries.update(home, update))
    change.commit(fresh(), change.revert_answer(fresh(), answer_about(fresh(), "sliceable")))
    assert facts(home, "leek") - facts(fresh(), "leek") == {
        "leek: sliceable yes",
        "leek: sliced no",
    }
    assert "leek: sliced yes" not in facts(fresh(), "leek")


def test_later_work_on_the_same_fact_stays(fresh: Fresh) -> None:
    home = fresh()
    update = MOVED.replace("THING", "chives")
    change.commit(home, queries.update(home, update))
    proposal = change.revert_answer(fresh(), answer_about(fresh(), "chives: place"))
    assert not proposal.delta
    assert "chives: place table" in facts(fresh(), "chives")


def test_a_revert_can_be_reverted(fresh: Fresh) -> None:
    before = fresh().facts
    [_, learned, _] = list(knowledge.chapters(fresh(), None))
    change.commit(fresh(), change.revert(fresh(), learned.origin.revision))
    assert not fresh().kg.find("chives")
    change.commit(fresh(), change.revert(fresh(), "HEAD"))
    assert fresh().facts == before


def test_a_revert_names_the_plans_that_are_judged_otherwise(fresh: Fresh) -> None:
    proposal = change.revert_answer(fresh(), answer_about(fresh(), "there is chives"))
    assert change.verdicts(fresh(), proposal.delta) == [("omelette", "goal met", "findings")]
    leek = change.retract(fresh(), "leek")
    assert change.verdicts(fresh(), leek.delta) == []


@pytest.mark.parametrize("revision", ["HEAD~2", "nothing", "0000000"])
def test_what_cannot_be_reverted_is_refused(fresh: Fresh, revision: str) -> None:
    with pytest.raises(KnowledgeError):
        change.revert(fresh(), revision)
    with pytest.raises(KnowledgeError, match="no answer"):
        change.revert_answer(fresh(), f"{revision}.1")


def test_a_thing_with_others_in_it_is_retracted_with_their_places(fresh: Fresh) -> None:
    home = fresh()
    change.commit(home, change.retract(home, "fridge"))
    now = fresh()
    gone = home.facts - now.facts
    assert not now.kg.find("fridge") and now.kg.find("leek")
    assert {t[0] for t in gone if str(t[2]) == f"{EX}fridge"} and "leek: place fridge" in {
        home.words.sentence(t) for t in gone
    }


def test_an_absence_is_lifted_by_retracting_it(fresh: Fresh) -> None:
    update = 'INSERT DATA { ab:kitchen ab:absentItem "saffron" }'
    change.commit(fresh(), queries.update(fresh(), update))
    proposal = change.retract(fresh(), "saffron")
    assert proposal.subject == "retract: saffron is not here"
    [triple] = proposal.delta.removed
    change.commit(fresh(), proposal)
    assert triple not in fresh().facts


def test_another_name_is_retracted_and_its_thing_stays(fresh: Fresh) -> None:
    change.commit(fresh(), queries.update(fresh(), 'INSERT DATA { ex:leek ab:alias "poro" }'))
    change.commit(fresh(), change.retract(fresh(), "poro"))
    assert fresh().kg.find("leek") and not fresh().kg.find("poro")


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (("nothing at all",), "nothing is called"),
        (("leek", "colour"), "nothing says of leek"),
        (("leek", "place", "moon"), "nothing says of leek"),
        (("leek", "name"), "without a name"),
        (("fry",), "actions.ttl"),
    ],
)
def test_what_is_not_known_cannot_be_retracted(
    fresh: Fresh, said: tuple[str, ...], told: str
) -> None:
    with pytest.raises(UsageError, match=told):
        change.retract(fresh(), *said)


def test_a_patch_does_what_the_difference_tells(fresh: Fresh, taught: Home) -> None:
    changes, before, after, _ = knowledge.differences(fresh(), "HEAD~1", "HEAD")
    assert (before, after) == ("HEAD~1", "HEAD")
    shown = taught.adaptbot("kg", "diff", "HEAD~1", "HEAD", "--patch")
    old = fresh()
    change.commit(old, change.revert(old, "HEAD"))
    change.commit(fresh(), queries.update(fresh(), shown.out))
    assert fresh().facts == old.facts and len(changes.delta.added) == 8


def test_hand_edits_are_told_and_committed_if_they_fit(fresh: Fresh) -> None:
    assert change.commit_edits(fresh(), "nothing") is None
    edit(fresh(), "state.ttl", "ex:egg ex:IsBoiled false", "ex:egg ex:IsBoiled 7")
    told = validation.status(fresh())
    assert list(told.edited) == ["state.ttl"] and len(told.faults) == 1
    with pytest.raises(KnowledgeError, match="egg: .*IsBoiled.* must be a boolean"):
        change.commit_edits(fresh(), "wrong")
    [fault] = validation.validate(fresh().workspace, "kitchen")
    assert fault.file == "kg/kitchen/state.ttl" and "not committed" in fault.cause
    edit(fresh(), "state.ttl", "ex:egg ex:IsBoiled 7", "ex:egg ex:IsBoiled true")
    assert change.commit_edits(fresh(), "boiled") == fresh().needed().repo.head()
    assert not validation.status(fresh()).edited and not validation.validate(
        fresh().workspace, "kitchen"
    )


def test_a_fact_in_the_wrong_file_is_not_committed_and_is_taken_back_from_there(
    fresh: Fresh,
) -> None:
    edit(fresh(), "state.ttl", "ex:egg ex:IsBoiled", "ex:egg ex:IsBig true ; ex:IsBoiled")
    with pytest.raises(KnowledgeError, match="IsBig does not belong here; move it to attributes"):
        change.commit_edits(fresh(), "wrong")
    change.commit(fresh(), change.retract(fresh(), "egg", "IsBig", "yes"))
    assert "IsBig" not in (fresh().workspace.root / "kg/kitchen/state.ttl").read_text()
    assert "egg: too big to carry no" in facts(fresh(), "egg")


def test_several_faults_are_told_once_each_and_the_first_few(fresh: Fresh) -> None:
    path = fresh().workspace.root / "kg/kitchen/attributes.ttl"
    facts_there = path.read_text(encoding="utf-8")
    added = "ex:egg ex:obj_location ex:drawer, ex:rack .\n"
    path.write_text(facts_there + added, encoding="utf-8")
    with pytest.raises(KnowledgeError) as told:
        change.commit_edits(fresh(), "wrong")
    assert str(told.value).count("obj_location does not belong here") == 1
    found = validation.validate(fresh().workspace, "kitchen")
    assert len(found) == len({fault.message for fault in found}) == 2
    path.write_text(facts_there.replace(":IsLiquid false", ":IsLiquid 7"), encoding="utf-8")
    with pytest.raises(KnowledgeError, match=r"and \d+ more: liquid \(IsLiquid\)") as told:
        change.commit_edits(fresh(), "wrong")
    assert str(told.value).count("must be a boolean") == 1
    several = re.sub(r":(Boilable|Fryable|IsBig|IsLiquid) false", r":\1 7", facts_there)
    path.write_text(several, encoding="utf-8")
    with pytest.raises(
        KnowledgeError, match=r"; and 1 more: see adaptbot kg validate --domain kitchen$"
    ):
        change.commit_edits(fresh(), "wrong")
    path.write_text(facts_there, encoding="utf-8")


NEW = "edited by hand, not committed yet"
CAUSES = {
    "must be a boolean": ("attributes", "ex:egg ex:IsLiquid 7 .", NEW),
    "has 2 values": (
        "attributes",
        "ex:egg ex:IsLiquid 7 .",
        f"{NEW}; it came with the kitchen pack",
    ),
    "nothing says what it is": ("state", "ex:ghost ex:obj_location ex:fridge .", NEW),
    'its other name "a; b" is that of egg too': (
        "attributes",
        'ex:egg <urn:adaptbot:alias> "a; b" . ex:apple <urn:adaptbot:alias> "a; b" .',
        NEW,
    ),
    "it can be only one of them": (
        "attributes",
        "ex:egg a ex:imreceptacle .",
        f"{NEW}; it came with the kitchen pack",
    ),
}


@pytest.mark.parametrize("problem", CAUSES)
def test_the_cause_of_a_fault_is_where_its_own_facts_come_from(fresh: Fresh, problem: str) -> None:
    file, more, cause = CAUSES[problem]
    path = fresh().workspace.root / f"kg/kitchen/{file}.ttl"
    path.write_text(f"{path.read_text(encoding='utf-8')}\n{more}\n", encoding="utf-8")
    found = validation.validate(fresh().workspace, "kitchen")
    [fault] = [fault for fault in found if problem in fault.message]
    assert fault.cause == cause and fault.file == f"kg/kitchen/{file}.ttl"


def test_edits_that_are_no_turtle_are_told_with_their_line(taught: Home, fresh: Fresh) -> None:
    edit(fresh(), "state.ttl", "ex:egg ex:IsBoiled false", "ex:egg ex:IsBoiled ?")
    root = str(fresh().workspace.root)
    ended: dict[str, Ended] = dict(
        zip(
            ("status", "validate", "commit", "diff", "log"),
            taught.adaptbots(
                [
                    ["kg", "status", "--workspace", root],
                    ["kg", "validate", "--workspace", root],
                    ["kg", "commit", "-m", "x", "--workspace", root],
                    ["kg", "diff", "--workspace", root],
                    ["kg", "log", "--workspace", root],
                ]
            ),
            strict=True,
        )
    )
    codes = {name: end.code for name, end in ended.items()}
    assert codes == {"status": 0, "validate": 3, "commit": 4, "diff": 4, "log": 4}
    for end in ended.values():
        assert "state.ttl, line" in end.said and "Traceback" not in end.err


def test_the_commands_agree_with_json(taught: Home) -> None:
    commands = [
        ["kg", "status", "--json"],
        ["kg", "validate", "--json"],
        ["kg", "diff", "--json"],
        ["kg", "why", "chives", "--json"],
        ["kg", "query", "SELECT ?x { ?x ex:obj_name 'leek' }", "--json"],
        ["kg", "query", "ASK { ex:leek a ex:object }", "--json"],
        ["kg", "query", "CONSTRUCT WHERE { ex:leek ex:obj_name ?x }", "--json"],
        ["kg", "show", "fry", "--json"],
        ["kg", "show", "french toast", "--json"],
        ["kg", "show", "--tasks", "--json"],
        ["kg", "retract", "leek", "--dry-run", "--json"],
    ]
    ended = [end.json() for end in taught.adaptbots(commands)]
    status, faults, diff, why, select, ask, graph, action, task, tasks, retract = ended
    assert status["revision"] and status["edited"] == [] and faults == []
    assert diff["things"][0]["name"] == "leek" and diff["added"] == 8
    assert {fact["origin"]["source"] for fact in why["facts"]} == {"answer"}
    assert select["results"]["bindings"] == [{"x": {"type": "uri", "value": f"{EX}leek"}}]
    assert ask["boolean"] is True and graph[0]["@id"] == f"{EX}leek"
    assert action["action"] == "fry" and action["requires"] and action["changes"]["adds"]
    assert "egg" in task["needs"] and len(tasks) > 40
    assert retract["revision"] is None and retract["removed"] == 8 and retract["plans"] == []


REFUSED = {
    "update": (["query", "INSERT DATA { ex:egg ex:sliced true }"], "--update"),
    "service": (["query", "SELECT * { SERVICE <http://localhost:1/> { ?s ?p ?o } }"], "network"),
    "load": (["query", "LOAD <file:///etc/passwd>", "--update"], "network"),
    "no query": (["query", "SELECT"], "no valid SPARQL"),
    "a graph": (
        ["query", "INSERT DATA { GRAPH ab:state { ex:egg ex:sliced true } }", "--update"],
        "without GRAPH",
    ),
    "unasked": (["retract", "leek"], "--yes"),
    "unanswered": (["add", "saffron"], "--answers"),
    "no message": (["commit"], "say what was edited"),
    "both": (["revert", "HEAD", "--answer", "x"], "say what to undo"),
    "unfit": (
        ["query", "INSERT DATA { ex:egg ex:obj_location ex:onion }", "--update", "--yes"],
        "must be a receptacle, onion is not",
    ),
}


def test_what_cannot_be_meant_changes_nothing(taught: Home) -> None:
    before = taught.subjects()
    asked = taught.adaptbots([["kg", *arguments] for arguments, _ in REFUSED.values()])
    for (name, (_, told)), ended in zip(REFUSED.items(), asked, strict=True):
        assert ended.code in (2, 4) and told in ended.said, name
        assert "Traceback" not in ended.err
    assert taught.subjects() == before


def test_an_answer_that_does_not_fit_loses_no_other(taught: Home, fresh: Fresh) -> None:
    answers = Path(taught.write("odd.yaml", LEEK.replace("leek", "kale").replace("no,", "maybe,")))
    with pytest.raises(UsageError, match="maybe"):
        additions.teach(fresh(), "kale", answers, None, agreed=True)
    assert not fresh().kg.find("kale")


def test_an_export_is_the_same_whenever_it_is_made(taught: Home) -> None:
    for form in ("json-ld", "xml"):
        command = ["kg", "export", "--format", form]
        one, two = [taught.adaptbot(*command, PYTHONHASHSEED=seed) for seed in ("1", "7")]
        assert one.code == 0 and one.out and one.out == two.out
    parts = [
        taught.adaptbot("kg", "export", "--graph", part, "--format", "nt").out.splitlines()
        for part in ("attribute", "state", "merged")
    ]
    assert sorted(parts[0] + parts[1]) == parts[2]


def test_a_new_thing_is_added_in_a_place_that_is_new_too(home: Home) -> None:
    text = "leek: {kind: object, obj_location: new crate, IsLiquid: no}\n"
    told = home.write("told.yaml", f"{text}crate: {{kind: imreceptacle}}\n")
    ended = home.adaptbot("kg", "add", "leek", "--answers", told, "--yes")
    assert ended.code == 0 and "there is crate" in ended.out and "place crate" in ended.out
    assert "+ leek obj_location crate" in [f for t in home.trailers().values() for f in t]


def test_an_answer_is_reverted_by_its_id_alone(fresh: Fresh, taught: Home) -> None:
    answer = answer_about(fresh(), "there is chives")
    ended = taught.adaptbots(
        [
            ["kg", "revert", answer, "--dry-run", "--json"],
            ["kg", "revert", "--answer", answer, "--dry-run", "--json"],
            ["kg", "revert", f"{answer}9", "--dry-run"],
        ]
    )
    assert ended[0].code == 0 and ended[0].out == ended[1].out
    assert ended[2].code == 4 and "no answer" in ended[2].err


def test_the_log_names_no_planner_where_there_was_none(taught: Home) -> None:
    told = taught.adaptbot("kg", "log", "leek").said
    assert "add leek" in told and "· none" not in told


def test_what_is_true_now_is_said_in_a_line_and_kept_as_an_answer(home: Home) -> None:
    ended = home.adaptbot("kg", "set", "egg", "place", "the cabinet", "--yes")
    assert ended.code == 0 and "place fridge → cabinet" in ended.said
    assert home.adaptbot("kg", "show", "egg", "--json").json()["place"] == "cabinet"
    assert home.trailers()["Question-1"] == ['Where is "egg" kept?']
    ended = home.adaptbot("kg", "set", "egg", "sliceable", "No", "--yes", "--json")
    assert {plan["after"] for plan in ended.json()["plans"]} == {"findings"}
    assert "it is so already" in home.adaptbot("kg", "set", "egg", "sliceable", "no").said
    assert home.adaptbot("undo", "--yes").code == 0
    egg = home.adaptbot("kg", "show", "egg", "--json").json()
    assert egg["place"] == "cabinet" and egg["attributes"]["IsSliceable"] is True


IMPOSSIBLE = (
    (("egg", "place", "nowhere"), "it may be: fridge"),
    (("egg", "sliceabl", "no"), "egg has no property sliceabl; it has sliceable"),
    (("egg", "sliceable", "maybe"), 'sliceable of egg cannot be "maybe"; it may be: yes, no'),
    (("unicorn", "place", "sink"), "nothing is called unicorn"),
    (("egg", "place", "egg"), 'place of egg cannot be "egg"'),
    (("egg", "place", "robot_arm"), 'place of egg cannot be "robot_arm"'),
    (("egg", "name", "ovo"), "egg has no property name"),
    (("robot", "holds", "egg"), "is kept as it acts"),
)


def test_what_cannot_be_true_is_told_with_what_can(home: Home) -> None:
    asked = [["kg", "set", *words, "--yes"] for words, _ in IMPOSSIBLE]
    for (_, told), ended in zip(IMPOSSIBLE, home.adaptbots(asked), strict=True):
        assert ended.code == 2 and told in ended.said
