"""What `specc why` should say: runs whose live values are kept, and the tests' own evaluator."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from types import SimpleNamespace
from typing import Any
from unittest import mock

from specc_runtime import application
from specc_runtime.buffers import FRESH
from specc_runtime.loading import load_layouts, load_system
from specc_runtime.system import System as Built

from specc.lang.show import show
from specc.model import expr as m
from specc.model.fsm import OTHERWISE, Condition
from specc.model.system import Operator, Subsystem, System
from specc.model.types import File, Image, ListOf, Opaque, OptionalOf, Record, Type
from tests.commands import ROOT
from tests.soundness.evaluator import Absent, Situation, value
from tests.soundness.interpreter import Machine, constants_of
from tests.soundness.values import for_runtime, plain


@dataclass(slots=True)
class Live:
    """What a step had and did, as it was in the process of the run."""

    before: str
    inputs: dict[tuple[str, str], Any]
    fresh: frozenset[tuple[str, str]]
    memory: dict[str, Any]
    state: str = ""
    row: int | None = None
    """None where it failed."""


Lives = dict[str, list[Live]]
"""The steps of each subsystem."""


@contextmanager
def watched() -> Iterator[Lives]:
    """Has the steps kept of the run that is made inside."""
    lives: Lives = defaultdict(list)

    def load(*arguments: Any, **others: Any) -> Built:
        system = load_system(*arguments, **others)
        for scheduled in system.subsystems:
            subsystem = scheduled.subsystem
            layout = load_layouts(system)[subsystem.name]
            vars(subsystem)["step"] = _kept(subsystem, layout, lives[subsystem.name])
        return system

    with mock.patch.object(application, "load_system", load):
        yield lives


def _kept(subsystem: Any, layout: Any, lives: list[Live]) -> Callable[[], int]:
    step = subsystem.step

    def kept() -> int:
        x, memory = subsystem.x, subsystem.memory
        live = Live(
            subsystem.state if lives else "",
            {e.name: getattr(x, e.attribute) for e in layout.x if hasattr(x, e.attribute)},
            frozenset(e.name for e in layout.x if getattr(x, FRESH + e.attribute, False)),
            {e.name[0]: getattr(memory, e.attribute, None) for e in layout.memory},
        )
        lives.append(live)
        row = step()
        live.state, live.row = subsystem.state, row
        return int(row)

    return kept


class Reference:
    """The conditions of a subsystem at a step, as the tests' evaluator has them."""

    def __init__(self, system: System, subsystem: Subsystem, lives: list[Live], stamp: int) -> None:
        live = lives[stamp]
        operators = {o.name: _operator(o) for o in system.operators}
        files = {name: str(ROOT / system.file / ".." / path) for name, path in system.files}
        constants = constants_of(system, operators, subsystem.constants)
        machine = self.machine = Machine(subsystem, constants, operators, files)
        machine.state = live.before
        types = {item.name: item.type for item in subsystem.memory}
        machine.memory = {name: _plain(types[name], item) for name, item in live.memory.items()}
        self.entered = _entered(lives, stamp - 1)
        machine.periods = stamp - self.entered
        read = subsystem.inputs
        inputs = {key: _plain(read[key].type, item) for key, item in live.inputs.items()}
        self.now: Situation = machine.situation(inputs, live.fresh)

    def truths(self) -> dict[str, bool]:
        """Of what is asked, in the words in which it is told."""
        machine = self.machine
        subsystem, behaviour = machine.subsystem, machine.behaviour()
        found: dict[str, bool] = {}
        cause = ""
        for ending, condition in behaviour.endings:
            found[self._words(ending, condition)] = self._truth(condition.when)
            if self._truth(condition.when):
                cause = ending
                break
        if not cause:
            return found
        row = machine.decide(self.now)
        for index, other in subsystem.rows(machine.state, cause):
            if other.resumes and index != row:
                continue  # the same row of the file, for another state that may have been left
            found[f"row {other.label}"] = index == row
            assert other.condition.name == OTHERWISE or self._truth(other.condition.when) is (
                index == row
            )
        return found

    def _words(self, cause: str, condition: Condition) -> str:
        """How a condition is named: by the cause that rows name, if there are several."""
        subsystem = self.machine.subsystem
        around = subsystem.state(self.machine.state).modes
        modes = [m for m in subsystem.modes if m.name in around and cause in dict(m.errors)]
        is_only = cause in ("terminal", "error")
        words = f"{condition.kind} {condition.name}" if is_only else f"error {cause}"
        return f"{words} of mode {modes[0].name}" if modes else words

    def _truth(self, expr: m.Expr) -> bool:
        return bool(value(expr, self.now))

    def value(self, expr: m.Expr) -> Any:
        """Raises Absent, and what has no value."""
        return value(expr, self.now)


def _entered(lives: list[Live], last: int) -> int:
    """The stamp of the step, until the last one, that entered the state."""
    return next((i for i in range(last, 0, -1) if (lives[i].row or 0) >= 0), 0) if last > 0 else 0


def _operator(operator: Operator) -> Callable[..., Any]:
    types = [type_ for _, type_ in operator.parameters]

    def call(*values: Any) -> Any:
        given = [_back(t, v) for t, v in zip(types, values, strict=True)]
        return _plain(operator.result, _named(operator.python)(*given))

    return call


def _named(python: str) -> Any:
    module, _, name = python.partition(":")
    return getattr(import_module(module), name)


def _plain(type_: Type, value: Any) -> Any:
    """A value of generated code as a plain one; what only operators look into stays as it is."""
    match type_:
        case Image() | Opaque():
            return value
        case Record(fields=fields):
            return SimpleNamespace(**{name: _plain(t, getattr(value, name)) for name, t in fields})
        case ListOf(element=element):
            return tuple(_plain(element, item) for item in value)
        case OptionalOf(value=there):
            return None if value is None else _plain(there, value)
    return plain(value)


def _back(type_: Type, value: Any) -> Any:
    """The other way round."""
    match type_:
        case Image() | Opaque() | File():
            return value
        case Record(fields=fields, python=python):
            parts = {name: _back(t, getattr(value, name)) for name, t in fields}
            return _named(python)(**parts) if python else SimpleNamespace(**parts)
        case ListOf(element=element):
            return tuple(_back(element, item) for item in value)
        case OptionalOf(value=there):
            return None if value is None else _back(there, value)
    return for_runtime(value, type_)


def parts(subsystem: Subsystem, exprs: list[m.Expr]) -> dict[str, m.Expr]:
    """All that expressions are made of, through names of parts, and that is about no item."""
    found: dict[str, m.Expr] = {}
    inside = list(exprs)
    while inside:
        expr = inside.pop()
        if show(expr) in found:
            continue
        if not m.has_free_variable(expr) and not isinstance(expr.type, Image | Opaque | File):
            found[show(expr)] = expr
        if isinstance(expr, m.LetRef):
            inside.append(subsystem.let(expr.name).value)
        elif not isinstance(expr, m.Fresh | m.Present):
            inside += m.children(expr)
    return found


NO_VALUE = (Absent, ArithmeticError, ValueError, LookupError)
