"""What `adaptbot config` says is what a run takes, and where it is from; no secret is in it."""

from tests.cli.command import Home, mapped

KEY = "sk-0123456789abcdef"


def told(home: Home, *arguments: str, **env: str) -> dict[str, tuple[object, str, str | None]]:
    """Return what is said of each setting: its value, its source, what is ignored."""
    rows = home.adaptbot("config", "--json", *arguments, **env).json()["settings"]
    return {
        row["name"]: (row["value"], row["source"], row["ignored"] and row["ignored"]["value"])
        for row in rows
    }


def test_without_any_file_the_defaults_hold(home: Home) -> None:
    found = told(home, ADAPTBOT_MODEL="")
    assert found["domain"] == ("kitchen", "default", None)
    assert found["replans"] == (3, "default", None)
    assert found["model"] == (None, "default", None)
    assert home.files() == set()
    assert "plan library" in home.adaptbot("config", ADAPTBOT_MODEL="").said


def test_each_setting_says_where_it_comes_from(home: Home) -> None:
    home.write(".config/adaptbot/adaptbot.toml", 'model = "own/model"\nreplans = 1\nseed = 7\n')
    home.write("robot/adaptbot.toml", 'model = "gpt-4o"\npolicy = "paper"\nreplans = 0\n')
    found = told(home, ADAPTBOT_MODEL="")
    assert found["policy"] == ("paper", "workspace", None)
    assert found["replans"] == (0, "workspace", None)
    assert found["seed"] == (7, "own file", None)
    assert found["model"] == ("own/model", "own file", "gpt-4o")
    assert told(home)["model"] == ("library", "environment", "gpt-4o")
    run = home.adaptbot("run", "make tea", "--no-human", "--dry-run")
    assert "plan library" in run.said and "model ignored" in run.said
    assert home.adaptbot("trust", "--yes").code == 0
    assert told(home)["model"] == ("gpt-4o", "workspace", None)
    [row] = mapped([home.adaptbot("config", "model", "--json").json()], "value", "where")
    assert row == ("gpt-4o", str(home.workspace / "adaptbot.toml"))


def test_the_environment_goes_before_files_for_the_shared_graph(home: Home) -> None:
    home.write(".config/adaptbot/adaptbot.toml", '[kg]\nendpoint = "http://127.0.0.1:1/a"\n')
    assert told(home)["kg.endpoint"][:2] == ("http://127.0.0.1:1/a", "own file")
    found = told(home, ADAPTBOT_KG_ENDPOINT="http://127.0.0.1:2/b")
    assert found["kg.endpoint"][:2] == ("http://127.0.0.1:2/b", "environment")
    ended = home.adaptbot("kg", "pull", ADAPTBOT_KG_ENDPOINT="http://127.0.0.1:2/b")
    assert "http://127.0.0.1:2/b" in ended.said


def test_no_secret_is_shown(home: Home) -> None:
    home.write(".config/adaptbot/adaptbot.toml", 'api_base = "http://me:geheimnis@127.0.0.1/v1"\n')
    secret = {"OPENAI_API_KEY": KEY, "ODD_API_KEY": KEY, "ADAPTBOT_KG_TOKEN": KEY}
    asked = home.adaptbot("config", "--json", **secret)
    shown = home.adaptbot("config", **secret)
    for text in (asked.out, shown.out):
        assert KEY not in text and "geheimnis" not in text
        assert "ODD_API_KEY" in text and "GROQ_API_KEY" in text
    assert asked.json()["secrets"]["OPENAI_API_KEY"] is True
    assert asked.json()["secrets"]["GROQ_API_KEY"] is False


def test_a_setting_that_there_is_not_is_told_the_nearest(home: Home) -> None:
    ended = home.adaptbot("config", "modell", "--json")
    assert ended.code == 2 and ended.json()["error"]["remedy"] == "did you mean model?"
