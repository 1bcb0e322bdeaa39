"""Secrets: known ones are cut from everything, what looks like one from a provider's words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adaptbot_cli.adapters.planner.scrub import GONE, Secrets, Sieve, secrets

KEY = "sk-planted-0123456789-abcdef"


def test_secrets_are_what_variables_and_addresses_call_so() -> None:
    environ = {
        "OPENAI_API_KEY": KEY,
        "MY_TOKEN": "token-value",
        "DB_PASSWORD": "hunter2-hunter2",
        "SHORT_KEY": "none",
        "HOME": "/home/somebody",
        "MONKEY": "bananas-and-more",
    }
    found = secrets(environ, "http://me:swordfish@host/v1?sig=abcdefgh", None)
    assert set(found.values) == {
        KEY, "token-value", "hunter2-hunter2", "swordfish", "me:swordfish", "sig=abcdefgh",
    }  # fmt: skip


@pytest.mark.parametrize(
    "text",
    [
        "Incorrect API key provided: sk-proj-abc***********xyz1.",
        "Authorization: Bearer abcdefgh",
        "see https://me:swordfish@host/",
        'api_key="swordfish"',
        "x-goog-api-key: swordfish",
        "token=swordfish&x=1",
        "AIzaSyD4abcdefghijklmnopqrstuvwx12345",
    ],
)
def test_what_looks_like_a_secret_is_cut_from_a_providers_words(text: str) -> None:
    told = Secrets().detail(text)
    assert GONE in told
    for part in ("swordfish", "xyz1", "abcdefgh", "AIza"):
        assert part not in told


def test_plain_words_stay() -> None:
    text = "This model's maximum context length is 4096 tokens. However, you asked for 5000."
    assert Secrets().detail(text) == text
    assert Secrets().detail("the model `claude-haiku-4-5` does not exist").count("claude") == 1


SECRETS = Secrets(("abab", "aba"))


@given(st.lists(st.text("abc", max_size=4), max_size=12))
def test_no_piece_of_a_stream_gives_a_secret_away(pieces: list[str]) -> None:
    sieve = Sieve(SECRETS)
    shown = [sieve.let(piece) for piece in pieces]
    text = "".join([*shown, sieve.rest()])
    for value in SECRETS.values:
        assert value not in text.replace(GONE, "|")
    if not any(value in "".join(pieces) for value in SECRETS.values):
        assert text == "".join(pieces)


def test_what_cannot_become_a_secret_is_shown_at_once() -> None:
    sieve = Sieve(Secrets((KEY,)))
    assert sieve.let("pick_up(egg)") == "pick_up(egg)"
    assert sieve.let(" sk-pl") == " " and sieve.let("ate") == "sk-plate"
    assert sieve.let("s") == "" and sieve.rest() == "s"
