"""The generated code of one subsystem by itself, stepped through scripts: the door to the runtime.

Rows are checked in every period, since nothing counts as proved; operators give what the script
says, otherwise the first value of their type.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import SkipTest

from specc_runtime.faults import UndecidedTransition
from specc_runtime.loading import load_system
from specc_runtime.stepping import Stepper, array

from specc.emit import fill_templates
from specc.lang.kinds import first_value, kind
from specc.lang.values import Fields, Value, is_close
from specc.lower import lower
from specc.lower.module import Module, PythonTypes, lag_slots, live_slots, named_types
from specc.model.system import System
from specc.model.types import Type
from specc.proof import InputName
from specc.search import OperatorAnswer
from specc.tools.witness.subject import OPERATORS, isolated_subsystem

# What a script does, period by period. Values go by the names that the specification has for them:
# `x.peer.element`, or that of memory.


ScriptValues = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Periods:
    """One period, or several that are alike.

    Attributes:
        arrives: elements that come in this period, with their values.
        stale: elements that have these values without having come in this period.
        absent: elements that are taken away.
        into: the state that the step leads to; empty in the last step, which has to decide.
        way: the row that is taken, in words.
    """

    arrives: ScriptValues
    stale: ScriptValues
    absent: tuple[str, ...] = ()
    into: str = ""
    way: str = ""
    periods: int = 1


@dataclass(frozen=True, slots=True)
class Placed:
    """What is put in place before the last step because no run was found that leads there.

    `state` and `periods` are None where the run did lead to the state, or long enough.
    """

    state: str | None
    memory: ScriptValues
    periods: int | None


@dataclass(frozen=True, slots=True)
class Script:
    """A run: steps, what is put in place, and the last step, which is to fail."""

    steps: tuple[Periods, ...]
    placed: Placed | None
    last: Periods
    answers: tuple[OperatorAnswer, ...]
    rows: tuple[str, ...] = ()
    """Rows that apply in the last step, as faults of a run name them."""


def input_text(name: InputName) -> str:
    """An input as expressions name it."""
    return f"x.{name[0]}.{name[1]}"


# Values of the language as generated code has them.


def to_runtime(value: Value, type_: Type) -> Value:
    """A value as generated code has it."""
    if type_.is_array:
        return array(value)
    return kind(type_).map_parts(type_, value, lambda part, item: to_runtime(item, part))


def from_runtime(value: Value) -> Value:
    """The value that `to_runtime` made its argument into."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (tuple, list)):
        return tuple(map(from_runtime, value))
    if isinstance(value, Fields):
        return Fields(**{name: from_runtime(inner) for name, inner in value})
    return value


# The generated code, and a run of it.


class SubsystemCode:
    """The generated code of one subsystem, with scripted results of operators.

    `system` consists of the subsystem only.
    """

    def __init__(self, system: System, subsystem: str, scratch: Path) -> None:
        """`subsystem` is a qualified name; code is generated into the directory `scratch`."""
        self.system = isolated_subsystem(system, subsystem)
        (self.subsystem,) = self.system.subsystems
        self.answers: Sequence[OperatorAnswer] = ()
        self._package = scratch / f"witness_of_{system.name}"
        types = PythonTypes(named_types(self.system))
        self.names = Module(self.system, self.subsystem, types)
        self.elements = {
            input_text(key): (self.names.inputs[key], item.type)
            for key, item in self.subsystem.inputs.items()
        }
        self.elements |= lag_slots(self.subsystem, self.names.inputs)
        self.elements |= {
            name: (slot.attribute, slot.constant.value.type)
            for name, slot in live_slots(self.system, self.subsystem).items()
        }
        self.memory = {
            item.name: (self.names.memory[item.name], item.type) for item in self.subsystem.memory
        }

    def begin(self, answers: Sequence[OperatorAnswer]) -> Run:
        """A run from the first period on, in which operators give these answers."""
        self.answers = answers
        return Run(self, Stepper(self._subsystem_class(dict(self.system.files))))

    @cached_property
    def _subsystem_class(self) -> Any:
        self._package.mkdir(parents=True, exist_ok=True)
        # Without proofs the code checks all rows while it runs.
        for name, text in fill_templates(lower(self.system, None, stand_ins=True)).items():
            (self._package / name).write_text(text, encoding="utf-8")
        with _importable(self._modules()):
            system = load_system(self._package, "")
        return type(system.scheduled(self.subsystem.qualified_name).subsystem)

    def _modules(self) -> Iterator[ModuleType]:
        """The module of the operators, and the modules of types that are not there."""
        operators = ModuleType(OPERATORS)
        for operator in self.system.operators:
            gives = partial(self._call, operator.name, operator.result)
            setattr(operators, operator.python.partition(":")[2], gives)
        yield operators
        classes: dict[str, ModuleType] = {}
        for _, type_ in named_types(self.system):
            module, _, name = getattr(type_, "python", "").partition(":")
            if name and not hasattr(sys.modules.get(module), name):
                stub = classes.setdefault(module, ModuleType(module))
                setattr(stub, name, type(name, (), {}))
        yield from classes.values()

    def _call(self, name: str, result: Type, *args: Any) -> Any:
        plain = from_runtime(args)
        for operator, known, gives in self.answers:
            if operator == name and is_close(known, plain):
                return to_runtime(gives, result)
        return to_runtime(first_value(result), result)


class Run:
    """One run of the generated code."""

    def __init__(self, code: SubsystemCode, stepper: Stepper) -> None:
        self._code = code
        self._stepper = stepper
        self._subsystem = stepper.subsystem

    @property
    def state(self) -> str:
        """The state whose functions ran last."""
        return self._subsystem.state

    @property
    def is_assumed(self) -> bool:
        """Whether all assumptions held in the last period."""
        return not self._subsystem.violations

    @property
    def memory(self) -> dict[str, Value]:
        """Values of memory, as far as it has them."""
        memory, names = self._subsystem.memory, self._code.memory
        return {
            name: from_runtime(getattr(memory, attribute))
            for name, (attribute, _) in names.items()
            if hasattr(memory, attribute)
        }

    def step(self, step: Periods) -> int:
        """One period; the row taken, or -1.

        Raises:
            SkipTest: there is no such element any more.
            Exception: what the generated code raises.
        """
        arrives, there = (self._input_values(values) for values in (step.arrives, step.stale))
        absent = [_look_up(name, self._code.elements)[0] for name in step.absent]
        self._stepper.feed(arrives, there, absent)
        return self._stepper.step()

    def place(self, placed: Placed) -> None:
        """Put a state, memory and time in place.

        Raises:
            SkipTest: there is no such state or memory any more.
        """
        if placed.state:
            methods = self._code.names.state_methods
            self._stepper.place(placed.state, _look_up(placed.state, methods))
        for name, value in placed.memory.items():
            attribute, type_ = _look_up(name, self._code.memory)
            setattr(self._subsystem.memory, attribute, to_runtime(value, type_))
        if placed.periods is not None:
            self._stepper.lasted(placed.periods)

    def absent(self, error: Exception) -> InputName | None:
        """The input without a value that was read when `error` was raised; None for others."""
        if isinstance(error, AttributeError) and error.obj is self._subsystem.x:
            attributes = self._code.names.inputs
            return next((name for name in attributes if attributes[name] == error.name), None)
        return None

    def _input_values(self, values: ScriptValues) -> dict[str, Any]:
        found = ((_look_up(name, self._code.elements), value) for name, value in values.items())
        return {attribute: to_runtime(value, type_) for (attribute, type_), value in found}


def _look_up(name: str, names: Mapping[str, Any]) -> Any:
    if name not in names:
        raise SkipTest(f"there is no {name} any more: run `specc witness` again")
    return names[name]


@contextmanager
def _importable(modules: Iterator[ModuleType]) -> Iterator[None]:
    """While some modules can be imported that are not on disk."""
    before: dict[str, ModuleType | None] = {}
    for module in modules:
        before[module.__name__] = sys.modules.get(module.__name__)
        sys.modules[module.__name__] = module
    try:
        yield
    finally:
        for name, known in before.items():
            if known is None:
                del sys.modules[name]
            else:
                sys.modules[name] = known


# Where steps lead.


class NoRunError(Exception):
    """A run does not go as wanted; the message says why."""


class AbsentError(NoRunError):
    """An input is read that has no value."""

    def __init__(self, name: InputName) -> None:
        super().__init__(f"{input_text(name)} has no value")
        self.name = name


@dataclass(frozen=True, slots=True)
class RunPosition:
    """Where steps lead: a run, the row taken last or -1, and the periods since one was taken."""

    run: Run
    row: int
    periods: int


def replay(
    code: SubsystemCode, steps: Sequence[Periods], answers: Sequence[OperatorAnswer]
) -> RunPosition:
    """Replay steps from the first period.

    Raises:
        NoRunError: not where they say.
    """
    try:
        run = code.begin(answers)
    except Exception as error:
        raise NoRunError(str(error)) from error
    row, periods = -1, -1
    for step in steps:
        for _ in range(step.periods):
            row = _row(run, step)
            periods = periods + 1 if row < 0 else 0
        if run.state != step.into:
            raise NoRunError("another state is reached")
    return RunPosition(run, row, periods)


def run_for(run: Run, step: Periods, most: int) -> int:
    """For how many periods with the inputs of a step, of at most so many, the state goes on.

    Raises:
        AbsentError: an input without a value is read.
    """
    for periods in range(most):
        try:
            if _row(run, step) >= 0:
                return periods
        except AbsentError:
            raise
        except NoRunError:
            return periods
    return most


def fault(code: SubsystemCode, script: Script) -> UndecidedTransition:
    """How the last step of a script ends if not exactly one row applies.

    Raises:
        NoRunError: exactly one does, or something else goes wrong before.
    """
    run = replay(code, script.steps, script.answers).run
    if script.placed is not None:
        run.place(script.placed)
    try:
        _row(run, script.last)
    except NoRunError as error:
        if isinstance(error.__cause__, UndecidedTransition):
            return error.__cause__
        raise
    raise NoRunError("the last step decides")


def _row(run: Run, step: Periods) -> int:
    """The row that a run takes in a step, under its assumptions."""
    try:
        row = run.step(step)
    except Exception as error:
        if run.is_assumed and (name := run.absent(error)):
            raise AbsentError(name) from error
        raise NoRunError(str(error)) from (error if run.is_assumed else None)
    if not run.is_assumed:
        raise NoRunError("an assumption does not hold")
    return row
