"""No field of the model is forgotten: a change of it is told, or the reason why not stands here."""

from __future__ import annotations

import dataclasses
import typing
from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

from specc.model.expr import Node, Unknown
from specc.model.fsm import Trace
from specc.model.requirement import Requirement
from specc.model.system import System
from specc.model.types import Opaque
from specc.pipeline import read_spec
from specc.tools.diff import compare
from specc.tools.diff.changes import ChangeLog
from specc.tools.diff.equivalence import Constants
from specc.tools.diff.systems import SystemDiff
from tests.tools.diff.conftest import Reader
from tests.tools.diff.test_disturbances import BLOCK, MOVE, PUSH, SHIFT, WRONG, disturbed
from tests.tools.diff.test_pairs import TEXT

ROOT = Path(__file__).resolve().parents[3]
SPECS = (
    "specs/conveyor_gate.yaml",
    "specs/architectures/reactive.yaml",
    "specs/architectures/services.yaml",
    "specs/irp_picking.yaml",
    "tests/tools/modes.yaml",
    "tests/cases/plant/ok-panel.yaml",
    "tests/cases/plant/ok-scenarios.yaml",
    "tests/cases/plant/ok-ros2-published.yaml",
    "tests/ros2/skill.yaml",
    "tests/cases/plant/ok-ros2-tf.yaml",
    "tests/cases/plant/ok-ros2-initial.yaml",
    "tests/cases/plant/ok-ros2-losses.yaml",
    "tests/cases/structure/ok-silence.yaml",
    "tests/cases/requirements/ok-contracts.yaml",
)


SCENARIO = """scenarios:
  far: {because: it is, scene: {s: "1[m]"}, expect: "within(1[s], state(cart.c) == going)"}
"""


def texts() -> Iterator[str]:
    """Systems in which fields have values; the first one is asked, then the next one."""
    counted = "let: {counted: lamp.c.runs >= 0}\nrequire:\n"
    text = TEXT.replace("TEST", "x.eye.alarm").replace("require:\n", counted)
    text = text.replace("limit: 2[m]", "limit: {is: '2[m]', range: [1, 3], live: true}")
    text = text.replace("rate: 100 Hz\n", "rate: 100 Hz\n        budget: 1 ms\n")
    text = text.replace("{idle: wait", "{idle: {behaviour: wait, holds: [y.eye.seen]}")
    yield text.replace("always(lamp.c.runs >= 0)", "always(counted)")
    noise = ', noise: "0.001[m]"'
    yield (
        disturbed(MOVE, SHIFT, PUSH, BLOCK, WRONG).replace(
            noise, f"{noise}, sporadic: true, max_gap: 50 ms"
        )
        + SCENARIO
    )


_MOST = 4
"""Parts of one system of which a field is changed: some are used by nobody."""

CALLS = "calls are compared with arguments in place of parameters"
FOLLOWS = "what it follows from is compared"
NOT_COMPARED = {
    "System.file": "two files are compared",
    "System.types": "types are compared where they are used; this has their names",
    "System.definitions": "definitions are compared where they are used",
    "System.named_in_agents": "definitions are compared where they are used",
    "System.folders": "where files lie says nothing",
    "System.stop_when": "the command line gives it for one run",
    "System.description_uses": "each use has the values in its expressions",
    "Subsystem.outside": "names of a file are compared where they are used",
    "Subsystem.has_initial_state": FOLLOWS,
    "Subsystem.idle_rows": FOLLOWS,
    "Port.interface": "its elements are compared",
    "Behaviour.is_complete": FOLLOWS,
    "Function.is_complete": FOLLOWS,
    "Behaviour.generic": CALLS,
    "Behaviour.arguments": CALLS,
    "Function.generic": CALLS,
    "Subsystem.generics": CALLS,
    "Behaviour.assignments": FOLLOWS,
    "State.modes": "the states of modes are compared",
    "State.for_modes": "the states of modes are compared, and what asks for them",
    "Transition.is_otherwise": "its condition is compared",
    "Transition.is_return": FOLLOWS,
    "Transition.source_mode": "the rows of all states are compared",
    "Transition.target_mode": "the rows of all states are compared",
    "Assignment.trace": "that of its function is told",
    "Plant.observed": "what stands behind it is compared, and its types",
    "Binding.noise_units": "the noise is compared in SI units",
    "Draw.values": "the texts that they come from are compared",
    "Widget.texts": "the values that come from them are compared",
    "Initial.expr": "the value that comes from it is compared",
    "DisturbanceAction.has_duration": FOLLOWS,
}
_PLACES = ("place",)
_OF_MODEL = "specc.model."
_NOT_HERE = ("expr", "types", "units", "requirement")
"""Expressions and types are values, as `Trace` is; formulas are compared by their text."""


def test_every_field_is_compared(read: Reader) -> None:
    forgotten = {f"{c.__name__}.{f}" for c, names in _classes(System).items() for f in names}
    forgotten -= NOT_COMPARED.keys()
    more = (read_spec(str(ROOT / spec)).system for spec in SPECS)
    for system in chain(map(read, texts()), more):
        assert system is not None
        asked: Counter[str] = Counter()
        for where, name in _fields(system, ()) if forgotten else ():
            if name in forgotten and asked[name] < _MOST:
                told = _is_told(system, where)
                asked[name] += told is not None
                forgotten -= {name} if told else set()
    assert not forgotten, ", ".join(sorted(forgotten))


def test_what_is_not_compared_is_there() -> None:
    every = {c.__name__: {f.name for f in dataclasses.fields(c)} for c in _classes(System)}
    for name in NOT_COMPARED:
        owner, _, field = name.partition(".")
        assert field in every.get(owner, ()), name


def _classes(kind: Any) -> dict[Any, list[str]]:
    """The classes of the model that are reached from one, each with its fields."""
    found: dict[Any, list[str]] = {}
    open_ = [kind]
    while open_:
        one = open_.pop()
        open_ += typing.get_args(one)
        if one in found or not _is_part(one):
            continue
        hints = typing.get_type_hints(one)
        # What is a part itself is there if its own fields are.
        fields = [
            f for f in dataclasses.fields(one) if f"{one.__name__}.{f.name}" not in NOT_COMPARED
        ]
        own = [f.name for f in fields if not _is_part(hints[f.name])]
        found[one] = [name for name in own if name not in _PLACES]
        open_ += [hints[field.name] for field in fields]
    return found


def _is_part(kind: Any) -> bool:
    module = getattr(kind, "__module__", "")
    of_model = module.startswith(_OF_MODEL) and module.removeprefix(_OF_MODEL) not in _NOT_HERE
    is_class = isinstance(kind, type) and kind is not Trace
    return of_model and is_class and dataclasses.is_dataclass(kind)


Route = tuple[str | int, ...]


def _fields(value: Any, route: Route) -> Iterator[tuple[Route, str]]:
    """Every field of a part and of what is in it, with its name in the class."""
    if isinstance(value, tuple):
        for index, one in enumerate(value):
            yield from _fields(one, (*route, index))
    if not _is_part(type(value)):
        return
    for field in dataclasses.fields(value):
        yield (*route, field.name), f"{type(value).__name__}.{field.name}"
        yield from _fields(getattr(value, field.name), (*route, field.name))


def _is_told(system: System, route: Route) -> bool | None:
    """Whether a change of a field is; None if it cannot have another value."""
    try:
        changed = _with(system, route)
        return bool(compare(system, changed).changes) and bool(compare(changed, system).changes)
    except (_SameError, IndexError):
        return None


class _SameError(Exception):
    pass


def _with(value: Any, route: Route) -> Any:
    """A value that is another one at a route."""
    if not route:
        return _other(value)
    if isinstance(value, tuple):
        assert isinstance(route[0], int)
        return (*value[: route[0]], _with(value[route[0]], route[1:]), *value[route[0] + 1 :])
    name = str(route[0])
    if not next(f for f in dataclasses.fields(value) if f.name == name).init:
        raise _SameError
    return dataclasses.replace(value, **{name: _with(getattr(value, name), route[1:])})


_WORDS = {"terminal": "error", "error": "terminal", "x": "y", "y": "x", "rgb": "depth"}


def _other(value: Any) -> Any:
    match value:
        case bool():
            return not value
        case str():
            return _WORDS.get(value, f"{value}_other")
        case int() | float() | Fraction():
            return value * 2 + 1
        case Requirement():
            return dataclasses.replace(value, text=f"not ({value.text})")
        case Trace():
            return Trace((*value.eq, 999))
        case (Node() as first, *rest):
            return (_other(first), *rest)
        case tuple() if value:
            return value[:-1]
        case Node():
            return Unknown("other", type=value.type)
    if dataclasses.is_dataclass(value) and type(value).__module__ == "specc.model.types":
        return Opaque("Other", (), "")
    if _is_part(type(value)) and value is not None:
        return None
    raise _SameError


def test_a_field_that_nothing_else_tells_of_is_compared() -> None:
    """As soon as a class has it; that words are others changes nothing of what agents do."""
    kind = dataclasses.make_dataclass("Part", ["title", "wait_s", "place", "parts"])
    old = kind("an arm", Fraction(1, 2), object(), (object(),))
    new = kind("the arm", Fraction(1, 4), object(), (object(),))
    system = read_spec(str(ROOT / SPECS[0])).system
    assert system is not None
    log = ChangeLog()
    SystemDiff((system, system), log, Constants((), ())).fields(log.part("device", "arm"), old, new)
    found = [(each.aspect, each.old, each.new, each.semantic) for each in log.changes]
    assert found == [("title", "an arm", "the arm", False), ("wait", "500 ms", "250 ms", True)]
