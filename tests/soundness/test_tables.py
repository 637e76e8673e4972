"""Decision procedure, trying every value, and generated code agree about random tables."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from specc_runtime.buffers import lower_flags
from specc_runtime.faults import UndecidedTransition

from specc.analysis import Facts
from specc.model.expr import Expr
from specc.model.system import Subsystem, System
from specc.proof import RowVerdict, Witness
from tests.seeds import Seeds, blocks
from tests.soundness.evaluator import Absent, Situation, value
from tests.soundness.running import built, compiled
from tests.soundness.specifications import text_of
from tests.soundness.worlds import DOMAINS, Table, enabled, in_world, table, worlds

MOST_STEPS = 60


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("tables")


def judged(made: Table, folder: Path) -> tuple[System, Subsystem, RowVerdict]:
    """The subsystem of a table and what the proofs say of it."""
    result = compiled(made.tree, folder)
    errors = {d.code for d in result.diagnostics if d.code.startswith("E")}
    assert all(code.startswith(("E06", "E07")) for code in errors), text_of(made.tree)
    assert result.system is not None
    subsystem = next(s for s in result.system.subsystems if s.name == "m")
    return result.system, subsystem, Facts(result.system).of(subsystem).verdict("S0", "terminal")


def tried(subsystem: Subsystem, made: Table) -> list[tuple[Situation, list[int]]]:
    """The situations in which the state ends, with the rows that hold."""
    found = []
    for at in worlds(made):
        rows = enabled(subsystem, at)
        if rows is not None:
            found.append((at, rows))
    return found


def check(seed: int, folder: Path, counts: Counter[str]) -> None:
    rng = Random(seed)
    made = table(rng)
    system, subsystem, verdict = judged(made, folder)
    told = f"seed {seed}: {made}: {verdict.decision}"
    if not any(all(value(a.that, at) for a in subsystem.axioms) for at in worlds(made)):
        counts["axioms that cannot hold"] += 1
        return
    met = tried(subsystem, made)
    gap = any(not rows for _, rows in met)
    overlap = any(len(rows) > 1 for _, rows in met)
    decision = verdict.decision
    if decision.unknown:
        counts["unknown"] += 1
    else:
        assert (decision.gap is not None) >= gap, told
        assert (decision.overlap is not None) >= overlap, told
        counts["proved"] += verdict.proved
        counts["refuted"] += gap or overlap
        counts["refuted, and no value shows it"] += (gap, overlap) != (
            decision.gap is not None,
            decision.overlap is not None,
        )
    for witness, several in ((decision.gap, False), (decision.overlap, True)):
        if witness is not None and (overlap if several else gap):
            shows(witness, met, told)
    stepped(system, subsystem, met, rng, told)


def shows(witness: Witness, met: list[tuple[Situation, list[int]]], told: str) -> None:
    """Every situation that is as the witness says is a fault, and there is one."""
    like = [rows for at, rows in met if all(answers(e, at) == yes for e, yes in witness.answers)]
    assert like, told
    for rows in like:
        assert set(witness.holding) <= set(rows), told
        assert len(rows) != 1, told


def answers(question: Expr, at: Situation) -> bool | None:
    """The truth of a fact; None where it is about a value that is not there."""
    try:
        return bool(value(question, at))
    except Absent:
        return None


def stepped(
    system: System,
    subsystem: Subsystem,
    met: list[tuple[Situation, list[int]]],
    rng: Random,
    told: str,
) -> None:
    """Generated code takes the row that holds, or stops with those that do."""
    chosen = rng.sample(met, min(MOST_STEPS, len(met)))
    with built(system, None) as made:
        machine: Any = made.scheduled(subsystem.qualified_name).subsystem
        lower_flags(machine.x)
        if met:
            in_world(machine, met[0][0], for_machine).step()
        for at, rows in chosen:
            found = []
            try:
                found = [in_world(machine, at, for_machine).step()]
            except UndecidedTransition as fault:
                texts = [str(row) for row in machine.transitions]
                found = [texts.index(row) for row in fault.rows]
            assert found == rows, told


def for_machine(given: Any, element: str) -> Any:
    return np.array(given) if DOMAINS.get(element, ("",))[0] == "vector[2]" else given


@pytest.mark.parametrize(
    "seeds", blocks(range(2), also=[*range(2, 12), 99000040], long=10, each=20)
)
def test_random_tables(seeds: Seeds, folder: Path) -> None:
    counts: Counter[str] = Counter()
    for seed in seeds:
        check(seed, folder, counts)
    assert (counts["proved"] and counts["refuted"]) or seeds.are_fresh
