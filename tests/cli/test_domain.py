"""`adaptbot domain new`, `check` and `docs`, as a newcomer types them."""

import pytest

from adaptbot_cli.adapters.handbook import escaped
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.session import sources
from adaptbot_cli.workspace import Workspace
from tests.cli.command import Home


@pytest.fixture(scope="module")
def started(used: Home) -> Home:
    """Return a home with a new domain in it."""
    assert used.adaptbot("domain", "new", "post_room").code == 0
    return used


def test_a_new_domain_is_sound_and_runs_at_once(started: Home) -> None:
    assert started.subjects() == ["domain: start post_room from the starting pack"]
    checked = started.adaptbot("domain", "check", "post_room", "--json")
    sound = {"domain": "post_room", "faults": [], "hints": []}
    assert (checked.code, checked.json()) == (0, sound)
    ran = started.adaptbot("run", "pack the vase", "--domain", "post_room", "--no-human", "--json")
    told = ran.json()
    assert ran.code == 0 and told["goal"]["met"] and told["domain"] == "post_room"
    assert [s["status"] for s in told["steps"]] == ["ok", "inserted", "ok", "inserted", "ok"]


def test_all_that_is_written_is_committed(started: Home) -> None:
    repo = Repo.open_or_init(started.workspace)
    paths = [p for p in started.files() if p.startswith("robot/") and ".git/" not in p]
    written = [p.removeprefix("robot/") for p in paths if p.endswith((".ttl", ".plan", ".toml"))]
    assert len(written) >= 7 and repo.dirty(written) == []


def test_a_plan_of_the_workspace_goes_before_a_bundled_one(home: Home) -> None:
    plan = '---\nnames: [omelette]\ningredients: [egg]\n---\nfry("egg", "pan")\n'
    home.write("robot/prompts/library/kitchen/my_way.plan", plan)
    ran = home.adaptbot("run", "make omelette", "--no-human", "--dry-run", "--json")
    assert [s["source"] for s in ran.json()["steps"] if s["source"]] == ['fry("egg", "pan")']


def test_a_copy_of_a_domain_as_it_is_here(started: Home) -> None:
    path = started.workspace / "kg/post_room/attributes.ttl"
    text = path.read_text(encoding="utf-8")
    path.write_text(text + '\nab:post_room ab:absentItem "gold" ;\n.\n', encoding="utf-8")
    made = started.adaptbot("domain", "new", "mail_van", "--like", "post_room")
    assert made.code == 0, made.err
    copied = (started.workspace / "kg/mail_van/attributes.ttl").read_text(encoding="utf-8")
    assert 'ab:mail_van ab:absentItem "gold"' in copied
    names = {"post_room": "mail_van"}
    domain = (started.workspace / "kg/post_room/domain.ttl").read_text(encoding="utf-8")
    for old, new in names.items():
        domain = domain.replace(f"ab:{old}", f"ab:{new}").replace(f'"{old}"', f'"{new}"')
    assert (started.workspace / "kg/mail_van/domain.ttl").read_text(encoding="utf-8") == domain
    path.write_text(text, encoding="utf-8")


REFUSED = [
    "../out", "/tmp/x", "a/b", "", ".", "..", "-x", "Post Room", "post room", "é", "a" * 41, "1st",
    "x\x1b[31m", "x\n", "con:", "agent", "kitchen", "post_room", "$(id)", "ex:thing", '"; .',
]  # fmt: skip


def test_names_that_will_not_do_are_refused_with_a_sentence(started: Home) -> None:
    before = started.files()
    ended = started.adaptbots([["domain", "new", "--", name] for name in REFUSED])
    for name, end in zip(REFUSED, ended, strict=True):
        assert (end.code, end.out) == (2, ""), name
        assert end.err.startswith("error: ") and "\x1b" not in end.err, name
        assert "domain" in end.err and len(end.err.splitlines()) == 1, name
    assert started.files() == before
    assert "post_room would do" in ended[REFUSED.index("Post Room")].err


def test_nothing_that_is_there_is_overwritten(home: Home) -> None:
    home.write("robot/prompts/library/garden/pack.plan", "mine")
    ended = home.adaptbot("domain", "new", "garden")
    assert ended.code == 2 and "pack.plan is there already" in ended.err
    assert not (home.workspace / "kg").exists()
    assert (home.workspace / "prompts/library/garden/pack.plan").read_text() == "mine"


def test_like_a_domain_that_there_is_not_or_that_is_broken(home: Home) -> None:
    ended = home.adaptbot("domain", "new", "garden", "--like", "kitchn")
    assert ended.code == 2 and 'no domain "kitchn"' in ended.err
    assert home.adaptbot("domain", "new", "garden").code == 0
    path = home.workspace / "kg/garden/actions.ttl"
    path.write_text(path.read_text().replace("ab:explain", "ab:explian"), encoding="utf-8")
    ended = home.adaptbot("domain", "new", "orchard", "--like", "garden")
    assert ended.code == 4 and "the nearest is ab:explain" in ended.err
    assert "more: see `adaptbot domain check`" in ended.err
    assert not (home.workspace / "kg/orchard").exists()
    checked = home.adaptbot("domain", "check", "garden")
    assert checked.code == 3 and checked.out.count("✗ actions.ttl, entries ") == 2


def test_a_page_to_read(started: Home) -> None:
    page = started.adaptbot("domain", "docs", "post_room")
    assert page.code == 0 and page.err == ""
    for part in (
        "# post_room\n",
        "\n- **item** `item`: anything that has a name\n  - **thing** `thing`: ",
        "\n    - 2 here: `book`, `vase`\n",
        "| fragile | `is_fragile` | thing | yes or no | Does {name} break easily? |",
        "\n### `put_down(thing, [place])`\n\nPut a thing",
        "Also called `lay`, `place`, `put`.",
        "- must hold, or else “{thing} must be in the hand to be put down”:\n\n  ```sparql\n"
        "  ASK { ?agent ex:holds ?thing }\n  ```\n",
        "- `thing`: fragile (`is_fragile`) is yes; if unknown, it is asked; or else “{thing} is ",
        "- thing: wrapped\n",
        "- the robot: no longer holds thing\n",
        "DELETE { ?thing ex:wrapped ?before }\nINSERT { ?thing ex:wrapped true }\nWHERE {",
        "### pack the vase\n\nAlso asked for as: put the vase into the crate, wrap the vase.\n\n"
        "Requires `vase`.\n\n- must hold, or else “the vase is not wrapped”:",
    ):
        assert part in page.out, part
    assert "\n\n\n" not in page.out


@pytest.mark.parametrize("name", ["kitchen", "household"])
def test_a_page_is_the_same_in_every_process_and_tells_all(used: Home, name: str) -> None:
    path = used.folder / f"{name}.md"
    ended = used.adaptbot("domain", "docs", name, "-o", str(path), PYTHONHASHSEED="1")
    assert (ended.code, ended.out) == (0, "")
    page = path.read_text(encoding="utf-8")
    assert used.adaptbot("domain", "docs", name, PYTHONHASHSEED="2").out == page
    domain = sources.load(Workspace(used.workspace), name).domain
    names = [f"### `{action}(" for action in domain.actions]
    names += [f"`{local(iri)}`" for iri in (*domain.properties, *domain.classes)]
    names += [f"\n### {escaped(task.name)}\n" for task in domain.tasks]
    names += [escaped(p.question) for p in domain.properties.values()]
    assert [name for name in names if name not in page] == []


def test_a_page_that_cannot_be_written_or_of_nothing(used: Home) -> None:
    ended = used.adaptbot("domain", "docs", "kitchen", "-o", str(used.folder / "no" / "x.md"))
    assert ended.code == 2 and "cannot write" in ended.err
    assert used.adaptbot("domain", "docs", "kitchn").code == 2


def test_two_that_start_one_domain_at_once(home: Home) -> None:
    new = ("domain", "new", "garden")
    with home.begun(*new) as one, home.begun(*new) as two:
        ends = [one.ends(), two.ends()]
    assert sorted(ended.code for ended in ends) == [0, 2], ends
    assert len(home.subjects()) == 1


def test_a_broken_domain_is_listed_with_the_others(home: Home) -> None:
    assert home.adaptbot("domain", "new", "garden").code == 0
    (home.workspace / "kg/garden/domain.ttl").write_text("ab: (", encoding="utf-8")
    ended = home.adaptbot("domain", "list")
    assert ended.code == 0 and "kitchen" in ended.said and "household" in ended.said
    assert "see adaptbot domain" in ended.said
    rows = {row["name"]: row for row in home.adaptbot("domain", "list", "--json").json()}
    assert rows["garden"]["actions"] is None and rows["kitchen"]["actions"] > 10


def test_without_a_name_the_configured_domain_is_checked(home: Home) -> None:
    ended = home.adaptbot("domain", "check")
    assert ended.code == 0 and "kitchen:" in ended.out
