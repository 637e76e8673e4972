"""What the compiler says and generates of machines with modes, held against their interpreter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from itertools import zip_longest
from pathlib import Path
from random import Random

from specc.cli import main
from specc.pipeline import Result
from specc.pipeline import generated as generate
from tests.soundness.law import warned
from tests.soundness.modes.exploring import BUDGET, beyond, misjudged, runs_of, with_goals
from tests.soundness.modes.hierarchical import Failure, Step, Tree, Written
from tests.soundness.modes.never import claims_of, refuted
from tests.soundness.modes.recordings import package_of, record, replayed, reproduced
from tests.soundness.modes.refutations import unconfirmed
from tests.soundness.modes.scripted import (
    NAME,
    control_of,
    difference,
    generated,
    interpreted,
    script,
)
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
    if result.ok and result.broken:
        found.wrong.append(f"{seed}: accepted, but nothing is proved of {sorted(result.broken)}")
    found.counts["accepted" if result.ok else "refused"] += 1
    # A mode without the `initial` that it needs has no rows that the interpreter knows.
    return not odd and not any(d.code == "E0604" for d in errors)


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


def refused_is_refuted(tree: Tree, folder: Path, seed: str, found: Findings) -> None:
    """Law: what a finding about rows says can happen, happens in the interpreter.

    Where conditions read what may be absent, a situation may be one in which they have no value.
    """
    result = compiled(dict(tree), folder)
    reads_absent = any(d.code.startswith("E07") for d in result.diagnostics)
    if is_well_formed(result, seed, found) and not result.ok and not reads_absent:
        written = Written(control_of(tree))
        about = [d for d in result.diagnostics if d.code in ("E0601", "E0602")]
        found.counts["refutations"] += len(about)
        found.wrong += [f"{seed}: not so, {text}" for text in unconfirmed(written, about, seed)]


def never_is_never(
    tree: Tree, folder: Path, seed: str, found: Findings, runs: int = 4, periods: int = 80
) -> None:
    """Law: what findings say never happens does not happen in runs."""
    result = compiled(dict(tree), folder)
    if not is_well_formed(result, seed, found) or not result.ok:
        return
    written = Written(control_of(tree))
    claims = claims_of(result.diagnostics, written)
    found.counts["claims"] += claims.count
    for run in range(runs):
        inputs = script(Random(f"{seed} {run}"), periods)
        found.wrong += [f"{seed}: {text}" for text in refuted(written, claims, inputs)][:2]


def explored_is_all(
    tree: Tree, folder: Path, seed: str, found: Findings, runs: int = 4, periods: int = 80
) -> None:
    """Law: runs come to no other states than exploring, and violate nothing that is proved."""
    tree = with_goals(tree)
    result = compiled(dict(tree), folder)
    if not is_well_formed(result, seed, found) or not result.ok:
        return
    made = runs_of(tree, seed, runs, periods)
    for wrong, count in (beyond(result, made), misjudged(result, tree, made)):
        found.wrong += [f"{seed}: {text}" for text in wrong]
        found.counts["complete or proved"] += count


def traces_are_runs(tree: Tree, folder: Path, seed: str, found: Findings) -> None:
    """Law: the runs that exploring makes of its traces replay, and are runs of the interpreter."""
    tree = with_goals(tree)
    result = compiled(dict(tree), folder)
    if not is_well_formed(result, seed, found) or not result.ok:
        return
    spec, traces = folder / "spec.yaml", folder / f"traces {seed}"
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        main(["explore", str(spec), "--budget", str(BUDGET), "--traces", str(traces)])
    package = package_of(generate(result, str(spec), is_read=False), folder)
    for file in sorted(traces.glob("*.mcap")):
        found.counts["traces"] += 1
        wrong = [*replayed(package, folder, file), *reproduced(tree, file)]
        found.wrong += [f"{seed}: {file.name}: {text}" for text in wrong]


def recordings_replay(tree: Tree, folder: Path, seed: str, found: Findings) -> None:
    """Law: a recording replays, in real time too, and the interpreter does the same."""
    result = compiled(dict(tree), folder)
    if not is_well_formed(result, seed, found) or not result.ok:
        return
    code = generate(result, str(folder / "spec.yaml"), is_read=False, tests_all_rows=True)
    package = package_of(code, folder)
    for stalls in (0.0, 0.15):
        file = record(package, folder, Random(f"{seed} {stalls}"), 60, stalls)
        wrong = [*replayed(package, folder, file), *reproduced(tree, file)]
        found.counts["recordings"] += 1
        found.wrong += [f"{seed}: {text}" for text in wrong]


def is_excused(result: Result, failure: Failure) -> bool:
    """Whether it is said that these rows are not proved."""
    if failure.kind != "undecided" or not warned(result):
        return False
    assert result.system is not None
    subsystem = next(s for s in result.system.subsystems if s.qualified_name == NAME)
    known = subsystem.state(failure.state).behaviour.causes
    cause = failure.cause if failure.cause in known else "error"
    return not result.proofs.is_proved(NAME, failure.state, cause)


def states_of(steps: Iterator[Step | Failure]) -> set[str]:
    """The states that a run comes to."""
    return {step.state for step in steps if isinstance(step, Step)}
