"""Names as people and models write them: normal forms, base forms, nearness."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from difflib import SequenceMatcher
from functools import lru_cache

_SURROGATE = re.compile("[\ud800-\udfff]")


def sound(text: str) -> str:
    """Return text in which halves of characters, which no file can hold, are marked as such."""
    return _SURROGATE.sub("\ufffd", text)


_NORMAL = re.compile(r"[a-z0-9]++(?:_[a-z0-9]++)*+")


def normal(name: str) -> str:
    """Return the name in small letters with underscores: " Cutting-Board" as cutting_board."""
    return name if _NORMAL.fullmatch(name) else _normal(name)


@lru_cache(maxsize=4096)
def _normal(name: str) -> str:
    text = sound(name).strip().lower().replace("\u2019", "'")
    return re.sub(r"[\s_\-]+", "_", text).strip("_")


def unaccented(name: str) -> str:
    """Return a name without the accents of its letters: saut\u00e9 as saute."""
    if name.isascii():
        return name
    parts = unicodedata.normalize("NFKD", sound(name))
    return unicodedata.normalize("NFC", "".join(c for c in parts if not unicodedata.combining(c)))


def folded(name: str) -> str:
    """Return a name by which spellings are compared: without accents, case and separators."""
    return normal(unaccented(name)).replace("_", "")


_CAPITAL = re.compile(r"(?<=[a-z\d])(?=[A-Z])")


def parted(name: str) -> str:
    """Return a name with its words parted that only capitals part: pickUp as pick_Up."""
    return _CAPITAL.sub("_", name)


def words(name: str) -> tuple[str, ...]:
    """Return the words of a name, in small letters."""
    return tuple(part for part in re.split(r"[^\w']+|_", normal(name)) if part)


def singulars(word: str) -> tuple[str, ...]:
    """Return what `word` could be the English plural of, likeliest first."""
    rules = (("ies", "y"), ("ves", "f"), ("ves", "fe"), ("oes", "o"), ("es", ""), ("s", ""))
    found = [word[: -len(end)] + new for end, new in rules if word.endswith(end) and len(word) > 3]
    return tuple(dict.fromkeys(form for form in reversed(found) if not word.endswith("ss")))


def without_s(name: str) -> tuple[str, ...]:
    """Return a name's words without plural or possessive "s", to compare spellings."""
    return tuple(word.removesuffix("s").removesuffix("'") for word in words(name))


def variants(name: str) -> tuple[str, ...]:
    """Return the forms under which a name may be known, the name itself first."""
    base = normal(name)
    head, _, last = base.rpartition("_")
    plurals = [f"{head}_{form}" if head else form for form in singulars(last)]
    return tuple(dict.fromkeys((sound(name), base, *plurals, base + "s")))


def nearest(name: str, known: Iterable[str], limit: int = 5, floor: float = 0.6) -> list[str]:
    """Return the known names most like `name`, best first; ties by name."""
    wanted = normal(name)
    likely = ((other, own) for other in known if _may_be_like(wanted, own := normal(other), floor))
    scored = ((_likeness(wanted, own), other) for other, own in likely)
    good = sorted((-score, other) for score, other in scored if score >= floor)
    return [other for _, other in good[:limit]]


def nearest_remedy(name: str, known: Iterable[str], otherwise: str) -> str:
    """Return the remedy for a name that is not there: the nearest one, `otherwise` if none is."""
    near = nearest(name, set(known), 1)
    return f"the nearest there is {near[0]}" if near else otherwise


def misspelt(name: str, known: Iterable[str], floor: float) -> str:
    """Return the known name that is spelt most like `name`, "" if none is; ties by name.

    Unlike `nearest` it looks at the letters only: green tea is no slip for black tea.
    """
    joined = {normal(other).replace("_", ""): other for other in sorted(known, reverse=True)}
    found = nearest(normal(name).replace("_", ""), joined, 1, floor)
    return joined[found[0]] if found else ""


def _may_be_like(one: str, other: str, floor: float) -> bool:
    """Whether two names share a word, or letters enough: what most do not is seen at once."""
    if ("_" in one or "_" in other) and not set(one.split("_")).isdisjoint(other.split("_")):
        return True
    shared = sum(map(one.__contains__, other))
    return 2 * min(shared, len(one)) >= floor * (len(one) + len(other))


def _likeness(one: str, other: str) -> float:
    shared = set(one.split("_")) & set(other.split("_"))
    if shared:
        return 0.6 + 0.4 * len(shared) / max(one.count("_") + 1, other.count("_") + 1)
    matcher = SequenceMatcher(None, one, other)
    return matcher.ratio() if matcher.quick_ratio() >= 0.5 else 0.0


def sentence_list(names: Sequence[str], limit: int = 4) -> str:
    """Join names for a sentence: "a, b and c", the rest counted."""
    shown = list(names[:limit])
    if len(names) > limit:
        shown.append(f"{len(names) - limit} more")
    if len(shown) < 2:
        return "".join(shown)
    return f"{', '.join(shown[:-1])} and {shown[-1]}"


def a(noun: str) -> str:
    """Return a noun with its article: "an ingredient"."""
    return f"{'an' if noun[:1].lower() in 'aeiou' else 'a'} {noun}"
