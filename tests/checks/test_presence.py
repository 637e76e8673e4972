"""The flow equations of presence agree with following every way through a machine."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import pairwise

import pytest

from specc.analysis.definite_assignment import Availability, DefiniteAssignment
from specc.analysis.graph import RowEdge, reachable_from
from specc.model.expr import TRUE, Choice, Expr, Fresh, Input, LetRef, Logic, Present, Unary
from specc.model.fsm import Trace, Transition
from specc.model.system import Element, Port, Subsystem
from specc.reachable import grouped
from tests.checks.conditions import BOOL, HERE, machine, named
from tests.seeds import Seeds, blocks

Names = frozenset[tuple[str, str]]
INPUTS = [("c", name) for name in "abcd"]
ALWAYS = named("always", "initial", TRUE)


def subsystem(states: int) -> Subsystem:
    """A subsystem with inputs a to d from `c` and states S0, S1, ..."""
    base = machine([TRUE])
    elements = tuple(Element(n, BOOL, None, "", Trace(), HERE) for _, n in INPUTS)
    return replace(
        base,
        ports=(Port("c", "x", elements, "a.c", HERE),),
        states=tuple(replace(base.states[0], name=f"S{i}") for i in range(states)),
        initial_state="S0",
    )


def some(rng: random.Random, chance: float) -> Names:
    return frozenset(name for name in INPUTS if rng.random() < chance)


def random_flow(seed: int) -> tuple[Subsystem, tuple[RowEdge, ...], Availability]:
    rng = random.Random(seed)
    states = rng.randint(2, 5)
    steps = tuple(
        RowEdge(
            Transition(
                f"S{rng.randrange(states)}", "terminal", ALWAYS, f"S{rng.randrange(states)}",
                Trace(), HERE,
            ),
            some(rng, 0.4),
        )
        for _ in range(rng.randint(1, 2 * states))
    )  # fmt: skip
    together = {rng.choice(INPUTS): some(rng, 0.3) for _ in range(rng.randint(0, 2))}
    for name in together:  # what comes with an element brings what comes with that
        for other in sorted(together.keys() & together[name]):
            together[name] |= together[other]
    return subsystem(states), steps, Availability(some(rng, 0.2), some(rng, 0.2), together)


def followed(steps: tuple[RowEdge, ...], arrivals: Availability) -> dict[str, Names]:
    """What is present on every way into each state, by walking all of them."""
    start = "S0", arrivals.close(arrivals.always)
    met, open_ = {start}, [start]
    while open_:
        state, present = open_.pop()
        for step in steps:
            if step.row.source == state:
                known = arrivals.close(present | arrivals.later)
                after = step.row.target, arrivals.close(known | step.ensures)
                if after not in met:
                    met.add(after)
                    open_.append(after)
    ways: dict[str, list[Names]] = {}
    for state, present in met:
        ways.setdefault(state, []).append(present)
    return {state: frozenset.intersection(*sets) for state, sets in ways.items()}


def entered(steps: tuple[RowEdge, ...]) -> frozenset[str]:
    return reachable_from("S0", grouped((step.row.source, step) for step in steps))


@pytest.mark.parametrize("seeds", blocks([*range(200), 77338642], long=400, each=200))
def test_presence_is_what_all_ways_have_in_common(seeds: Seeds) -> None:
    for seed in seeds:
        presence_is_what_all_ways_have_in_common(seed)


def presence_is_what_all_ways_have_in_common(seed: int) -> None:
    machine_, steps, arrivals = random_flow(seed)
    expected = followed(steps, arrivals)
    found = DefiniteAssignment(machine_, steps, arrivals).in_functions
    assert {state: found[state] for state in expected} == expected
    assert expected.keys() == entered(steps)


@pytest.mark.parametrize("seeds", blocks(range(200), long=400, each=200))
def test_a_way_without_an_element_is_one(seeds: Seeds) -> None:
    for seed in seeds:
        a_way_without_an_element_is_one(seed)


def a_way_without_an_element_is_one(seed: int) -> None:
    machine_, steps, arrivals = random_flow(seed)
    presence = DefiniteAssignment(machine_, steps, arrivals)
    for state in entered(steps):
        for element in set(INPUTS) - presence.in_functions[state]:
            way = presence.path_without(state, element)
            assert (way[0], way[-1]) == ("S0", state)
            for source, target in pairwise(way):
                assert any(leads(presence, s, source, target, element) for s in steps)


def leads(
    presence: DefiniteAssignment, step: RowEdge, source: str, target: str, element: tuple[str, str]
) -> bool:
    ends = step.row.source, step.row.target
    return ends == (source, target) and element not in presence.after_row(step)


A, B = (Input("c", name, type=BOOL) for name in "ab")


def fresh(element: Input) -> Expr:
    return Fresh(element, type=BOOL)


def present(element: Input) -> Expr:
    return Present(element, type=BOOL)


def negation(expr: Expr) -> Expr:
    return Unary("not", expr, type=BOOL)


def read(expr: Expr, known: Names = frozenset(), together: bool = False) -> set[str]:
    """Elements that `expr` may read in vain."""
    pairs = {("c", "a"): frozenset({("c", "b")})} if together else {}
    arrivals = Availability(frozenset(), frozenset(), pairs)
    return {
        r.input.element
        for r in DefiniteAssignment(machine([TRUE]), (), arrivals).unguarded(expr, known)
    }


@pytest.mark.parametrize(
    ("expr", "elements"),
    [
        (A, {"a"}),
        (fresh(A), set()),
        (Logic("and", (present(A), A), type=BOOL), set()),
        (Logic("and", (A, present(A)), type=BOOL), {"a"}),
        (Logic("or", (negation(fresh(A)), A), type=BOOL), set()),
        (Logic("or", (fresh(A), A), type=BOOL), {"a"}),
        (Choice(fresh(A), A, B, type=BOOL), {"b"}),
        (Choice(negation(present(A)), B, A, type=BOOL), {"b"}),
        (Logic("and", (Logic("or", (fresh(A), fresh(B)), type=BOOL), A), type=BOOL), {"a"}),
        (Logic("and", (Choice(B, fresh(A), present(A), type=BOOL), A), type=BOOL), {"b"}),
    ],
)
def test_tests_beside_a_reading_are_heeded(expr: Expr, elements: set[str]) -> None:
    assert read(expr) == elements


def test_what_is_sent_together_is_present_together() -> None:
    guarded = Logic("and", (fresh(A), B), type=BOOL)
    assert read(guarded) == {"b"}
    assert read(guarded, together=True) == set()


def test_lets_are_followed() -> None:
    lets: dict[str, Expr] = {"asked": fresh(A), "value": A}
    asked, value = (LetRef(name, type=BOOL) for name in lets)
    presence = DefiniteAssignment(
        machine([TRUE], lets=lets), (), Availability(frozenset(), frozenset())
    )
    guarded = Logic("and", (asked, value), type=BOOL)
    assert not list(presence.unguarded(guarded, frozenset()))
    (reading,) = presence.unguarded(value, frozenset())
    assert reading.let is not None
    assert reading.let.name == "value"


def test_a_let_is_followed_wherever_it_is_named() -> None:
    """Each time with something else known beside what it reads."""
    value = LetRef("value", type=BOOL)
    others = [Input("c", f"e{index}", type=BOOL) for index in range(40)]
    named_ = [Logic("and", (present(A), present(e), value), type=BOOL) for e in others]
    presence = DefiniteAssignment(
        machine([TRUE], lets={"value": A}), (), Availability(frozenset(), frozenset())
    )
    assert not list(presence.unguarded(Logic("or", tuple(named_), type=BOOL), frozenset()))
    without = Logic("and", (present(others[0]), value), type=BOOL)
    every = Logic("or", (*named_, without), type=BOOL)
    assert [r.input.key for r in presence.unguarded(every, frozenset())] == [("c", "a")]
