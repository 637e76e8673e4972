"""Breakpoints: what of a run makes it stop, once the others see it."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from specc_runtime.forms import Layout
from specc_runtime.records import StepRecord
from specc_runtime.requirement import Requirement
from specc_runtime.subsystem import Subsystem

_MOST = 1000
_COMPARISONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">=": operator.ge,
    ">": operator.gt,
}


class Unclear(ValueError):
    """What a command asks for cannot be done; the text says why."""


@dataclass(frozen=True, slots=True)
class StepBreak:
    """Stops at a step of a machine that `matches`."""

    words: str
    machine: str
    matches: Callable[[StepRecord], bool]


@dataclass(frozen=True, slots=True)
class RequirementBreak:
    """Stops when a requirement is violated."""

    words: str
    requirement: Requirement


@dataclass(frozen=True, slots=True)
class Parts:
    """What a run has that breakpoints name."""

    subsystems: Mapping[str, Subsystem]
    layouts: Mapping[str, Layout]
    requirements: Sequence[Requirement]


def breakpoints(wanted: Any, parts: Parts) -> tuple[list[StepBreak | RequirementBreak], list[str]]:
    """The breakpoints that a command lists, and why others are none."""
    if not isinstance(wanted, list) or len(wanted) > _MOST:
        raise Unclear(f"breakpoints are a list of {_MOST} at most")
    found, refused = list[StepBreak | RequirementBreak](), list[str]()
    for each in wanted:
        try:
            found.append(_breakpoint(each, parts))
        except Unclear as error:
            refused.append(str(error))
    return found, refused


def _breakpoint(wanted: Any, parts: Parts) -> StepBreak | RequirementBreak:
    kind = text_of(wanted, "kind")
    if kind == "requirement":
        that = text_of(wanted, "that")
        for each in parts.requirements:
            if each.that == that:
                return RequirementBreak(f"violated: {that}", each)
        raise Unclear(f"there is no requirement {that}")
    if kind not in _OF_STEPS:
        raise Unclear(f"there are no breakpoints on {kind}")
    machine = machine_of(wanted, parts.subsystems)
    words, matches = _OF_STEPS[kind](wanted, parts.subsystems[machine], parts.layouts[machine])
    return StepBreak(f"{machine}: {words}", machine, matches)


def text_of(wanted: Any, name: str) -> str:
    """A text in a command; raises Unclear."""
    text = wanted.get(name) if isinstance(wanted, dict) else None
    if not isinstance(text, str):
        raise Unclear(f"{name} is missing, or no text")
    return text


def machine_of(wanted: Any, subsystems: Mapping[str, Subsystem]) -> str:
    """The subsystem that a command names; raises Unclear."""
    name = text_of(wanted, "machine")
    if name not in subsystems:
        raise Unclear(f"there is no subsystem {name}; there are {', '.join(subsystems)}")
    return name


_Found = tuple[str, Callable[[StepRecord], bool]]


def _of_state(wanted: Any, subsystem: Subsystem, layout: Layout) -> _Found:
    state = text_of(wanted, "state")
    if state not in subsystem.sends:
        raise Unclear(f"{subsystem.name} has no state {state}")

    def matches(record: StepRecord) -> bool:
        enters = record.transition >= 0 or record.stamp == 0  # the first step has no row
        return enters and record.state == state

    return f"entered {state}", matches


def _of_row(wanted: Any, subsystem: Subsystem, layout: Layout) -> _Found:
    label = text_of(wanted, "row")
    rows = {index for index, row in enumerate(subsystem.transitions) if str(row) == label}
    if not rows:
        raise Unclear(f"{subsystem.name} has no row {label}")
    return label, lambda record: record.transition in rows


def _of_condition(wanted: Any, subsystem: Subsystem, layout: Layout) -> _Found:
    name = text_of(wanted, "condition")
    rows = {
        index
        for index, row in enumerate(subsystem.transitions)
        if name in (row.condition, _ending(layout, row.source, row.cause))
    }
    if not rows:
        raise Unclear(f"no row of {subsystem.name} is taken by a condition {name}")
    return f"{name} held", lambda record: record.transition in rows


def _ending(layout: Layout, state: str, cause: str) -> str:
    """The condition that ends a state by a cause."""
    terminal, error, _ = layout.ends.get(state, ("", "", ""))
    if cause == "terminal":
        return terminal
    return error if isinstance(error, str) else error.get(cause, "")


def _of_sent(wanted: Any, subsystem: Subsystem, layout: Layout) -> _Found:
    name = text_of(wanted, "element")
    attributes = [e.attribute for e in layout.y if name == ".".join(e.name)]
    if not attributes:
        raise Unclear(f"{subsystem.name} sends no {name}")
    attribute, compares = attributes[0], _comparison(wanted)

    def matches(record: StepRecord) -> bool:
        return any(element == attribute and compares(value) for element, value in record.sent)

    words = f"sent {name}"
    if "op" in wanted:
        item = f"[{wanted['item']}]" if "item" in wanted else ""
        words += f"{item} {wanted['op']} {wanted['value']:g}"
    return words, matches


def _comparison(wanted: Any) -> Callable[[Any], bool]:
    if "op" not in wanted:
        return lambda value: True
    compare, bound, item = (
        _COMPARISONS.get(text_of(wanted, "op")),
        wanted.get("value"),
        wanted.get("item"),
    )
    if compare is None:
        raise Unclear(f"op is one of {' '.join(_COMPARISONS)}")
    if not isinstance(bound, int | float) or not math.isfinite(bound):
        raise Unclear("value is missing, or no number")
    if item is not None and type(item) is not int:
        raise Unclear("item is no whole number")

    def compares(value: Any) -> bool:
        try:
            return bool(compare(value if item is None else value[item], bound))
        except (TypeError, ValueError, LookupError):  # of another type, or shorter
            return False

    return compares


_OF_STEPS: Mapping[str, Callable[[Any, Subsystem, Layout], _Found]] = {
    "state": _of_state,
    "row": _of_row,
    "condition": _of_condition,
    "sent": _of_sent,
}
