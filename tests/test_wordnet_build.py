"""Building the trimmed WordNet: from a made-up dictionary, and what was built for the wheel."""

import zlib
from pathlib import Path

import pytest

from adaptbot_cli.adapters.lexicon import TARGET, WordNet
from tools import wordnet as module
from tools.wordnet import FIELDS, build, main

BUDGET = 5_000_000
PACKAGE = TARGET.parents[2]
HEADER = "  1 The licence of a made-up WordNet  \n"

Line = tuple[str, str, str, str]
Index = dict[str, tuple[int, list[int]]]

# field, words, pointers, gloss; a synset's offset is its place in the list, times 100.
ENTITY, THING, TOOL, WHISK, SPEED, TAXON, GENUS, TOWER, ONION, ORCHID, HAND, TOE = range(12)
NOUNS = [
    ("noun.Tops", "entity", f"~{THING} ~{SPEED} ~{TAXON}", "all there is"),
    ("noun.Tops", "thing", f"@{ENTITY} ~{TOOL} ~{ONION} ~{ORCHID}", "a separate entity"),
    ("noun.artifact", "tool", f"@{THING} ~{WHISK} ~i{TOWER}", "an aid; used by hand"),
    ("noun.artifact", "whisk egg_whisk", f"@{TOOL} %{TOOL}", 'mixes eggs "with a whisk"; or cream'),
    ("noun.time", "whisk", f"@{ENTITY}", "a short time"),
    ("noun.group", "taxonomic_group", f"@{ENTITY} ~{GENUS}", "a group of organisms"),
    ("noun.plant", "genus_Allium", f"@{TAXON}", "onions and the like"),
    ("noun.artifact", "Great_Whisk", f"@i{TOOL}", "a monument"),
    ("noun.plant", "onion Allium_cepa", f"@{THING}", "a bulb"),
    ("noun.plant", "bee_orchid", f"@{THING}", "an orchid"),
    ("noun.body", "hand", f"@{THING}", "at the end of an arm " * 9),
    ("noun.body", "toe", f"@{THING}", "at the end of a foot"),
]
NOUN_INDEX: Index = {
    "entity": (1, [ENTITY]),
    "thing": (1, [THING]),
    "tool": (1, [TOOL]),
    # The time comes before the tool, and a taxon after it.
    "whisk": (0, [SPEED, WHISK, TAXON]),
    "egg_whisk": (0, [WHISK]),
    "taxonomic_group": (0, [TAXON]),
    "genus_allium": (0, [GENUS]),
    "great_whisk": (0, [TOWER]),
    "onion": (0, [ONION]),
    "allium_cepa": (0, [ONION]),
    "bee_orchid": (0, [ORCHID]),
    # A second sense, so that the gloss is needed.
    "hand": (1, [HAND, SPEED]),
    "toe": (0, [TOE]),
}
VERBS = [("verb.contact", "whip whisk", "", "mix by whisking"), ("verb.weather", "hail", "", "")]
VERB_INDEX: Index = {"whip": (1, [0]), "whisk": (1, [0]), "hail": (0, [1])}


def offset(place: int) -> str:
    return f"{100 * (place + 1):08d}"


def pointer(text: str, pos: str) -> str:
    symbol = text.rstrip("0123456789")
    return f"{symbol} {offset(int(text.removeprefix(symbol)))} {pos} 0000"


def data_line(place: int, pos: str, synset: Line) -> str:
    field, words, pointers, gloss = synset
    lemmas = " ".join(f"{word} 0" for word in words.split())
    related = [pointer(text, pos) for text in pointers.split()]
    count = f"{len(words.split()):02x}"
    columns = [offset(place), f"{FIELDS.index(field):02d}", pos, count, lemmas]
    return f"{' '.join([*columns, f'{len(related):03d}', *related])} | {gloss}  \n"


def index_line(lemma: str, pos: str, tagged: int, places: list[int]) -> str:
    offsets = " ".join(map(offset, places))
    return f"{lemma} {pos} {len(places)} 2 @ ~ {len(places)} {tagged} {offsets}  \n"


@pytest.fixture
def source(tmp_path: Path) -> Path:
    folder = tmp_path / "dict"
    folder.mkdir()
    write(folder, "noun", NOUNS, NOUN_INDEX)
    write(folder, "verb", VERBS, VERB_INDEX)
    write(folder, "adj", [], {})
    write(folder, "adv", [], {})
    return folder


def write(folder: Path, suffix: str, synsets: list[Line], index: Index) -> None:
    pos = suffix[0]
    data = [data_line(place, pos, synset) for place, synset in enumerate(synsets)]
    lines = [index_line(lemma, pos, *senses) for lemma, senses in index.items()]
    (folder / f"data.{suffix}").write_text(HEADER + "".join(data))
    (folder / f"index.{suffix}").write_text(HEADER + "".join(lines))
    (folder / f"{suffix}.exc").write_text("whiskses whisk\nseraphim seraph\n")


@pytest.fixture
def built(source: Path, tmp_path: Path) -> Path:
    target = tmp_path / "built"
    build(source, target)
    return target


def lemmas(folder: Path, suffix: str) -> set[str]:
    lines = (folder / f"index.{suffix}").read_text().splitlines()
    return {line.split()[0] for line in lines if not line.startswith("  ")}


def test_useful_synsets_and_their_ancestors_are_kept(built: Path) -> None:
    kept = {"entity", "thing", "tool", "whisk", "egg_whisk", "onion", "allium_cepa", "hand"}

    assert lemmas(built, "noun") == kept | {"omitted_sense"}
    assert lemmas(built, "verb") == {"whip", "whisk", "omitted_sense"}


def test_what_is_built_can_be_read_and_keeps_its_sense_numbers(built: Path) -> None:
    found = WordNet(built).related("whiskses", frozenset({"noun.artifact", "noun.time"}))

    assert [(r.word, r.relation, r.distance, r.sense) for r in found] == [
        ("egg_whisk", "synonym", 0, 2),
        ("tool", "hypernym", 1, 2),
    ]


def test_no_pointer_leads_to_what_was_left_out(built: Path) -> None:
    for suffix in ("noun", "verb"):
        text = (built / f"data.{suffix}").read_text()
        lines = [line for line in text.splitlines() if not line.startswith("  ")]
        assert all(text.index(line) == int(line[:8]) for line in lines)
        targets = {
            token
            for line in lines
            for token in line.partition("|")[0].split()[1:]
            if len(token) == 8 and token.isdigit()
        }
        assert targets <= {line[:8] for line in lines}


def test_a_gloss_is_the_first_definition_where_it_is_needed(built: Path) -> None:
    text = (built / "data.noun").read_text()
    glosses = {line.split()[4]: line.partition("|")[2].strip() for line in text.splitlines()[2:]}

    assert glosses["whisk"] == "mixes eggs"
    assert glosses["tool"] == ""
    assert glosses["hand"].startswith("at the end of an arm")
    assert glosses["hand"].endswith("...")
    assert len(glosses["hand"]) <= module.MAX_GLOSS


def test_exceptions_are_kept_for_kept_lemmas_only(built: Path) -> None:
    assert (built / "noun.exc").read_text() == "whiskses whisk\n"
    assert (built / "adj.exc").read_text() == ""


def test_building_twice_gives_the_same_bytes(source: Path, built: Path, tmp_path: Path) -> None:
    assert main([str(source), str(tmp_path / "again")]) == 0

    names = sorted(path.name for path in built.iterdir())
    for name in names:
        assert (tmp_path / "again" / name).read_bytes() == (built / name).read_bytes()
    assert len(names) == 14


def test_a_folder_that_is_no_dictionary_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"data\.noun"):
        build(tmp_path, tmp_path / "built")


def test_the_command_says_how_it_is_used(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert "SOURCE_DICT_DIR" in capsys.readouterr().err


def test_the_shipped_folder_fits_its_budget() -> None:
    files = [path for path in PACKAGE.rglob("*") if path.is_file()]

    assert sum(path.stat().st_size for path in files) <= BUDGET


def test_the_shipped_files_match_their_checksums() -> None:
    lines = (TARGET / module.CHECKSUMS).read_text().splitlines()
    sums = {name: digest for digest, name in (line.split() for line in lines)}

    for path in TARGET.iterdir():
        if path.name != module.CHECKSUMS:
            assert sums.pop(path.name) == f"{zlib.crc32(path.read_bytes()):08x}"
    assert sums == {}


def test_every_shipped_word_file_begins_with_the_licence() -> None:
    licence = (PACKAGE / "LICENSE").read_text().split()

    for suffix in module.FILES.values():
        for kind in ("data", "index"):
            head = (TARGET / f"{kind}.{suffix}").read_text("ascii").splitlines()[:29]
            words = [word for line in head for word in line.split()[1:]]
            assert words == licence
