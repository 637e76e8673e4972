"""The law of this folder: a specification, its generated code and the interpreter say the same.

And what was accepted never comes to a state and cause of which not exactly one row holds, and never
reads an input that has no value.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from specc.model.expr import Expr, Number, walk
from specc.model.system import Subsystem, System
from specc.pipeline import Result
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Failure, Interpreter, Run
from tests.soundness.operators import PLAIN
from tests.soundness.running import (
    Script,
    ScriptedPlant,
    built,
    compiled,
    executed,
    only_about_machines,
)
from tests.soundness.specifications import Tree


@dataclass(slots=True)
class Verdict:
    """What came of one specification."""

    usable: bool = False
    """Whether it could be run; rejected for its tables or absent inputs alone is good enough."""
    accepted: bool = False
    steps: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    differences: list[str] = field(default_factory=list)
    unsound: list[str] = field(default_factory=list)


def compare(
    tree: Tree,
    folder: Path,
    seed: str,
    ticks: int,
    *,
    odd: tuple[float, ...] = (),
    interpreter: type[Interpreter] = Interpreter,
    tolerance: float = 0.0,
) -> Verdict:
    """Compile a specification and run it three times: interpreted, checked and as proved."""
    result = compiled(tree, folder)
    verdict = Verdict(accepted=result.ok)
    system = result.system
    if system is None or not only_about_machines(result):
        return verdict
    verdict.usable = True
    script = Script(system, seed, marks_of(system), odd)
    expected = interpreter(system, PLAIN, script.measure).run(ticks)
    verdict.faults.update(failure.kind for failure in expected.failures)
    if result.ok:
        verdict.unsound = [*_forbidden(result, expected), *expected.empty]
    for found in _runs(result, system, script, ticks):
        verdict.steps += sum(map(len, found.steps.values()))
        verdict.differences += differences(expected, found, tolerance=tolerance)
    return verdict


def _forbidden(result: Result, run: Run) -> Iterator[str]:
    """Faults that an accepted specification must not have, unless it was warned of them."""
    for fault in run.failures:
        if fault.kind == "Absent" or (
            fault.kind == "UndecidedTransition"
            and (_is_proved(result, fault) or not warned(result))
        ):
            yield str(fault)


def _is_proved(result: Result, fault: Failure) -> bool:
    return result.proofs.is_proved(fault.subsystem, fault.state, fault.cause)


def warned(result: Result) -> bool:
    """Whether some rows of the specification are said not to be proved."""
    return any(d.code == "W0606" for d in result.diagnostics)


def _runs(result: Result, system: System, script: Script, ticks: int) -> Iterator[Run]:
    """With all checks, and without those that were proved to be needless."""
    for proofs in (None, result.proofs)[: 1 + result.ok]:
        with built(system, proofs) as made:
            yield executed(made, ScriptedPlant(script) if made.plant else None, ticks)


def marks_of(system: System) -> tuple[float, ...]:
    """The numbers that conditions compare with, or may."""
    found = {
        float(node.value)
        for subsystem in system.subsystems
        for expr in _conditions(subsystem)
        for node in walk(expr)
        if isinstance(node, Number)
    }
    return tuple(sorted(found))


def _conditions(subsystem: Subsystem) -> Iterator[Expr]:
    yield from (condition.when for condition in subsystem.conditions)
    yield from (axiom.that for axiom in subsystem.axioms)
    yield from (item.value for item in subsystem.lets)
