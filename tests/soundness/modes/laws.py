"""What the compiler says and generates of machines with modes, held against their interpreter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from random import Random

from specc.pipeline import Result
from tests.soundness.law import warned
from tests.soundness.modes.hierarchical import Failure, Step, Tree
from tests.soundness.modes.scripted import NAME, difference, generated, interpreted, script
from tests.soundness.running import compiled

ABOUT_MACHINES = ("E06", "E07", "O06")
"""Codes of what can be wrong with a machine that is well formed: rows, absent values, no rows."""


@dataclass(slots=True)
class Findings:
    """What came of many specifications; `wrong` is what must not be, in words."""

    counts: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def same_steps(tree: Tree, folder: Path, seed: str, found: Findings, periods: int = 60) -> None:
    """Law: generated code does what the interpreter does, with skipped periods and without."""
    result = compiled(dict(tree), folder)
    if not is_well_formed(result, seed, found) or result.system is None:
        return
    for skips in (0.0, 0.2):
        inputs = script(Random(f"{seed} {skips}"), periods, skips)
        expected = list(interpreted(tree, inputs))
        found.counts["steps"] += len(expected)
        found.counts[f"ended {getattr(expected[-1], 'kind', 'in time')}"] += 1
        # What was proved holds for runs in which no period is skipped.
        for proofs in (None, result.proofs)[: 1 + (result.ok and not skips)]:
            steps = generated(result.system, proofs, inputs)
            for one, other in zip_longest(expected, steps):
                if wrong := difference(one, other) if one and other else "ends too early":
                    found.wrong.append(f"{seed}: {wrong}")
                    return


def is_well_formed(result: Result, seed: str, found: Findings) -> bool:
    """Whether nothing is wrong but what makes a machine undecided, or reads what is absent."""
    errors = [d for d in result.diagnostics if d.code[0] in "EO"]
    odd = [d for d in errors if not d.code.startswith(ABOUT_MACHINES)]
    found.wrong += [f"{seed}: refused, {d.code} {d.message}" for d in odd]
    found.counts["accepted" if result.ok else "refused"] += 1
    return not odd


def accepted_decides(
    tree: Tree, folder: Path, seed: str, found: Findings, runs: int = 4, periods: int = 80
) -> None:
    """Law: of an accepted machine exactly one row applies, and nothing absent is read.

    Of a refused one, runs may find why; how many do is counted.
    """
    result = compiled(dict(tree), folder)
    if not is_well_formed(result, seed, found):
        return
    ends = [
        list(interpreted(tree, script(Random(f"{seed} {run}"), periods)))[-1] for run in range(runs)
    ]
    failures = [end for end in ends if isinstance(end, Failure)]
    if not result.ok:
        found.counts["seen to fail"] += bool(failures)
    for failure in failures if result.ok else ():
        if not is_excused(result, failure):
            found.wrong.append(f"{seed}: accepted, but {failure}")


def is_excused(result: Result, failure: Failure) -> bool:
    """Whether it is said that these rows are not proved."""
    if failure.kind != "undecided" or not warned(result):
        return False
    causes = (failure.cause, "error")
    return not any(result.proofs.is_proved(NAME, failure.state, cause) for cause in causes)


def states_of(steps: Iterator[Step | Failure]) -> set[str]:
    """The states that a run comes to."""
    return {step.state for step in steps if isinstance(step, Step)}
