"""What Tab completes, asked as a shell asks it: by environment variables, and in a real bash."""

import os
import shutil
import sys
from pathlib import Path

import pexpect
import pytest

from tests.cli.command import Home

NEVER = {"litellm", "nltk", "rdflib", "pyoxigraph", "pygit2", "rich", "prompt_toolkit"}


def asked(line: str) -> dict[str, str]:
    """Return what bash sets when Tab is pressed at the end of a line."""
    words = line.split(" ")
    return {
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words) - 1),
        "_ADAPTBOT_COMPLETE": "complete_bash",
    }


def completed(home: Home, line: str, **env: str) -> list[str]:
    """Return what a line could go on with."""
    ended = home.adaptbot(**asked(line), **env)
    assert ended.err == ""
    return ended.out.split()


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("adaptbot ex", {"export"}),
        ("adaptbot kg show oni", {"onion", "onion_soup", "onion_sandwich"}),
        ("adaptbot kg show pan", {"pan", "pantry", "pantry_shelf"}),
        ("adaptbot kg why sli", {"slice"}),
        ("adaptbot run onion_so", {"onion_soup"}),
        ("adaptbot run tea --domain ho", {"household"}),
        ("adaptbot run tea --without milk,eg", {"milk,egg"}),
        ("adaptbot kg show --domain household mop_c", {"mop_cloth"}),
        ("adaptbot domain check kit", {"kitchen"}),
        ("adaptbot check plan --task onion_so", {"onion_soup"}),
        ("adaptbot --domain moon kg show eg", set()),
        ("adaptbot kg show --domain moon eg", set()),
    ],
)
def test_a_home_that_is_not_made_yet_completes_the_bundled_names(
    home: Home, line: str, found: set[str]
) -> None:
    assert set(completed(home, line)) == found
    assert home.files() == set()  # a Tab makes no workspace


def test_what_was_learned_run_and_committed_is_completed(home: Home) -> None:
    answers = home.write("a.yaml", "leek: {kind: object, obj_location: fridge}\n")
    assert completed(home, "adaptbot kg show lee") == []
    assert home.adaptbot("kg", "add", "leek", "--answers", answers, "--yes").code == 0
    assert completed(home, "adaptbot kg show lee") == ["leek"]
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    run = next((home.workspace / "transcripts").glob("*.yaml")).stem.partition("-")[0]
    for command in ("progress", "export", "resume", "replay"):
        assert completed(home, f"adaptbot {command} 2") == [run]
    revision, first = completed(home, "adaptbot kg diff ")
    assert revision != first
    assert home.adaptbot("kg", "diff", first, revision).code == 0
    fish = home.adaptbot(
        _TYPER_COMPLETE_ARGS="adaptbot progress ",
        _TYPER_COMPLETE_FISH_ACTION="get-args",
        _ADAPTBOT_COMPLETE="complete_fish",
    )
    assert fish.out == f"{run}\tmake_tea\n"
    zsh = home.adaptbot(
        _TYPER_COMPLETE_ARGS="adaptbot progress ", _ADAPTBOT_COMPLETE="complete_zsh"
    )
    assert f'"{run}":"make_tea"' in zsh.out


def test_a_second_tab_reads_no_graph(used: Home) -> None:
    completed(used, "adaptbot kg show oni")
    for line in ("adaptbot kg show oni", "adaptbot run te", "adaptbot kg diff "):
        code = (
            "import sys\nfrom adaptbot_cli.cli.main import main\n"
            "try: main()\nexcept SystemExit: pass\n"
            "print(*{n.partition('.')[0] for n in sys.modules}, file=sys.stderr)"
        )
        packages = set(used.python("-c", f"import sys; sys.argv = ['adaptbot']\n{code}",
                                   **asked(line)).err.split())  # fmt: skip
        assert "typer" in packages and not packages & NEVER


def test_broken_files_complete_nothing_and_say_nothing(home: Home) -> None:
    home.write("robot/adaptbot.toml", "")
    home.write("robot/kg/kitchen/domain.ttl", "no turtle")
    assert completed(home, "adaptbot kg show e") == []
    home.write("robot/adaptbot.toml", "no toml")
    assert completed(home, "adaptbot kg show e") == []


def test_a_name_that_a_shell_could_act_on_is_left_out(home: Home) -> None:
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    facts = home.workspace / "kg" / "kitchen" / "attributes.ttl"
    odd = ("egg$(touch x)", "egg\\u001b[31m", "egg;rm", "egg`id`", "egg*", "-egg", "egg\\u202e")
    more = "".join(f'\nex:odd{n} a ex:obj ; ex:obj_name "{odd}" .' for n, odd in enumerate(odd))
    facts.write_text(facts.read_text() + more + '\nex:fine a ex:obj ; ex:obj_name "eggplant" .\n')
    assert set(completed(home, "adaptbot kg add egg")) == {"egg", "eggplant"}
    assert completed(home, "adaptbot kg add -e") == []
    (home.workspace / "transcripts" / "$(id)-x'$(id)'.yaml").write_text("")
    assert len(completed(home, "adaptbot progress ")) == 1


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs two accounts")
def test_a_stranger_s_workspace_completes_nothing(home: Home) -> None:
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    assert completed(home, "adaptbot kg add eg") == ["egg"]
    os.chown(home.workspace, 12345, 12345)
    for line in ("kg show eg", "progress 2", "kg diff ", f"kg show --workspace {home.workspace} e"):
        assert completed(home, f"adaptbot {line}") == []


def test_nothing_outside_a_workspace_is_told(home: Home, tmp_path: Path) -> None:
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    away = tmp_path / "away"
    (away / "kitchen").mkdir(parents=True)
    (away / "kitchen" / "secret.plan").write_text("")
    (home.workspace / "plans").symlink_to(away)
    assert completed(home, "adaptbot plans show s") == []
    (home.workspace / "plans").unlink()
    home.write("robot/adaptbot.toml", 'domain = "../../away/kitchen"')
    assert completed(home, "adaptbot plans show s") == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_in_a_real_bash(home: Home, tmp_path: Path) -> None:
    bin_ = tmp_path / "bin"
    bin_.mkdir()
    tool = bin_ / "adaptbot"
    tool.write_text(f'#!/bin/sh\nexec {sys.executable} -m adaptbot_cli "$@"\n')
    tool.chmod(0o755)
    source = home.adaptbot(_ADAPTBOT_COMPLETE="source_bash").out
    assert "complete -o default -F" in source
    rc = home.write("rc", f"{source}\nPS1='ready> '\nbind 'set enable-bracketed-paste off'\n")
    environment = home.environment(TERM="dumb", INPUTRC="/dev/null")
    environment["PATH"] = f"{bin_}:{environment['PATH']}"
    bash = pexpect.spawn(
        "bash", ["--noprofile", "--rcfile", rc, "-i"], env=environment, cwd=str(home.folder),
        encoding="utf-8", timeout=60, dimensions=(24, 80),
    )  # fmt: skip
    try:
        bash.expect_exact("ready> ")
        bash.send("adaptbot kg show cutt\t")
        bash.expect_exact("cutting_board ")
        bash.send("--json\r")
        bash.expect_exact('"name": "cutting_board"')
        bash.expect_exact("ready> ")
        bash.send("adaptbot run tea --domain hou\t")
        bash.expect_exact("household ")
    finally:
        bash.close(force=True)
