"""What the solver says agrees with trying values, and it is asked only where tables end."""

from __future__ import annotations

import gc
import itertools
import random
import subprocess
import sys
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from specc import pipeline
from specc.lang import Environment, evaluate
from specc.model.expr import Binary, Builtin, Compare, Expr, Logic, MemoryRef, Number, Unary
from specc.model.types import Bool, Int
from specc.proof import Prover, RowVerdict
from specc.proof.formula import atoms_of
from specc.proof.solver import Theory, solver
from tests.checks.conditions import condition, machine
from tests.checks.texts import agree, solved
from tests.compiled import anew
from tests.seeds import Seeds, blocks

ROOT = Path(__file__).resolve().parents[2]
BOOL, INT = Bool(), Int()
A, B = (MemoryRef(name, type=INT) for name in "ab")
VALUES = range(-7, 8)
"""Every threshold below is within, and sums of two of them."""
WIDE = range(-40, 41)
"""Where several of them meet is within."""


def sums(rng: random.Random) -> Expr:
    """A comparison of a small sum with a constant."""
    left: Expr = rng.choice((A, B))
    match rng.randrange(5):
        case 0:
            left = Binary("+", A, B, type=INT)
        case 1:
            left = Binary("-", A, Binary("*", Number(2, type=INT), B, type=INT), type=INT)
        case 2:
            left = Builtin("max", (A, B), type=INT)
        case 3:
            left = Builtin("abs", (A,), type=INT)
    op = rng.choice(("<", "<=", ">", ">=", "==", "!="))
    right = rng.choice((A, B, *(Number(n, type=INT) for n in range(-2, 3))))
    return Compare(op, left, right, type=BOOL)


def tree(rng: random.Random, depth: int) -> Expr:
    if depth == 0:
        return sums(rng)
    parts = tree(rng, depth - 1), tree(rng, depth - 1)
    if rng.random() < 0.25:
        return Unary("not", parts[0], type=BOOL)
    return Logic(rng.choice(("and", "or")), parts, type=BOOL)


@pytest.mark.parametrize(
    "seeds", blocks(range(2), also=[*range(2, 20), 77310443], long=16, each=30)
)
def test_verdicts_about_sums_agree_with_trying(seeds: Seeds) -> None:
    for seed in seeds:
        verdicts_about_sums_agree_with_trying(seed)


def verdicts_about_sums_agree_with_trying(seed: int) -> None:
    rng = random.Random(seed)
    rows = [tree(rng, 1) for _ in range(2)]
    rows.append(Unary("not", Logic("or", tuple(rows), type=BOOL), type=BOOL))
    rows = rows[: rng.randint(2, 3)]
    decision = verdict(*rows).decision
    told = decision.gap is not None, decision.overlap is not None
    narrow = shown(rows, VALUES)
    assert told == narrow == (True, True) or told == shown(rows, WIDE)


def verdict(*rows: Expr) -> RowVerdict:
    return solved(Prover(machine(rows), {}).prove_rows("S", "terminal"))


def shown(rows: Sequence[Expr], values: range) -> tuple[bool, bool]:
    """Whether no row holds for some of the values, and whether several do."""
    enabled = {
        sum(bool(evaluate(row, Environment(memory={"a": a, "b": b}))) for row in rows)
        for a, b in itertools.product(values, repeat=2)
    }
    return 0 in enabled, bool(enabled - {0, 1})


@pytest.mark.parametrize("seeds", blocks(range(12), also=range(12, 30), long=48, each=30))
def test_what_is_said_to_be_impossible_is(seeds: Seeds) -> None:
    for seed in seeds:
        what_is_said_to_be_impossible_is(seed)


def what_is_said_to_be_impossible_is(seed: int) -> None:
    """No values give answers that the solver says are impossible together."""
    rng = random.Random(500 + seed)
    prover = Prover(machine([sums(rng) for _ in range(4)]), {})
    rows = prover.prove_rows("S", "terminal").rows
    atoms = list(dict.fromkeys(atoms_of(prover._formula(row.condition.when) for row in rows)))
    exact = Theory(prover.numbering, atoms, exact=True)
    make = prover._translator.make
    worlds = [Environment(memory={"a": a, "b": b}) for a, b in itertools.product(VALUES, repeat=2)]
    for said in itertools.product((False, True), repeat=len(atoms)):
        answers = list(zip(map(make.atom, atoms), said, strict=True))
        model = exact.find_model(make.conjunction(f if y else make.negation(f) for f, y in answers))
        asked = [(a.expr, yes == a.holds_if) for a, yes in zip(atoms, said, strict=True)]
        assert model is not None or not any(
            all(evaluate(expr, world) == holds for expr, holds in asked if expr is not None)
            for world in worlds
        )


@pytest.mark.long
def test_what_is_known_of_a_specification_keeps_no_memory_of_the_solver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = []
    usual = solver.Theory.__init__

    def noted(theory: solver.Theory, *args: Any, **options: Any) -> None:
        usual(theory, *args, **options)
        made.append(weakref.ref(theory))

    monkeypatch.setattr(solver.Theory, "__init__", noted)
    with anew():
        result = pipeline.compile_spec(str(ROOT / "tests/cases/machines/W0606-squares.yaml"))
    gc.collect()
    assert result.ok and made
    assert not any(theory() for theory in made)


@pytest.mark.parametrize("seeds", blocks([*range(8), 44], also=range(8, 20), long=40, each=20))
def test_solver_and_tables_agree_on_facts(seeds: Seeds) -> None:
    for seed in seeds:
        solver_and_tables_agree_on_facts(seed)


def solver_and_tables_agree_on_facts(seed: int) -> None:
    rng = random.Random(3000 + seed)
    rows = [condition(rng, 2, {}) for _ in range(2)]
    known = Prover(machine(rows), {})
    assert agree(known, known.prove_rows("S", "terminal").decision, rows)


def test_many_facts_are_proved() -> None:
    facts = [MemoryRef(f"m{i}", type=BOOL) for i in range(24)]
    both = Logic("and", tuple(facts), type=BOOL)
    some_missing = Logic("or", tuple(Unary("not", f, type=BOOL) for f in facts), type=BOOL)
    assert verdict(both, some_missing).proved


@pytest.mark.long
def test_the_flagship_needs_no_solver() -> None:
    program = (
        "import sys; from specc.pipeline import compile_spec;"
        "assert not compile_spec('specs/irp_picking.yaml').diagnostics;"
        "print({'z3', 'networkx'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, check=True, capture_output=True, text=True
    )
    assert done.stdout.strip() == "set()"
