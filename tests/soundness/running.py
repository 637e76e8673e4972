"""Generated code of a specification, run by the real executor over a scripted plant."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import ModuleType
from typing import Any

import numpy as np
from specc_runtime.cycle import Executor
from specc_runtime.faults import AxiomViolated, Fault, StepFailed, UndecidedTransition
from specc_runtime.plant import NO_SAMPLE
from specc_runtime.records import StepRecord
from specc_runtime.subsystem import Subsystem as Generated
from specc_runtime.system import System as Built

from specc.analysis.dataflow import Ages
from specc.emit import fill_templates
from specc.lower import Proofs, lower
from specc.model.system import System
from specc.model.types import Type
from specc.pipeline import Result, compile_spec
from tests.soundness.interpreter import Failure, Interpreter, Run, Step, has_new
from tests.soundness.operators import PLAIN
from tests.soundness.specifications import MODEL, Tree, text_of
from tests.soundness.values import Chooser, for_runtime, plain

_serial = itertools.count()


def compiled(tree: Tree, folder: Path) -> Result:
    """What the compiler makes of a specification, through its text."""
    (folder / "plant.xml").write_text(MODEL, encoding="utf-8")
    (folder / "spec.yaml").write_text(text_of(tree), encoding="utf-8")
    return compile_spec(str(folder / "spec.yaml"))


def only_about_machines(result: Result) -> bool:
    """Whether nothing is wrong but what can be run all the same: tables and absent inputs."""
    errors = {d.code for d in result.diagnostics if d.code.startswith("E")}
    return result.system is not None and all(c.startswith(("E06", "E07")) for c in errors)


@contextmanager
def package(files: Mapping[str, str]) -> Iterator[dict[str, ModuleType]]:
    """The generated files as a package of a name of its own, not written anywhere."""
    name = f"random_system_{next(_serial)}"
    modules: dict[str, ModuleType] = {}
    first = ("__init__.py", "types.py")
    for path in sorted(files, key=lambda p: (p not in first, p != "__init__.py", p == "system.py")):
        full = name if path == "__init__.py" else f"{name}.{path.removesuffix('.py')}"
        module = ModuleType(full)
        module.__package__ = name
        if path == "__init__.py":
            module.__path__ = []
        sys.modules[full] = module
        exec(compile(files[path], f"{name}/{path}", "exec"), module.__dict__)
        modules[path] = module
    try:
        yield modules
    finally:
        for known in [m for m in sys.modules if m == name or m.startswith(f"{name}.")]:
            del sys.modules[known]


@contextmanager
def built(system: System, proofs: Proofs | None, ages: Ages | None = None) -> Iterator[Built]:
    """The generated system, ready to run; without proofs every check is in its code."""
    with package(fill_templates(lower(system, proofs, ages, stand_ins=True))) as modules:
        yield modules["system.py"].build("")


class Script:
    """What devices report: a value for each element and base tick, the same whenever asked."""

    def __init__(
        self, system: System, seed: str, marks: tuple[float, ...], odd: tuple[float, ...] = ()
    ) -> None:
        self.seed = seed
        self.marks = marks
        self.odd = odd
        self.types: dict[str, Type] = {
            f"{d.qualified_name}.{e.name}": e.type for d in system.devices for e in d.y
        }
        bindings = system.plant.bindings if system.plant else ()
        self.sporadic = {f"{b.device}.{b.element}" for b in bindings if b.sporadic}

    def measure(self, name: str, tick: int) -> Any:
        """The plain value of an element at a base tick."""
        rng = Random(f"{self.seed} {name} {tick}")
        return Chooser(rng, self.marks, self.odd).value(self.types[name])


class ScriptedPlant:
    """A plant that reports by a script and writes down what it is commanded."""

    def __init__(self, script: Script) -> None:
        self.script = script
        self.tick = 0
        self.commands: list[tuple[int, str, Any]] = []

    def reset(self, seed: int) -> None:
        pass

    def sample(self, name: str) -> Any:
        if name in self.script.sporadic and not has_new(name, self.tick):
            return NO_SAMPLE
        return for_runtime(self.script.measure(name, self.tick), self.script.types[name])

    def actuate(self, name: str, value: Any) -> None:
        self.commands.append((self.tick, name, plain(value)))

    def advance(self, duration_s: float) -> None:
        self.tick += 1

    def close(self) -> None:
        pass


@dataclass(slots=True)
class Recorder:
    """Collects the records of a run, with the memory at that time, as steps of the interpreter."""

    system: Built
    steps: dict[str, list[Step]]

    def __call__(self, record: StepRecord) -> None:
        machine = self.system.scheduled(record.subsystem).subsystem
        sent = tuple(sorted((name, plain(value)) for name, value in record.sent))
        self.steps[record.subsystem].append(
            Step(record.stamp, record.state, record.transition, sent, memory_of(machine))
        )


def memory_of(machine: Generated) -> tuple[tuple[str, Any], ...]:
    """Names and plain values."""
    return tuple((n, plain(getattr(machine.memory, n))) for n in type(machine.memory).__slots__)


def executed(system: Built, plant: ScriptedPlant | None, ticks: int) -> Run:
    """A run of the generated code by the executor."""
    run = Run({s.subsystem.name: [] for s in system.subsystems})
    executor = Executor(system, plant, [Recorder(system, run.steps)], inline=True)
    with np.errstate(all="ignore"):
        while executor.tick < ticks and executor.advance():
            pass
        executor.finish()
    run.failures = [failure_of(fault, system) for fault in executor.faults]
    run.commands = plant.commands if plant else []
    return run


def failure_of(fault: Fault, system: Built) -> Failure:
    """A fault in the interpreter's words."""
    kind, about = type(fault).__name__, ()
    cause = fault.__cause__ if isinstance(fault, StepFailed) else None
    if isinstance(cause, AttributeError) or str(cause).endswith("has no value"):
        kind = "Absent"
    machine = system.scheduled(fault.subsystem).subsystem
    if isinstance(fault, UndecidedTransition):
        texts = [str(row) for row in machine.transitions]
        about = tuple(str(texts.index(row)) for row in fault.rows)
    if isinstance(fault, AxiomViolated):
        about = tuple(str(i) for i in machine.violations)
    return Failure(fault.subsystem, fault.stamp, fault.state, kind, about)


def interpreted(
    system: System, script: Script, ticks: int, operators: Mapping[str, Callable[..., Any]] = PLAIN
) -> Run:
    """The same run by the interpreter."""
    return Interpreter(system, operators, script.measure).run(ticks)
