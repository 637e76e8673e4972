"""Compares random systems with a slow interpreter, and looks for faults that proofs exclude.

Records: random specifications are compiled and run by the executor, with all checks and as proved,
and by the interpreter of tests/soundness; states, rows, outputs, memory, freshness and faults have
to be the same. Steps: accepted specifications, random ones and those of the project, are lowered
with nothing proved, so that every check is there, and step on random inputs that satisfy the
assumptions; no step may find no row or several, or read an input without a value.

    python bench/soundness.py --specs 300 --steps 100000 --seed 1
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import perf_counter

from specc.pipeline import Result, compile_spec
from tests.soundness.law import compare
from tests.soundness.open_inputs import Findings, tried
from tests.soundness.running import compiled
from tests.soundness.smaller import smaller
from tests.soundness.specifications import Tree, specification, text_of
from tests.soundness.values import EXTREMES, NASTY

ROOT = Path(__file__).parents[1]
WRITTEN = (
    "specs/*.yaml",
    "specs/skeletons/*/*.yaml",
    "tests/cases/*/ok-*.yaml",
    "bench/specs/*.yaml",
)
TICKS = 60
STEPS_OF_A_RANDOM_ONE = 500


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was found; 1 if anything was."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--specs", type=int, default=60, help="random specifications to compare")
    parser.add_argument("--steps", type=int, default=20_000, help="steps of accepted ones")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    parser.add_argument("--keep", type=Path, help="folder for specifications that fail")
    options = parser.parse_args(arguments)
    with TemporaryDirectory(prefix="specc-soundness-") as scratch:
        found = records(options.specs, options.seed, Path(scratch), options.keep)
        found += steps(options.steps, options.seed, Path(scratch))
    for fault in found:
        print(fault, file=sys.stderr)
    return 1 if found else 0


def records(count: int, seed: int, folder: Path, keep: Path | None) -> list[str]:
    """Compare random systems with the interpreter; what differs, in words."""
    counts: Counter[str] = Counter()
    found, begin = [], perf_counter()
    for number in range(count):
        name = f"{seed}.{number}"
        tree = specification(Random(name))
        try:
            verdict = compare(tree, folder, name, TICKS, odd=NASTY)
        except Exception as error:  # noqa: BLE001  # whatever it is, it is a finding
            found.append(f"specification {name}: {type(error).__name__}: {error}")
            continue
        counts["accepted"] += verdict.accepted
        counts["rejected but run"] += verdict.usable and not verdict.accepted
        counts["steps"] += verdict.steps
        counts.update({f"faults {kind}": n for kind, n in verdict.faults.items()})
        wrong = verdict.differences + verdict.unsound
        counts["wrong"] += bool(wrong)
        if wrong:
            found.append(f"specification {name}: {wrong[0]}")
            _kept(tree, name, folder, keep)
    said = ", ".join(f"{n} {what}" for what, n in sorted(counts.items()))
    print(f"records: {count} random specifications in {perf_counter() - begin:.0f} s: {said}")
    return found


def _kept(tree: Tree, name: str, folder: Path, keep: Path | None) -> None:
    """Write a specification that fails into a file, as small as it will go."""
    if keep is None:
        return

    def fails(candidate: Tree) -> bool:
        try:
            verdict = compare(candidate, folder, name, TICKS, odd=NASTY)
        except (KeyError, SyntaxError, TypeError):  # something is left out that it needs
            return False
        return bool(verdict.differences or verdict.unsound)

    keep.mkdir(parents=True, exist_ok=True)
    (keep / f"{name}.yaml").write_text(text_of(smaller(tree, fails)), encoding="utf-8")


def steps(count: int, seed: int, folder: Path) -> list[str]:
    """Step accepted specifications on random inputs; the faults that must not be."""
    begin = perf_counter()
    written, random = Findings(), Findings()
    systems, without_python = list(_written()), 0
    for number, result in enumerate(systems):
        goal = count // 2 * (number + 1) // len(systems)
        try:
            tried(result, f"{seed}", goal - written.steps, written, odd=EXTREMES)
        except ModuleNotFoundError:  # a case that names classes of a module that nobody wrote
            without_python += 1
    number = 0
    while random.steps < count - written.steps:
        name = f"{seed}.{number}"
        number += 1
        compiled = _compiled(specification(Random(name)), folder, random, name)
        if compiled is not None and compiled.ok and compiled.system is not None:
            left = count - written.steps - random.steps
            tried(compiled, name, min(STEPS_OF_A_RANDOM_ONE, left), random, odd=EXTREMES)
    print(f"steps: {written.steps + random.steps} in {perf_counter() - begin:.0f} s")
    print(f"  {without_python} of {len(systems)} written systems left out: no Python classes")
    for what, findings in (("written", written), ("random", random)):
        print(
            f"  {findings.steps} of {findings.systems} {what} systems in {findings.runs} runs, "
            f"{findings.visited} of {findings.states} states and {findings.rows_taken} of "
            f"{findings.rows} rows taken, {len(findings.faults)} faults; {dict(findings.ended)}"
        )
    return [*written.faults, *random.faults]


def _compiled(tree: Tree, folder: Path, findings: Findings, name: str) -> Result | None:
    """What the compiler makes of a specification; an exception is a fault."""
    try:
        return compiled(tree, folder)
    except Exception as error:  # noqa: BLE001  # whatever it is, it is a finding
        findings.faults.append(f"specification {name}: {type(error).__name__}: {error}")
        return None


def _written() -> Iterator[Result]:
    """The accepted specifications of the project."""
    for pattern in WRITTEN:
        for path in sorted(ROOT.glob(pattern)):
            result = compile_spec(str(path))
            if result.ok and result.system is not None:
                yield result


if __name__ == "__main__":
    sys.exit(main())
