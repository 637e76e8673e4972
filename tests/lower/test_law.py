"""Generated code does what the model says: random subsystems against a slow work cycle.

Poses are quarter turns with short coordinates, so that products are exact in any order of addition
and a comparison cannot come out differently by a rounding error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import strategies as st
from specc_runtime.faults import UndecidedTransition

from specc.emit import fill_templates
from specc.lang.values import compose
from specc.lower import lower
from specc.model import expr as m
from specc.model.expr import walk
from specc.model.fsm import Assignment, Behaviour, Function, State, Transition
from specc.model.system import Constant, Let, Memory, Operator, System
from specc.model.types import (
    Bool,
    Enum,
    ListOf,
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Type,
    Vector,
)
from tests.lower.models import (
    HERE,
    NO_TRACE,
    RECORDED,
    Calls,
    Known,
    condition,
    running,
    subsystem_of,
    system_of,
)
from tests.lower.reference import Key, Reference, Undecided
from tests.seeds import examples
from tests.strategies import (
    CONSTANTS,
    INPUTS,
    LETS,
    MEMORY,
    READING,
    SCOPE,
    Reading,
    conditions,
    expressions,
    lags,
    typed,
    widen,
)

OUTPUTS = {("E", "u"): typed("real[m]"), ("E", "v"): typed("vector[6, rad]")} | {
    ("c", name): typed(text)
    for name, text in {"T": "pose[B, E]", "b": "vector[6, Mode]", "ok": "bool", "n": "int"}.items()
}
EIGHTHS = st.integers(-24, 24).map(lambda n: n / 8)
TURNS = [
    tuple(tuple(float(s * (j == p)) for j in range(3)) for p, s in zip(perm, signs, strict=True))
    for perm in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
]
"""Twelve rotations whose matrices are whole numbers."""


def exact(type: Type) -> st.SearchStrategy[Any]:
    """Values on which additions and products of poses have no rounding error."""
    match type:
        case Bool():
            return st.booleans()
        case Real():
            return EIGHTHS
        case Enum():
            return st.sampled_from(type.members)
        case Vector():
            return st.tuples(*[exact(type.element)] * type.size)
        case Spatial():
            return st.tuples(*[EIGHTHS] * 6)
        case PartialOf(value=inner):
            return exact(inner)
        case ListOf():
            return st.lists(exact(type.element), max_size=2).map(tuple)
        case Record():
            return st.builds(Reading, EIGHTHS, st.sampled_from(("u", "c", "g", "s")))
        case Pose():
            return st.builds(_pose, st.sampled_from(TURNS), st.tuples(*[EIGHTHS] * 3))
    return st.integers(-3, 3)


def _pose(rows: Any, p: Any) -> Any:
    return (*((*row, x) for row, x in zip(rows, p, strict=True)), (0.0, 0.0, 0.0, 1.0))


def for_runtime(value: Any, type: Type) -> Any:
    """A plain value as the runtime has it."""
    if isinstance(type, (PartialOf, Pose, Spatial)) or (
        isinstance(type, Vector) and isinstance(type.element, Real)
    ):
        return np.array(value, dtype=float)
    return value


def plain(value: Any) -> Any:
    """A value of the runtime as a plain one."""
    if isinstance(value, np.ndarray):
        return tuple(plain(item) for item in value.tolist())
    if isinstance(value, (list, tuple)):
        return tuple(map(plain, value))
    return value


def same(a: Any, b: Any) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
        return math.isnan(b)
    return bool(a == b)


OPERATORS: dict[str, Callable[..., Any]] = {
    "widen": widen,
    "far": lambda d_m: d_m > 1.0,
    "chain": compose,
    "lift": lambda X: compose(_pose(TURNS[0], (0.0, 0.0, 0.5)), X),
    "best_reading": lambda: Reading(0.5, "c"),
}
SIMPLE: dict[str, m.Expr] = {
    "T_c": m.Input("c", "T_d", type=LETS["T_c"]),
    "ratio": m.Number(2.0, type=Real()),
    "distances": m.Items((), type=LETS["distances"]),
    "F_c": m.Input("E", "F_m", type=LETS["F_c"]),
}
"""What a let is where its own definition would come later."""
CONSTANT_VALUES: dict[str, m.Expr] = {
    "tolerance": m.Number(0.5, type=CONSTANTS["tolerance"]),
    "turn_limit": m.Number(1.5, type=CONSTANTS["turn_limit"]),
    "best": m.Call("best_reading", (), type=READING),
    "X_KB": m.Builtin("identity", (), type=CONSTANTS["X_KB"]),
}
ZERO_VALUES: dict[str, m.Expr] = {
    "q_p": m.Items((m.Number(0.0, type=MEMORY["q_p"].element),) * 6, type=MEMORY["q_p"]),
    "p": m.Items((m.Number(0.0, type=MEMORY["p"].element),) * 3, type=MEMORY["p"]),
    "push": m.Items((m.Unused(type=MEMORY["push"].value.element),) * 3, type=MEMORY["push"]),
    "count": m.Number(0, type=MEMORY["count"]),
    "X_EO": m.Builtin("identity", (), type=MEMORY["X_EO"]),
    "seen": m.Items((), type=MEMORY["seen"]),
}
FIRST = ("T_c", "ratio", "distances", "F_c")


def replaced(expr: m.Expr, keep: tuple[str, ...]) -> m.Expr:
    """`expr` with lets outside `keep` replaced by something simple of their type."""
    if isinstance(expr, m.LetRef):
        return expr if expr.name in keep else SIMPLE[expr.name]
    parts: dict[str, Any] = {}
    for name in type(expr).__slots__:
        value = getattr(expr, name)
        if isinstance(value, m.Node) and not isinstance(expr, (m.Fresh, m.Present, m.Lag)):
            parts[name] = replaced(value, keep)
        elif isinstance(value, tuple):
            parts[name] = tuple(replaced(v, keep) if isinstance(v, m.Node) else v for v in value)
    from dataclasses import replace

    return replace(expr, **parts)


@st.composite
def lets(draw: st.DrawFn) -> tuple[Let, ...]:
    return tuple(
        Let(n, replaced(draw(expressions(LETS[n], 2)), FIRST[:i]), "", NO_TRACE, HERE)
        for i, n in enumerate(FIRST)
    )


@st.composite
def behaviours(draw: st.DrawFn, name: str) -> Behaviour:
    targets = sorted(draw(st.sets(st.sampled_from(sorted(OUTPUTS)), min_size=1, max_size=3)))
    kept = sorted(draw(st.sets(st.sampled_from(sorted(MEMORY)), max_size=3)))
    made = [Assignment(*key, draw(expressions(OUTPUTS[key], 2)), NO_TRACE, HERE) for key in targets]
    made += [Assignment("", n, draw(expressions(MEMORY[n], 2)), NO_TRACE, HERE) for n in kept]
    made.sort(key=lambda a: a.target)
    function = Function(f"{name}_function", tuple(made), "", NO_TRACE, HERE)
    terminal = condition(f"{name}_ended", draw(conditions(2)), "terminal")
    error = condition(f"{name}_failed", draw(conditions(1)), "error")
    return Behaviour(name, (function,), terminal, (("error", error),), "", NO_TRACE, HERE)


def rows_of(source: str, first: m.Expr, second: m.Expr) -> Iterator[Transition]:
    """Three rows that are complete and exclude each other, for both causes."""
    neither = m.Unary("not", first, type=Bool())
    tests = (
        first,
        m.Logic("and", (neither, second), type=Bool()),
        m.Logic("and", (neither, m.Unary("not", second, type=Bool())), type=Bool()),
    )
    for cause in ("terminal", "error"):
        for test, target in zip(tests, ("a", "b", "a"), strict=True):
            yield Transition(source, cause, condition("r", test), target, NO_TRACE, HERE)


@st.composite
def systems(draw: st.DrawFn, *, decided: bool) -> System:
    found = tuple(draw(behaviours(name)) for name in "ab")
    rows = [row for name in "ab" for row in rows_of(name, draw(conditions(2)), draw(conditions(2)))]
    if not decided:
        rows = [row for row in rows if draw(st.integers(0, 5))]
    operators = (
        *SCOPE.operators.values(),
        Operator("best_reading", (), READING, "", "", NO_TRACE, HERE),
    )
    subsystem = subsystem_of(
        x=INPUTS,
        y=OUTPUTS,
        behaviours=found,
        states=tuple(State(b.name, b, "", NO_TRACE, HERE) for b in found),
        transitions=tuple(rows),
        memory=tuple(Memory(n, t, ZERO_VALUES[n], "", NO_TRACE, HERE) for n, t in MEMORY.items()),
        lets=draw(lets()),
    )
    return system_of(
        subsystem,
        operators=tuple(
            Operator(o.name, o.parameters, o.result, f"{RECORDED}:{o.name}", "", NO_TRACE, HERE)
            for o in operators
        ),
        constants=tuple(Constant(n, v, "", HERE) for n, v in CONSTANT_VALUES.items()),
    )


def wrapped(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """An operator on values of the runtime."""
    result = {"chain": Pose("", ""), "lift": Pose("", "")}.get(name, Bool())

    def on_arrays(*args: Any) -> Any:
        return for_runtime(function(*map(plain, args)), result)

    return on_arrays


def recorded(calls: Calls) -> dict[str, Callable[..., Any]]:
    def note(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*args: Any) -> Any:
            calls.append((name, args))
            return function(*args)

        return noted

    return {name: note(name, function) for name, function in OPERATORS.items()}


def feed(subsystem: Any, inputs: dict[Key, Any], fresh: set[Key]) -> None:
    for (peer, name), value in inputs.items():
        setattr(subsystem.x, f"{peer}_{name}", for_runtime(value, INPUTS[peer, name]))
        for kind, raised in (("fresh", (peer, name) in fresh), ("present", True)):
            if f"{kind}_{peer}_{name}" in subsystem.x.__slots__:
                setattr(subsystem.x, f"{kind}_{peer}_{name}", raised)
    for peer, name in INPUTS.keys() - fresh:
        if f"fresh_{peer}_{name}" in subsystem.x.__slots__:
            setattr(subsystem.x, f"fresh_{peer}_{name}", False)


def in_loops(system: System) -> bool:
    """Whether a call stands inside a quantifier, where it is made for every item."""
    subsystem = system.subsystems[0]
    roots = [let.value for let in subsystem.lets]
    roots += [a.value for b in subsystem.behaviours for a in b.assignments]
    roots += [c.when for b in subsystem.behaviours for _, c in b.endings]
    roots += [row.condition.when for row in subsystem.transitions]
    loops = [n for root in roots for n in walk(root) if isinstance(n, m.Quantifier)]
    return any(isinstance(n, m.Call) for loop in loops for n in walk(loop.body))


def distinct(calls: Calls) -> set[Any]:
    return {(name, plain(args)) for name, args in calls if not _has_nan(plain(args))}


def _has_nan(value: Any) -> bool:
    if isinstance(value, tuple):
        return any(map(_has_nan, value))
    return isinstance(value, float) and math.isnan(value)


def check(system: System, data: st.DataObject, *, proved: bool) -> None:
    text = fill_templates(lower(system, Known(proved)))["demo_m.py"]
    note(text)
    assert ":=" not in text  # assignments inside expressions are hard to follow
    functions = {name: wrapped(name, f) for name, f in OPERATORS.items()}
    generated, calls = running(system, functions, proved=proved)
    calls.clear()
    noted: Calls = []
    constants = {"tolerance": 0.5, "turn_limit": 1.5, "best": Reading(0.5, "c")}
    constants["X_KB"] = _pose(TURNS[0], (0.0, 0.0, 0.0))
    reference = Reference(system.subsystems[0], constants, recorded(noted))
    inputs: dict[Key, Any] = {}
    all_present = data.draw(st.integers(0, 3)) > 0
    for period in range(data.draw(st.integers(2, 4))):
        fresh = data.draw(st.sets(st.sampled_from(sorted(INPUTS))))
        fresh |= set(INPUTS) if period == 0 and all_present else set()
        inputs |= {key: data.draw(exact(INPUTS[key])) for key in sorted(fresh)}
        feed(generated, inputs, fresh)
        behind = data.draw(lags())
        for (kind, peer, name), value in behind.items():
            if (slot := f"{kind}_{peer}_{name}") in generated.x.__slots__:
                setattr(generated.x, slot, value)
        there = {key: value for key, value in behind.items() if key[1:] in inputs}
        try:
            expected, outputs = reference.step(inputs, fresh, there)
        except (ArithmeticError, ValueError, KeyError):
            return  # an operation that is not defined, or an element without a value
        except Undecided:
            with np.errstate(all="ignore"):
                try:
                    generated.step()
                except UndecidedTransition:
                    return
            raise AssertionError("the fault was not noticed") from None
        with np.errstate(all="ignore"):
            assert generated.step() == expected
        assert generated.state == reference.state
        for (peer, name), value in outputs.items():
            assert same(plain(getattr(generated.y, f"{peer}_{name}")), plain(value))
        for name, value in reference.memory.items():
            assert same(plain(getattr(generated.memory, name)), plain(value))
        assert distinct(calls) <= distinct(noted)  # nothing that the model does not ask for
        if not in_loops(system):
            assert len(calls) <= len(noted)
        calls.clear()
        noted.clear()


SETTINGS = settings(
    deadline=None,
    phases=(Phase.explicit, Phase.generate),  # shrinking takes minutes, the note says more
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.mark.parametrize("examples", examples(2, 12))
@pytest.mark.parametrize("proved", [True, False])
def test_proved_tables_and_those_that_are_checked_at_run_time(proved: bool, examples: int) -> None:
    @settings(SETTINGS, max_examples=examples)
    @given(systems(decided=proved), st.data())
    def holds(system: System, data: st.DataObject) -> None:
        check(system, data, proved=proved)

    holds()
