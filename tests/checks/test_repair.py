"""A suggested repair, applied, makes the proof pass."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from specc.analysis.definite_assignment import always_present
from specc.lang import evaluate, show
from specc.model.expr import TRUE, Expr
from specc.model.fsm import OTHERWISE, Condition, Trace, Transition
from specc.model.system import Subsystem
from specc.model.wires import Wires
from specc.pipeline import compile_spec
from specc.proof import Prover, RowVerdict
from specc.proof.witness import opposite
from specc.resolve.machine import none_of
from tests.checks.conditions import HERE, condition, machine, worlds
from tests.checks.texts import condition as typed
from tests.checks.texts import prove, solved
from tests.seeds import Seeds, blocks, every

CASES = Path(__file__).resolve().parents[1] / "cases" / "machines"
ROW = re.compile(r"the row `\[(\w+), (\w+), (\w+), \.\.\.\]`")
MOST_REPAIRS = 40
WORLDS = list(worlds())
NO_OTHER = Condition(OTHERWISE, "initial", TRUE, "", Trace(), HERE)


def verdict_of(subsystem: Subsystem) -> RowVerdict:
    return Prover(subsystem, {}).prove_rows("S", "terminal")


def repaired(subsystem: Subsystem, of: str = "either") -> Subsystem:
    """The subsystem after one suggested repair."""
    verdict = verdict_of(subsystem)
    rows = list(subsystem.transitions)
    witness = verdict.decision.overlap or (verdict.decision.gap if of == "either" else None)
    assert witness
    if not witness.holding:
        rows.append(otherwise(rows, Transition("S", "terminal", NO_OTHER, "S", Trace(), HERE)))
    elif witness.repair is None or witness.repaired is None:
        rows.remove(rows[witness.holding[-1]])
    else:
        asked = Condition(f"repair_{len(rows)}", "initial", witness.repair, "", Trace(), HERE)
        rows[witness.repaired] = replace(rows[witness.repaired], condition=asked)
    return replace(subsystem, transitions=tuple(rows))


def otherwise(others: Sequence[Transition], row: Transition) -> Transition:
    """A row for where no other one applies."""
    when = none_of([other.condition.when for other in others])
    return replace(row, condition=replace(NO_OTHER, when=when), is_otherwise=True)


@pytest.mark.parametrize("seeds", blocks(range(15), also=range(15, 40), long=80, each=40))
def test_repairs_end_in_a_proof(seeds: Seeds) -> None:
    for seed in seeds:
        repairs_end_in_a_proof(seed)


def repairs_end_in_a_proof(seed: int) -> None:
    rng = random.Random(seed)
    rows = [condition(rng, 2, {}) for _ in range(rng.randint(1, 3))]
    subsystem = machine(rows, terminal=condition(rng, 1, {}), axioms=(condition(rng, 1, {}),))
    for _ in range(MOST_REPAIRS):
        if verdict_of(subsystem).proved:
            return
        subsystem = repaired(subsystem)
    raise AssertionError("the repairs do not end")


def told_of(rows: list[Expr], terminal: Expr, axiom: Expr) -> list[tuple[bool, ...]]:
    """Which rows hold in each world in which the state ends and the axiom holds."""
    there = [world for world in WORLDS if evaluate(terminal, world) and evaluate(axiom, world)]
    return [tuple(bool(evaluate(row, world)) for row in rows) for world in there]


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 10), long=12, each=24))
def test_repairs_of_overlaps_keep_rows_apart(seeds: Seeds) -> None:
    for seed in seeds:
        repairs_of_overlaps_keep_rows_apart(seed)


def repairs_of_overlaps_keep_rows_apart(seed: int) -> None:
    """No repair makes two rows ask the same, or leaves a gap, and in the end none overlap."""
    rng = random.Random(700 + seed)
    terminal, axiom = condition(rng, 1, {}), condition(rng, 1, {})
    rows = [condition(rng, 2, {}) for _ in range(rng.randint(2, 4))]
    subsystem = machine(rows, terminal=terminal, axioms=(axiom,))
    before = told_of(rows, terminal, axiom)
    for _ in range(MOST_REPAIRS):
        asked = [row.condition.when for row in subsystem.transitions]
        held = told_of(asked, terminal, axiom)
        assert list(map(any, held)) == list(map(any, before))
        if not verdict_of(subsystem).decision.overlap:
            assert not any(sum(row) > 1 for row in held)
            return
        columns = set(zip(*held, strict=True))
        subsystem = repaired(subsystem, "overlap")
        asked = [row.condition.when for row in subsystem.transitions]
        now = list(zip(*told_of(asked, terminal, axiom), strict=True))
        new = [column for column in now if column not in columns]
        assert len(new) < 2
        assert all(any(column) for column in new)
    raise AssertionError("the repairs do not end")


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 40), long=40, each=40))
def test_what_is_told_are_all_situations(seeds: Seeds) -> None:
    for seed in seeds:
        what_is_told_are_all_situations(seed)


def what_is_told_are_all_situations(seed: int) -> None:
    rng = random.Random(900 + seed)
    terminal, axiom = condition(rng, 1, {}), condition(rng, 1, {})
    rows = [condition(rng, 2, {}) for _ in range(rng.randint(1, 4))]
    decision = verdict_of(machine(rows, terminal=terminal, axioms=(axiom,))).decision
    there = [world for world in WORLDS if evaluate(terminal, world) and evaluate(axiom, world)]
    for witness, wrong in ((decision.gap, {0}), (decision.overlap, {2, 3, 4})):
        for world in there if witness else ():
            assert witness
            told = all(bool(evaluate(expr, world)) == yes for expr, yes in witness.answers)
            if witness.everywhere is not None:
                told = bool(evaluate(witness.everywhere, world))
            is_wrong = sum(bool(evaluate(row, world)) for row in rows) in wrong
            assert told == is_wrong or (witness.is_partial and is_wrong)


@pytest.mark.parametrize("seeds", blocks(range(15), also=range(15, 40), long=80, each=40))
def test_a_missing_row_is_missing_once(seeds: Seeds) -> None:
    for seed in seeds:
        a_missing_row_is_missing_once(seed)


def a_missing_row_is_missing_once(seed: int) -> None:
    rng = random.Random(100 + seed)
    subsystem = machine([condition(rng, 3, {})], terminal=condition(rng, 1, {}))
    if verdict_of(subsystem).decision.gap:
        assert verdict_of(repaired(subsystem)).proved


@pytest.mark.parametrize(
    "case", every(3, sorted(CASES.glob("E0601-*.yaml"))), ids=lambda case: case.stem
)
def test_the_row_of_the_report_makes_the_specification_pass(case: Path, tmp_path: Path) -> None:
    (finding,) = compile_spec(str(case)).diagnostics
    found = ROW.search(finding.help)
    assert found
    state, cause, name = found.groups()
    others = [r.place.route[-1] for r in finding.related if r.message.startswith("ended by")]
    lines = case.read_text(encoding="utf-8").splitlines()
    indent = " " * (len(lines[-1]) - len(lines[-1].lstrip()))
    lines += [f"{indent}- [{lacking}, {cause}, {name}, {lacking}]" for lacking in (state, *others)]
    mended = tmp_path / "mended.yaml"
    mended.write_text("\n".join(lines) + "\n", encoding="utf-8")
    result = compile_spec(str(mended))
    assert [d for d in result.diagnostics if d.severity == "error"] == []


def faulty(subsystem: Subsystem) -> Iterator[tuple[Subsystem, Transition]]:
    """The subsystem without a row, with one that always applies, and with one's opposite."""
    rows = subsystem.transitions
    for index, row in enumerate(rows):
        yield replace(subsystem, transitions=rows[:index] + rows[index + 1 :]), row
        for when in (TRUE, opposite(row.condition.when)):
            asked = Condition("seeded", "initial", when, "", Trace(), HERE)
            changed = replace(row, condition=asked)
            yield replace(subsystem, transitions=(*rows[:index], changed, *rows[index + 1 :])), row


@pytest.mark.parametrize("name", every(2, ["irp_picking", "conveyor_gate"]))
def test_repairs_of_seeded_faults_end_in_a_proof(name: str) -> None:
    system = compile_spec(f"specs/{name}.yaml").system
    assert system is not None
    constants = {constant.name: constant.value for constant in system.constants}
    for subsystem in system.subsystems:
        always = always_present(subsystem, Wires(system.agents))
        every_fault_is_repaired(subsystem, constants, always)


def every_fault_is_repaired(
    subsystem: Subsystem, constants: dict[str, Expr], always: frozenset[tuple[str, str]]
) -> None:
    """Those of each fault that is seeded in the subsystem."""
    repairs = 0
    for seeded, row in faulty(subsystem):
        for _ in range(MOST_REPAIRS):
            verdict = solved(Prover(seeded, constants, always).prove_rows(row.source, row.cause))
            if verdict.proved:
                break
            seeded = mended(seeded, verdict, row)
            repairs += 1
        else:
            raise AssertionError(f"in {subsystem.qualified_name} the repairs of {row} do not end")
    assert repairs or len(subsystem.transitions) < 2


def mended(subsystem: Subsystem, verdict: RowVerdict, at: Transition) -> Subsystem:
    """The subsystem after the suggested repair of the rows of one state and cause."""
    witness = verdict.decision.gap or verdict.decision.overlap
    assert witness
    rows = list(subsystem.transitions)
    if not witness.holding:
        rows.append(otherwise(verdict.rows, at))
    elif witness.repair is None or witness.repaired is None:
        rows.remove(verdict.rows[witness.holding[-1]])
    else:
        old = verdict.rows[witness.repaired]
        asked = Condition(f"repair_{len(rows)}", "initial", witness.repair, "", Trace(), HERE)
        rows[rows.index(old)] = replace(old, condition=asked)
    return replace(subsystem, transitions=tuple(rows))


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ("d < 1", "d >= 1.0"),
        ("size(d) < 1", "size(d) >= 1.0"),
        ("d / e < 1", "d / e >= 1.0"),
        ("n == 1", "n != 1"),
    ],
)
def test_the_opposite_of_a_comparison_is_one(asked: str, expected: str) -> None:
    other = show(opposite(typed(asked)))
    assert other == expected
    assert prove(asked, other).proved
