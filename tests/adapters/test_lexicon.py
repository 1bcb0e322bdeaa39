"""The shipped WordNet as a lexicon."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from adaptbot_cli.adapters.lexicon import TARGET, NoLexicon, WordNet, _open
from adaptbot_cli.core.words import Lexicon, Related, Sense
from adaptbot_cli.errors import LexiconError

ARTIFACT = frozenset({"noun.artifact"})
FOOD = frozenset({"noun.food"})
CONTACT = frozenset({"verb.contact"})
RELATIONS = ["synonym", "hypernym", "hyponym"]


@pytest.fixture(scope="module")
def wordnet() -> Lexicon:
    return WordNet()


def words(found: tuple[Related, ...], relation: str, distance: int, sense: int = 1) -> list[str]:
    wanted = (relation, distance, sense)
    return [r.word for r in found if (r.relation, r.distance, r.sense) == wanted]


def test_a_skillet_is_a_frying_pan_and_a_pan(wordnet: Lexicon) -> None:
    found = wordnet.related("skillet", ARTIFACT)

    assert words(found, "synonym", 0) == ["frying_pan", "frypan"]
    assert words(found, "hypernym", 1) == ["cooking_pan", "pan"]
    assert words(found, "hypernym", 2) == ["cooking_utensil", "cookware"]
    assert words(found, "hypernym", 3) == ["kitchen_utensil"]
    assert words(found, "hyponym", 1) == ["electric_frying_pan", "spider"]
    assert "skillet" not in {related.word for related in found}


def test_hyponyms_reach_two_edges_down_and_hypernyms_three_up(wordnet: Lexicon) -> None:
    found = wordnet.related("cooking utensil", ARTIFACT)

    assert "pan" in words(found, "hyponym", 1)
    assert "wok" in words(found, "hyponym", 2)
    assert max(r.distance for r in found if r.relation == "hyponym") == 2
    assert max(r.distance for r in found if r.relation == "hypernym") == 3


def test_words_come_by_sense_distance_relation_and_alphabet(wordnet: Lexicon) -> None:
    found = wordnet.related("container", ARTIFACT)

    keys = [(r.sense, r.distance, RELATIONS.index(r.relation), r.word) for r in found]
    assert keys == sorted(keys)
    assert len(set(keys)) == len(keys)


def test_sense_ranks_are_those_of_the_whole_wordnet(wordnet: Lexicon) -> None:
    # In WordNet 3.0 senses 1 to 3 of "mug" are a quantity, a gull (a person) and a face; the
    # drinking vessel is the fourth.
    found = wordnet.related("mug", ARTIFACT)

    assert {related.sense for related in found} == {4}
    assert "drinking_vessel" in words(found, "hypernym", 1, sense=4)


def test_only_words_of_the_fields_are_returned(wordnet: Lexicon) -> None:
    both = wordnet.related("chop", FOOD | CONTACT)

    assert {related.field for related in wordnet.related("chop", FOOD)} == {"noun.food"}
    assert {related.field for related in both} == {"noun.food", "verb.contact"}
    assert wordnet.related("chop", frozenset()) == ()


@pytest.mark.parametrize(
    ("inflected", "base", "field"),
    [
        ("onions", "onion", "noun.food"),
        ("loaves", "loaf", "noun.food"),
        ("knives", "knife", "noun.artifact"),
        ("wiping", "wipe", "verb.contact"),
        ("broke", "break", "verb.change"),
        ("Frying Pans", "frying_pan", "noun.artifact"),
    ],
)
def test_inflected_words_are_looked_up_by_their_base(
    wordnet: Lexicon, inflected: str, base: str, field: str
) -> None:
    fields = frozenset({field})

    assert wordnet.related(inflected, fields) == wordnet.related(base, fields) != ()


@pytest.mark.parametrize("name", ["frying pan", "frying-pan", "FRYING_PAN", " frying  pan "])
def test_a_name_may_be_joined_in_any_way(wordnet: Lexicon, name: str) -> None:
    assert wordnet.related(name, ARTIFACT) == wordnet.related("frying_pan", ARTIFACT)


def test_wordnet_joins_some_names_with_a_hyphen_or_not_at_all(wordnet: Lexicon) -> None:
    assert "jersey" in words(wordnet.related("t_shirt", ARTIFACT), "synonym", 0)
    assert wordnet.related("tooth-brush", ARTIFACT) == wordnet.related("toothbrush", ARTIFACT) != ()


@pytest.mark.parametrize("word", ["zorblax", "", " ", "blue skillet", "garbage_bag", "crêpe", "_"])
def test_an_unknown_word_has_no_related_ones(wordnet: Lexicon, word: str) -> None:
    assert wordnet.related(word, ARTIFACT | FOOD | CONTACT) == ()


def test_the_stand_in_for_omitted_senses_never_shows(wordnet: Lexicon) -> None:
    fields = frozenset({"omitted", "noun.artifact", "noun.body"})

    assert all(related.field != "omitted" for related in wordnet.related("hand", fields))
    assert wordnet.related("omitted_sense", fields) == ()


def test_glosses_are_short_and_tell_senses_apart(wordnet: Lexicon) -> None:
    found = wordnet.related("skillet", ARTIFACT)

    assert next(r.gloss for r in found if r.word == "spider") == "a skillet made of cast iron"
    assert max(len(related.gloss) for related in wordnet.related("tool", ARTIFACT)) <= 60


def test_the_senses_of_a_word_are_those_that_nltk_reads(wordnet: Lexicon) -> None:
    reader = _open(TARGET)
    lemmas = sorted(set(reader.all_lemma_names()))[::150]  # type: ignore[attr-defined]
    inflected = [lemma + end for lemma in lemmas for end in ("", "s", "es", "ed", "ing", "men")]
    odd = [line.split()[0] for line in (TARGET / "verb.exc").read_text().splitlines()[::20]]

    for word in (*inflected, *odd, "knives", "loaves", "women", "", " ", "omitted_sense"):
        theirs = [Sense(s.form, s.synset.lexname()) for s in reader.senses(word)]
        assert wordnet.senses(word) == tuple(dict.fromkeys(theirs)), word


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LexiconError, match="Cannot read .*CHECKSUMS"):
        WordNet(tmp_path).related("skillet", ARTIFACT)


@pytest.mark.parametrize("name", ["lexnames", "index.noun", "data.noun", "verb.exc", "CHECKSUMS"])
def test_a_damaged_file_is_an_error(tmp_path: Path, name: str) -> None:
    folder = shutil.copytree(TARGET, tmp_path / "wordnet")
    content = (folder / name).read_bytes()
    (folder / name).write_bytes(content[: len(content) // 2])

    with pytest.raises(LexiconError, match=r"is damaged|Cannot read"):
        WordNet(folder).related("skillet", ARTIFACT)


def test_files_may_be_hard_links_group_writable_and_end_lines_with_crlf(tmp_path: Path) -> None:
    folder = shutil.copytree(TARGET, tmp_path / "wordnet")
    data = folder / "data.noun"
    data.write_bytes(data.read_bytes().replace(b"\n", b"\r\n"))
    os.link(data, tmp_path / "another name")
    data.chmod(0o664)

    found = WordNet(folder).related("skillet", ARTIFACT)

    assert words(found, "synonym", 0) == ["frying_pan", "frypan"]


FRESH = """
import sys

def refuse(event, arguments):
    if event.startswith("socket."):
        raise RuntimeError(f"network: {event}")

sys.addaudithook(refuse)
from adaptbot_cli.adapters.lexicon import TARGET, WordNet
lexicon = WordNet()
assert lexicon.senses("skillets")
assert not any(name.partition(".")[0] == "nltk" for name in sys.modules)
found = lexicon.related("skillet", frozenset({"noun.artifact"}))
import nltk.data
assert not any(TARGET.is_relative_to(folder) for folder in nltk.data.path), nltk.data.path
print(found[0].word)
"""


def test_a_fresh_process_needs_no_network_no_configuration_and_warns_of_nothing(
    tmp_path: Path,
) -> None:
    nowhere = {"HOME": str(tmp_path), "NLTK_DATA": str(tmp_path / "none")}
    path = os.pathsep.join(sys.path)

    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", FRESH],
        env={**os.environ, **nowhere, "PYTHONPATH": path},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )

    assert (done.returncode, done.stdout, done.stderr) == (0, "frying_pan\n", "")


def test_no_lexicon_knows_nothing() -> None:
    lexicon: Lexicon = NoLexicon()

    assert lexicon.related("skillet", ARTIFACT) == ()


def test_answers_are_kept_for_the_next_process_and_damage_to_them_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    code = (
        "import sys; from adaptbot_cli.adapters.lexicon import WordNet;"
        "print(WordNet().related('skillet', frozenset({'noun.artifact'})), 'nltk' in sys.modules)"
    )

    def asked() -> str:
        return subprocess.run(
            [sys.executable, "-c", code], capture_output=True, check=True, text=True
        ).stdout

    first = asked()
    assert "pan" in first and first.endswith("True\n")
    assert asked() == first.replace("True\n", "False\n")
    (kept,) = (tmp_path / "adaptbot" / "words").iterdir()
    for content in (b"", b"\xff", b"[1]", b'{"skillet noun.artifact": [[1]]}', b"{"):
        kept.write_bytes(content)
        assert asked() == first
