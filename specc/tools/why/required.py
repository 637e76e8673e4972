"""Why a requirement is violated: what it asked for, from which moment, and until when."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any

from specc.diagnostics.phrases import truncate
from specc.model.requirement import (
    BoolOp,
    Reading,
    Requirement,
    Temporal,
    TemporalFormula,
    horizon_s,
)
from specc.tools.why.moment import NotKnown, value_of
from specc.tools.why.reasons import shown

_LONGEST = 140
Steps = Callable[[float], Mapping[str, Mapping[str, Any]]]
"""The messages of the last steps until a time in s, by subsystem."""


def reasons_of_violation(
    requirement: Requirement, time_s: float, steps: Steps, shown_s: Callable[[float], str]
) -> Iterator[str]:
    """Why its formula fails at a time; `shown_s` makes words of times.

    The values follow that it reads, then and at the deadline if there is one.
    """
    formula = requirement.formula
    yield from _missed(requirement, formula, time_s, shown_s)
    for at_s in dict.fromkeys((time_s, time_s + float(horizon_s(formula)))):
        there = steps(at_s)
        for reading in requirement.readings:
            if text := _read(reading, there.get(reading.subsystem)):
                yield f"at {shown_s(at_s)}: {reading.name} = {text}"


def _missed(
    requirement: Requirement,
    formula: TemporalFormula,
    time_s: float,
    shown_s: Callable[[float], str],
) -> Iterator[str]:
    """What did not hold, and why it had to, from the outside to the inside of a formula."""
    at = shown_s(time_s)
    match formula:
        case BoolOp(operands=(_, conclusion), premise=premise) if premise is not None:
            yield f"at {at}: {_part(requirement, premise)} held"
            yield from _missed(requirement, conclusion, time_s, shown_s)
        case Temporal(op="within", operands=(operand,), span_s=span_s):
            part, by = _part(requirement, operand), shown_s(time_s + float(span_s))
            yield f"{part} had to hold by {by}, {_span(span_s)} later, and did not"
        case Temporal(op="throughout", operands=(operand,), span_s=span_s):
            part, until = _part(requirement, operand), shown_s(time_s + float(span_s))
            yield f"{part} had to hold until {until}, for {_span(span_s)}, and did not all the time"
        case _:
            yield f"at {at}: {_part(requirement, formula)} did not hold"


def _part(requirement: Requirement, formula: TemporalFormula) -> str:
    return truncate(requirement.part(formula), _LONGEST)


def _span(span_s: Fraction) -> str:
    return f"{float(span_s):g} s"


def _read(reading: Reading, step: Mapping[str, Any] | None) -> str:
    """A value that counts from the time stamp of a step; nothing for others."""
    if step is None or reading.asks_presence:
        return ""
    if reading.kind == "state":
        return truncate(str(step.get("state")), _LONGEST)
    data: Any = step.get({"memory": "memory", "reported": "x"}.get(reading.kind, ""))
    for name in reading.element:
        data = data.get(name) if isinstance(data, dict) else None
    try:
        return "" if data is None else shown(reading.type, value_of(reading.type, data))
    except NotKnown:
        return ""
