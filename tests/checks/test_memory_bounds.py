"""Memory stays within the bounds that are found for it, however often functions write it."""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

import pytest

from specc.analysis.value_ranges import MemoryBounds
from specc.lang import Environment, evaluate, expression
from specc.lang.ranges import Range
from specc.model.expr import Expr
from specc.model.fsm import Trace
from specc.model.system import Memory
from specc.model.types import Int, Real, Type
from specc.proof import Prover
from specc.source import Place
from tests.checks.conditions import machine
from tests.checks.texts import SCOPE
from tests.seeds import Seeds, blocks

TYPES: dict[str, Type] = {"n": Int(), "k": Int(), "d": Real()}
INPUTS = ("x.s.i", "x.s.j")
STEPS = 60
HUGE = f"({10**300} * {10**300})"
SMALL = range(-4, 9)
LITERALS = (*SMALL, *range(2**53 - 2, 2**53 + 4), -(2**53) - 1)
"""Of whole numbers: `evaluate` does not make floats of them beside a real, as runs do."""


def bounds(inits: dict[str, Expr], written: dict[str, list[Expr]]) -> MemoryBounds:
    memory = tuple(
        Memory(name, TYPES[name], init, "", Trace(), Place("")) for name, init in inits.items()
    )
    subsystem = replace(machine([]), memory=memory)
    values = {name: [init, *written[name]] for name, init in inits.items()}
    return MemoryBounds(subsystem, values, Prover(subsystem, {}).numbering)


def parsed(text: str, name: str) -> Expr:
    return expression(text, SCOPE, TYPES[name])


def found(*texts: str, init: str = "0", name: str = "n") -> Range:
    made = bounds({name: parsed(init, name)}, {name: [parsed(text, name) for text in texts]})
    return made.of(parsed(name, name))


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["n + 1"], (0, math.inf)),
        (["n + 1", "0"], (0, math.inf)),
        (["n - 2 + 1"], (-math.inf, 0)),
        (["min(n + 1, 3)"], (0, 3)),
        (["clamp(n - x.s.i, -7, 3)"], (-7, 3)),
        (["n + 1 if n < 1000 else n"], (0, 1000)),
        (["n + 1 if n <= 1000 else n"], (0, 1001)),
        (["n - 3 if n >= -7 else n"], (-10, 0)),
        (["0 if n >= 3 else n + 1"], (0, 3)),
        (["n + 1 if not n == 3 else 0"], (0, 3)),
        (["0 if n == 3 else n + 1"], (0, 3)),
        (["0 if n == x.s.i else n + 1"], (0, math.inf)),
        (["n + 1 if n != 3 else 0", "n + 2"], (0, math.inf)),
        (["n + 1 if n < 3 and x.s.i > 0 else n"], (0, 3)),
        (["n + 1 if not (n > 2 or x.s.i > 0) else n"], (0, 3)),
        (["n + 1 if x.s.i > 0 and 3 > n else n - 1 if n > -2 else n"], (-2, 3)),
        ([f"n + {2**53 + 1}"], (0, math.inf)),
        ([f"min(n + {HUGE}, {HUGE})"], (0, math.inf)),
        ([f"max(n - {HUGE}, -{HUGE})"], (-math.inf, 0)),
        (["x.s.i"], (-math.inf, math.inf)),
        (["x.s.i if 0 <= x.s.i and x.s.i <= 3 else n"], (-math.inf, math.inf)),  # inputs are none
    ],
)
def test_bounds_of_counters(texts: list[str], expected: Range) -> None:
    assert found(*texts) == expected


def test_a_whole_number_beside_a_real_one_may_be_rounded() -> None:
    """numpy has 2**53 + 1 <= 2.0**53, so that a counter goes on there."""
    assert found("n + 1 if n <= 3.5 else n") == (0, 4.5)
    low, high = found(f"n + 1 if n <= {2**53}.0 else n", init=str(2**53 - 1))
    assert low == 2**53 - 1 and high >= 2**53 + 2


def test_whole_numbers_become_real_in_real_memory() -> None:
    assert found("d", init=str(2**53 + 1), name="d") == (2.0**53, 2.0**53)


def value(random: Random, depth: int, names: str) -> str:
    if depth == 0 or random.random() < 0.2:
        return random.choice(
            (*names, *INPUTS, str(random.choice(SMALL if "d" in names else LITERALS)))
        )
    one, other = (value(random, depth - 1, names) for _ in "ab")
    match random.randrange(6):
        case 0:
            return f"({one} {random.choice('+-')} {random.randrange(4)})"
        case 1:
            return f"{random.choice(('min', 'max'))}({one}, {other})"
        case 2:
            return f"clamp({one}, {random.randrange(-5, 1)}, {random.randrange(1, 9)})"
        case 3:
            return f"({one} * {random.choice((-1, 1, 2))})"
        case _:
            sign = random.choice(("<", "<=", ">", ">=", *(() if "d" in names else ("==", "!="))))
            test = f"{value(random, 1, names)} {sign} {other}"
            test = random.choice(
                (test, f"not {test}", f"({test} and k > 0)", f"not ({test} or n > 3)")
            )
            return f"({one} if {test} else {value(random, 1, names)})"


@pytest.mark.parametrize("seeds", blocks(range(8), also=range(8, 30), long=120, each=300))
def test_memory_stays_within_its_bounds(seeds: Seeds) -> None:
    for seed in seeds:
        random = Random(seed)
        names = {"n": "nk", "k": "nk", "d": "nkd"}
        texts = {name: [value(random, 2, of) for _ in "ab"] for name, of in names.items()}
        written = {name: [parsed(text, name) for text in texts[name]] for name in TYPES}
        inits = {name: parsed(str(random.randrange(-2, 5)), name) for name in TYPES}
        within = bounds(inits, written)
        memory = {name: evaluate(init, Environment()) for name, init in inits.items()}
        for _ in range(STEPS):
            for name in TYPES:
                low, high = within.of(parsed(name, name))
                assert low <= memory[name] <= high, (seed, name, texts)
            inputs = {("s", name): random.randrange(-9, 10) for name in "ij"}
            now = Environment(inputs=inputs, memory=dict(memory))
            for name in random.sample(sorted(TYPES), random.randrange(4)):
                memory[name] = evaluate(random.choice(written[name]), now)
            memory["d"] = float(memory["d"])
