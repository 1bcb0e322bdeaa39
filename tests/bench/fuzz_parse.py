"""Fuzzes the parser: mutated answers must parse without an error, soundly and in time.

    python tests/bench/fuzz_parse.py --seconds 20 [--published DIR] [--seed N]

Exits with 1 and prints the text that broke a promise, if one did.
"""

import argparse
import json
import random
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.findings import CODES
from adaptbot_cli.core.parse import Vocabulary, parse
from adaptbot_cli.resources import bundled

BUILT_IN = [
    '### Plan\n```python\npick_up_obj("egg", "updated_onto.ttl") # the egg\nwait(5)\n```\nDone.',
    '1. `clean("pan")` # first\n2. `fry("egg", "pan")`\n\nIf it burns, `switch("stove")`.',
    'if is_full("sink"):\n    empty("sink")\nelse:\n    wait(t)\nput_down_obj("a", "b")\n',
    'Here: [{"action": "slice", "args": ["onion", "knife"]}, {"action": "wait", "args": [5]}]',
    '<tool_call>{"name": "fry", "arguments": {"obj": "egg"}}</tool_call>\n',
    'clean("a")\nclean("b")\nwait(1)\nwait(2)\nwait(3)\n\nRecap:\nclean("a")\nwait(1)\nwait(2)\n',
    "1. Take the egg and the pan.\n2. Put both on the stove, then turn it on.\n3. Wash them twice.",
    "> take egg 1 from fridge 1\nYou pick up the egg 1 from the fridge 1.\n> wait 1\nOK.",
    "(pick-up robot1 egg kitchen)\n(seq (put-down egg pan) (fry egg pan))",
    "- action: pick_up\n  object: egg\n- repeat: 2\n  steps:\n    - stir: pot\n",
]
PIECES = [
    "(", ")", '"', "'", "`", "```", "\n", "\r", ",", ";", "#", "//", "[", "]", "{", "}", ":", "=",
    "if x:", "else:", "for a in b:", " then ", "\\", "“", "’", "\x00", "\ud800", "é", "\u2028",
    "    ", "- ", "12. ", ".ttl", "wait(5)", 'fry("egg")', "recap:", '{"action":', "😀",
    "> ", "You see ", " them ", " twice", "(pick-up ", "Observation: ", "| a |", "- take: ", "->",
]  # fmt: skip


def cut(text: str, rng: random.Random) -> str:
    """Drop a stretch of the text."""
    start = rng.randrange(len(text) + 1)
    return text[:start] + text[start + rng.randrange(40) :]


def put(text: str, rng: random.Random) -> str:
    """Put a piece in somewhere, sometimes many times over."""
    at = rng.randrange(len(text) + 1)
    times = rng.choice([1, 1, 1, 2, 50])
    return text[:at] + rng.choice(PIECES) * times + text[at:]


def swap(text: str, rng: random.Random) -> str:
    """Shuffle the lines between two places."""
    rows = text.split("\n")
    start = rng.randrange(len(rows))
    part = rows[start : start + 5]
    rng.shuffle(part)
    return "\n".join(rows[:start] + part + rows[start + 5 :])


def double(text: str, rng: random.Random) -> str:
    """Repeat a stretch of the text."""
    start = rng.randrange(len(text) + 1)
    part = text[start : start + rng.randrange(400)]
    return text[:start] + part + part + text[start + len(part) :]


MUTATIONS: list[Callable[[str, random.Random], str]] = [cut, put, put, swap, double]


def check(text: str, words: Vocabulary) -> None:
    """Assert what holds of every text, whatever the words are."""
    start = time.process_time()
    parsed = parse(text, words)
    assert time.process_time() - start < 1 + len(text) / 1e6, "too slow"
    rows = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    places = [(written.line, written.column) for written in parsed.calls]
    for finding in parsed.findings:
        assert finding.code in CODES, finding
        assert finding.message.isprintable(), finding
        places.append((finding.line or 0, finding.column or 0))
    for line, column in places:
        assert 1 <= line <= len(rows), (line, column)
        assert 1 <= column <= len(rows[line - 1]) + 1, (line, column)
    assert parsed.calls or parsed.findings
    for written in parsed.calls:
        again = parse(written.call.render(), words).calls
        odd = not written.call.action.isidentifier() or not "".join(written.call.args).isprintable()
        assert odd or [w.call for w in again] == [written.call], written


def texts(published: Path | None) -> list[str]:
    """Load what is mutated."""
    path = published / "plans.dev.jsonl" if published else None
    if path is None or not path.exists():
        return BUILT_IN
    runs = [json.loads(row) for row in path.read_text("utf-8").splitlines()]
    trials = [trial for run in runs for trial in run["trials"].values()]
    return BUILT_IN + [answer for trial in trials for answer in trial["answers"]]


def main() -> int:
    """Run the fuzzer for the time given; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--published", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    corpus = texts(options.published)
    kitchen = Vocabulary.of(load_kg(read_files(bundled("kg") / "kitchen"), "kitchen"))
    end = time.monotonic() + options.seconds
    tried = 0
    while time.monotonic() < end:
        text = rng.choice(corpus)
        for _ in range(rng.randrange(1, 6)):
            text = rng.choice(MUTATIONS)(text, rng)
        try:
            check(text, rng.choice([Vocabulary(), kitchen]))
        except Exception as problem:
            print(f"broken after {tried} texts: {problem!r}\n{text!r}")
            return 1
        tried += 1
    print(f"{tried} texts mutated from {len(corpus)}: no promise broken (seed {options.seed})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
