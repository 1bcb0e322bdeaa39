"""A line of changes: whatever is taken, gone back on and read, the store holds what it should."""

from hypothesis import given
from hypothesis import strategies as st
from rdflib import Literal, URIRef

from adaptbot_cli.core.delta import Delta, Line
from adaptbot_cli.core.terms import Triple


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
    line = Line(store.write)
    past: list[set[Triple]] = [set()]
    for move, value in moves:
        if move == "take":
            delta = toggled(past[-1], value)
            line.take(delta)
            past.append((past[-1] - delta.removed) | delta.added)
        elif move == "back":
            line.back_to(value)
            del past[value + 1 :]
        elif move == "keep":
            line.keep()
            past = past[-1:]
        else:
            line.settle()
            assert store.triples == past[-1]
    line.settle()
    assert store.triples == past[-1]


def test_the_same_changes_lead_to_the_same_state_and_are_not_written_again() -> None:
    store = Held()
    line = Line(store.write)
    one, two = toggled(set(), {1}), toggled({triple(1)}, {2})
    line.take(one)
    line.take(two)
    line.settle()
    there = line.state
    line.back_to(0)
    assert line.state != there
    line.take(one)
    line.take(two)
    line.settle()
    assert line.state == there
    assert store.writes == 2


def test_states_never_share_a_number_even_after_what_was_kept() -> None:
    line = Line(Held().write)
    seen = {line.state}
    for number in range(4):
        line.take(toggled(set(), {number}))
        line.keep()
        assert line.state not in seen
        seen.add(line.state)
