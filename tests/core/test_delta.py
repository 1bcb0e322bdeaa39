"""A line of changes: whatever is taken, gone back on and read, the store holds what it should."""

import sys
from types import FrameType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import Literal, URIRef

from adaptbot_cli.core.graph.delta import Delta, UndoLog
from adaptbot_cli.core.graph.terms import Triple


def triple(number: int) -> Triple:
    return URIRef(f"urn:s{number}"), URIRef("urn:p"), Literal(number)


class Held:
    """A store that refuses what a real one would silently do twice."""

    def __init__(self) -> None:
        self.triples: set[Triple] = set()
        self.writes = 0

    def write(self, delta: Delta) -> None:
        assert delta.removed <= self.triples
        assert not delta.added & self.triples
        self.triples = (self.triples - delta.removed) | delta.added
        self.writes += 1


def toggled(held: set[Triple], numbers: set[int]) -> Delta:
    """A change that is right for what is held now."""
    about = {triple(n) for n in numbers}
    return Delta(frozenset(about & held), frozenset(about - held))


MOVES = st.lists(
    st.one_of(
        st.tuples(st.just("take"), st.sets(st.integers(0, 4), min_size=1)),
        st.tuples(st.just("back"), st.integers(0, 8)),
        st.tuples(st.just("read"), st.none()),
        st.tuples(st.just("keep"), st.none()),
    )
)


@given(MOVES)
def test_what_is_read_is_what_the_line_comes_to(moves: list) -> None:
    store = Held()
    log = UndoLog(store.write)
    past: list[set[Triple]] = [set()]
    for move, value in moves:
        if move == "take":
            delta = toggled(past[-1], value)
            log.append(delta)
            past.append((past[-1] - delta.removed) | delta.added)
        elif move == "back":
            log.back_to(value)
            del past[value + 1 :]
        elif move == "keep":
            log.keep()
            past = past[-1:]
        else:
            log.settle()
            assert store.triples == past[-1]
    log.settle()
    assert store.triples == past[-1]


def test_the_same_changes_lead_to_the_same_state_and_are_not_written_again() -> None:
    store = Held()
    log = UndoLog(store.write)
    one, two = toggled(set(), {1}), toggled({triple(1)}, {2})
    log.append(one)
    log.append(two)
    log.settle()
    there = log.state
    log.back_to(0)
    assert log.state != there
    log.append(one)
    log.append(two)
    log.settle()
    assert log.state == there
    assert store.writes == 2


def test_states_never_share_a_number_even_after_what_was_kept() -> None:
    log = UndoLog(Held().write)
    seen = {log.state}
    for number in range(4):
        log.append(toggled(set(), {number}))
        log.keep()
        assert log.state not in seen
        seen.add(log.state)


class Engine:
    """A store as the real one is: what it holds is added once, what it lacks is removed in vain."""

    def __init__(self) -> None:
        self.triples: set[Triple] = set()

    def write(self, delta: Delta) -> None:
        for each in sorted(delta.removed):
            self.triples.discard(each)
        for each in sorted(delta.added):
            self.triples.add(each)


def interrupted(log: UndoLog, at: int) -> bool:
    """Settle, with Ctrl-C before the line of code `at` is run; whether it came to that."""
    left = at

    def trace(frame: FrameType, event: str, told: Any) -> Any:
        nonlocal left
        if frame.f_code.co_filename == __file__ or frame.f_code.co_name == "settle":
            if event == "line":
                left -= 1
                if left == 0:
                    raise KeyboardInterrupt
            return trace
        return None

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        log.settle()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


@pytest.mark.parametrize("then", ["on", "back", "other"])
def test_ctrl_c_between_any_two_steps_of_writing_loses_nothing(then: str) -> None:
    first = Delta(added=frozenset({triple(1), triple(2)}))
    taken = Delta(frozenset({triple(2)}), frozenset({triple(3), triple(4)}))
    later = Delta(frozenset({triple(1)}), frozenset({triple(2)}))
    at, stopped = 0, True
    while stopped:
        at += 1
        store = Engine()
        log = UndoLog(store.write)
        log.append(first)
        log.append(taken)
        log.settle()
        log.back_to(1)
        log.append(Delta(frozenset({triple(1)})))
        stopped = interrupted(log, at)
        log.back_to({"on": 2, "back": 0, "other": 1}[then])
        if then == "other":
            log.append(taken)
            log.append(later)
        log.settle()
        expected = {"on": {2}, "back": set(), "other": {2, 3, 4}}[then]
        assert store.triples == {triple(n) for n in expected}, at
    assert at > 20
