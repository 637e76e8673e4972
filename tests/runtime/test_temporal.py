"""Monitors against the definition: quantifiers over the whole trace, unknown after its end."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import pytest
from specc_runtime.contracts import as_any, operator
from specc_runtime.temporal import (
    FALSE,
    UNKNOWN,
    And,
    Atom,
    Formula,
    Historically,
    Judgement,
    Not,
    Once,
    Or,
    Since,
    Throughout,
    Within,
    judged,
)

from tests.seeds import blocks

Trace = Sequence[Judgement]
TIMED = {"within": Within, "throughout": Throughout, "once": Once, "historically": Historically}
JOINING = {"and": And, "or": Or, "since": Since}


@dataclass(frozen=True)
class Said:
    """A formula as it is written: an atom by its number, or an operator on formulas."""

    op: str
    operands: tuple[Said, ...] = ()
    number: int = 0
    """Of the atom, or of the ticks that the operator reaches over."""


def phrase(rng: random.Random, depth: int) -> Said:
    if depth == 0 or rng.random() < 0.15:
        return Said("atom", (), rng.randrange(3))
    op = rng.choice(["not", *TIMED, *JOINING])
    count = 2 if op in JOINING else 1
    return Said(op, tuple(phrase(rng, depth - 1) for _ in range(count)), rng.randrange(6))


def monitor(said: Said, atoms: Sequence[Atom]) -> Formula:
    if said.op == "atom":
        return atoms[said.number]
    operands = [monitor(operand, atoms) for operand in said.operands]
    if said.op == "not":
        return Not(*operands)
    if said.op in TIMED:
        return TIMED[said.op](said.number, operands[0])
    return JOINING[said.op](*operands)


def worst(found: Sequence[Judgement]) -> Judgement:
    return min(low for low, _ in found), min(high for _, high in found)


def best(found: Sequence[Judgement]) -> Judgement:
    return max(low for low, _ in found), max(high for _, high in found)


def at(said: Said, traces: Sequence[Trace], tick: int) -> Judgement:
    """What a formula says at a tick, by its definition."""
    if said.op == "atom":
        trace = traces[said.number]
        return trace[tick] if tick < len(trace) else UNKNOWN

    def of(index: int) -> Callable[[int], Judgement]:
        return lambda then: at(said.operands[index], traces, then)

    first, later, earlier = of(0), range(tick, tick + said.number + 1), range(tick + 1)
    match said.op:
        case "not":
            (low, small), (high, large) = first(tick)
            return (not high, -large), (not low, -small)
        case "and":
            return worst([first(tick), of(1)(tick)])
        case "or":
            return best([first(tick), of(1)(tick)])
        case "within":
            return best([first(then) for then in later])
        case "throughout":
            return worst([first(then) for then in later])
        case "once":
            return best([first(then) for then in earlier[-said.number - 1 :]])
        case "historically":
            return worst([first(then) for then in earlier[-said.number - 1 :]])
    held = [
        worst([of(1)(then), *(first(after) for after in range(then + 1, tick + 1))])
        for then in earlier
    ]
    return best([FALSE, *held])


def trace(rng: random.Random, length: int) -> list[Judgement]:
    """Comparisons with a margin, plain truth values and gaps; values often stay for a while."""
    values: list[Judgement] = []
    while len(values) < length:
        margin = rng.choice([-2.0, -0.5, 0.0, 0.25, 1.5])
        kinds = [UNKNOWN, judged(rng.random() < 0.5), judged(margin > 0, margin)]
        values += [rng.choice(kinds)] * rng.randint(1, 4)
    return values[:length]


def followed(said: Said, traces: Sequence[Trace]) -> list[Judgement]:
    """What a monitor says of each tick, in their order."""
    atoms = [Atom(lambda: UNKNOWN) for _ in traces]
    formula = monitor(said, atoms)
    found = []
    length = len(traces[0])
    for tick in range(length + formula.delay):
        for atom, values in zip(atoms, traces, strict=True):
            atom.now = values[tick] if tick < length else UNKNOWN
        found.append(formula.step())
    assert found[: formula.delay] == [None] * formula.delay
    return [judgement for judgement in found[formula.delay :] if judgement is not None]


@pytest.mark.parametrize("seeds", blocks(range(300), long=3000, each=1000))
def test_monitors_say_what_the_definition_says(seeds: Sequence[int]) -> None:
    for seed in seeds:
        rng = random.Random(seed)
        said = phrase(rng, rng.randint(1, 3))
        traces = [trace(rng, rng.choice([1, 12])) for _ in range(1)]
        traces += [trace(rng, len(traces[0])) for _ in range(2)]
        expected = [at(said, traces, tick) for tick in range(len(traces[0]))]
        assert followed(said, traces) == expected


def test_what_is_decided_before_the_end_stays_decided() -> None:
    """Unknown values are any values: no filling of the gaps gives another verdict."""
    rng = random.Random(5)
    for _ in range(200):
        said = phrase(rng, 3)
        traces = [trace(rng, 8) for _ in range(3)]
        filled = [[judged(rng.random() < 0.5) if v == UNKNOWN else v for v in t] for t in traces]
        for before, after in zip(followed(said, traces), followed(said, filled), strict=True):
            assert before[0] <= after[0] <= after[1] <= before[1]


class Values:
    """Nothing is there."""

    __slots__ = ("there",)


def refuses(value: object) -> object:
    """Raise an error."""
    raise TypeError(value)


refusing = operator("refuses", refuses, as_any, "any")
RAISED: dict[str, tuple[Callable[[Any], Any], bool]] = {
    "what is absent": (lambda values: values.there, True),
    "a division by zero": (lambda _: 1 / 0, True),
    "an item that is not there": (lambda _: [][0], True),
    "an operator": (lambda _: refusing(1), True),
    "an attribute that nobody reads": (lambda values: values.their, False),
    "a name that means something else": (lambda values: values(1), False),
}


@pytest.mark.parametrize("case", RAISED)
def test_only_conditions_without_a_value_are_unknown(case: str) -> None:
    """A defect of generated code is not taken for one."""
    raises, is_unknown = RAISED[case]
    atom = Atom(lambda: judged(raises(Values())), "there")
    if is_unknown:
        atom.update()
        assert atom.now == UNKNOWN
    else:
        with pytest.raises((AttributeError, TypeError)):
            atom.update()
