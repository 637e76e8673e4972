"""What is missing for a condition or requirement to hold, in words: values, and limits missed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from itertools import islice
from typing import Any

from specc.diagnostics.phrases import truncate
from specc.lang.builtins import FUNCTIONS
from specc.lang.kinds import kind
from specc.lang.show import show
from specc.lang.values import Fields, NotRecorded, angle, position
from specc.model import expr as m
from specc.model.expr import junction
from specc.model.requirement import (
    BoolOp,
    Reading,
    Requirement,
    Stays,
    Temporal,
    TemporalFormula,
    horizon_s,
)
from specc.model.types import Int, ListOf, Pose, Real, Text, Type, complete_type
from specc.model.units import DIMENSIONLESS
from specc.tools.why.moment import Moment, NotKnown, value_of

_LONGEST_TEXT, _LONGEST_VALUE = 140, 120
_MOST_LINES, _MOST_ITEMS = 30, 4
_MOST_REASONS = 1000
"""Of one condition that are looked for: quantifiers in one another have more than can be told."""
_DEEPEST = 8
"""Named parts in named parts whose reasons are told."""


class Reasons:
    """The reasons of one condition; each value is told once."""

    def __init__(self, moment: Moment) -> None:
        self._moment = moment
        self._shown_exprs: set[m.Expr] = set()
        self._explained_lets: set[tuple[str, bool]] = set()
        """Named parts whose reasons are told, and whether they were wanted to hold."""
        self._bound: dict[str, Any] = {}
        """Variables of quantifiers, while one item is told of."""

    def lines(self, expr: m.Expr) -> list[str]:
        """Why it holds or what is missing, and then what it read."""
        reasons, read = self.of(expr)
        return [*reasons, *read]

    def of(self, expr: m.Expr) -> tuple[list[str], list[str]]:
        """Why it holds or what is missing; and what it read besides."""
        reasons = [*islice(self._why(expr, wanted=True, depth=0), _MOST_REASONS)]
        read = [*self._read(expr)]
        most = max(_MOST_LINES - len(read), _MOST_LINES // 2)
        number = f"{len(reasons) - most}{' or' if len(reasons) == _MOST_REASONS else ''}"
        rest = [f"and {number} more"] if len(reasons) > most else []
        return [*reasons[:most], *rest], read

    def _why(self, expr: m.Expr, wanted: bool, depth: int) -> Iterator[str]:
        """What decides whether it is as it is `wanted` to be."""
        if depth > _DEEPEST:
            return
        if isinstance(expr, m.Unary) and expr.op == "not":
            yield from self._why(expr.operand, not wanted, depth)
        elif isinstance(expr, m.Quantifier) and isinstance(expr.over, m.Items):
            parts = (m.instantiate(expr.body, expr.variable, item) for item in expr.over.items)
            op: Any = "and" if expr.kind == "all" else "or"
            yield from self._why(junction(op, tuple(parts)), wanted, depth)
        elif isinstance(expr, m.Logic):
            yield from self._operands(expr, wanted, depth)
        elif isinstance(expr, m.LetRef):
            self._shown_exprs.add(expr)
            if (expr.name, wanted) in self._explained_lets:
                yield f"{expr.name}: {self._value_or_reason(expr)}, as above"
                return
            self._explained_lets.add((expr.name, wanted))
            value = self._moment.subsystem.let(expr.name).value
            yield f"{expr.name}, which is {_text(value)}: {self._value_or_reason(expr)}"
            yield from _indented(self._why(value, wanted, depth + 1))
        elif isinstance(expr, m.Quantifier):
            yield from self._quantifier_reasons(expr, wanted, depth)
        elif not isinstance(expr, m.Truth):
            try:
                yield self._atom(expr, self._value_of(expr) is wanted, wanted)
            except NotKnown as why:
                yield f"{_text(expr)} is not known: {why}"

    def _value_or_reason(self, expr: m.Expr) -> str:
        try:
            return str(self._value_of(expr))
        except NotKnown as why:
            return f"not known: {why}"

    def _value_of(self, expr: m.Expr) -> Any:
        return self._moment.value(expr, **self._bound)

    def _operands(self, expr: m.Logic, wanted: bool, depth: int) -> Iterator[str]:
        """The unmet operands of a conjunction, or all operands of a disjunction."""
        is_all = (expr.op == "and") is wanted
        is_met = self._moment.truth(expr, **self._bound) is wanted
        decided, skipped = False, []
        for part in expr.operands:
            truth = self._moment.truth(part, **self._bound)
            if decided:
                skipped.append(_text(part) + (", which would be true" if truth else ""))
            elif not (is_all and truth is wanted and not is_met):
                yield from self._why(part, wanted, depth)
            decided |= truth is (expr.op == "or")
        if skipped:
            more = f"; and {len(skipped) - _MOST_ITEMS} more" if len(skipped) > _MOST_ITEMS else ""
            texts = "; ".join(skipped[:_MOST_ITEMS]) + more
            yield f"not asked, for what stands before it decided: {texts}"

    def _atom(self, expr: m.Expr, is_met: bool, wanted: bool) -> str:
        is_or_needs = "is" if is_met else "needs"
        match expr:
            case m.Compare(op=op, left=left, right=right):
                return self._compared(op if wanted else m.OPPOSITES[op], left, right, is_met)
            case m.Builtin(name=name, args=args) if FUNCTIONS[name].compares:
                return self._near(args, wanted, is_met)
            case m.Fresh(input=read):
                self._shown_exprs.add(expr)
                came = "came" if is_met is wanted else "did not come"
                need = "" if is_met else f", needs {'one' if wanted else 'none'}"
                return f"a new {show(read)} {came}{need}"
            case m.Present(input=read):
                self._shown_exprs.add(expr)
                has = "has" if is_met is wanted else "has not"
                return f"{show(read)} {has} a value{'' if is_met else ', needs the opposite'}"
            case m.IsOneOf(item=item, members=members):
                named = "{" + ", ".join(sorted(members)) + "}"
                word = "in" if wanted else "not in"
                return f"{self._value(item)}, {is_or_needs} {word} {named}"
            case m.IsNone(value=value):
                return f"{self._value(value)}, {is_or_needs} {'None' if wanted else 'a value'}"
        return self._value(expr) + ("" if is_met else f", needs {wanted}")

    def _value(self, expr: m.Expr) -> str:
        """An expression with its value."""
        self._shown_exprs.add(expr)
        text = _text(expr)
        return text if _is_literal(expr) else f"{text} = {self._value_or_unknown(expr)}"

    def _value_or_unknown(self, expr: m.Expr) -> str:
        try:
            return value_text(expr.type, self._value_of(expr))
        except NotKnown as why:
            return f"not known ({why})"

    def _compared(self, op: str, left: m.Expr, right: m.Expr, is_met: bool) -> str:
        if _is_literal(left) and not _is_literal(right):
            left, right, op = right, left, m.MIRRORED[op]
        limit = self._value_or_unknown(right)
        if not _is_literal(right):
            self._shown_exprs.add(right)
            limit += f" ({_text(right)})"
        words = f"{self._value(left)}, {'is' if is_met else 'needs'} {op} {limit}"
        if is_met or op in ("==", "!=") or not isinstance(left.type, Real | Int):
            return words
        apart = self._value_of(left) - self._value_of(right)
        return f"{words}: {_length(abs(apart), left.type)} too {'much' if '<' in op else 'little'}"

    def _near(self, args: tuple[m.Expr, ...], wanted: bool, is_met: bool) -> str:
        """How far the two are apart, and what is allowed."""
        self._shown_exprs.update(args[2:])
        a, b, most, *turn = map(self._value_of, args)
        if turn:
            spans = [
                ("apart by ", math.dist(position(a), position(b)), most, args[2].type),
                ("turned by ", angle(a, b), turn[0], args[3].type),
            ]
        else:
            pairs = zip(a, b, strict=True) if isinstance(a, tuple) else [(a, b)]
            far = max((abs(p - q) for p, q in pairs), default=0.0)
            spans = [("apart by ", far, most, args[2].type)]
        distances = []
        for word, far, most, of in spans:
            more = f", {_length(far - most, of)} too much" if wanted and far > most else ""
            distances.append(f"{word}{_length(far, of)}, limit {_length(most, of)}{more}")
        first, second = (_text(a) if isinstance(a.type, Pose) else self._value(a) for a in args[:2])
        need = "" if wanted or is_met else ", needs to be beyond a limit"
        is_ = "is" if is_met is wanted else "is not"
        return f"{first} {is_} near {second}: {'; '.join(distances)}{need}"

    def _quantifier_reasons(self, expr: m.Quantifier, wanted: bool, depth: int) -> Iterator[str]:
        """Says for how many items the body is true.

        Explains one item that prevents the wanted result.
        """
        text = f"{_text(expr.body)} for {expr.variable} in {_text(expr.over)}"
        try:
            items = self._moment.value(expr.over, **self._bound)
            each = [{**self._bound, expr.variable: item} for item in items]
            truths = [self._moment.value(expr.body, **bound) for bound in each]
        except NotKnown as why:
            yield f"{text}: not known: {why}"
            return
        true_items = [i for i, holds in enumerate(truths) if holds]
        numbers = ", ".join(map(str, true_items[:_MOST_ITEMS])) + (
            ", ..." if true_items[_MOST_ITEMS:] else ""
        )
        words = f"true of {len(true_items)} of {len(items)}, number {numbers}"
        if len(true_items) in (0, len(items)):
            words = (
                f"true of all {len(true_items)}" if true_items else f"true of none of {len(items)}"
            )
        is_as_wanted = (all(truths) if expr.kind == "all" else any(truths)) is wanted
        every = "every one" if expr.kind == "all" else "one"
        needs = "" if is_as_wanted else f", needs {every if wanted else f'not {every}'}"
        yield f"{text}: {words}{needs}"
        unwanted_items = [i for i, holds in enumerate(truths) if holds is not wanted]
        is_decisive = len(items) == 1 or (expr.kind == "all") is wanted
        if unwanted_items and is_decisive and not is_as_wanted:
            bound, self._bound = self._bound, each[unwanted_items[0]]
            yield f"  as for number {unwanted_items[0]}:"
            yield from _indented(_indented(self._why(expr.body, wanted, depth + 1)))
            self._bound = bound

    def _read(self, expr: m.Expr) -> Iterator[str]:
        """The values that were read and are not told yet."""
        for leaf in self._moment.leaves(expr):
            if leaf in self._shown_exprs:
                continue
            self._shown_exprs.add(leaf)
            if isinstance(leaf, m.Fresh | m.Present):
                yield f"read {show(leaf)} = {self._value_or_reason(leaf)}"
            elif isinstance(leaf, m.LetRef):
                meaning = _text(self._moment.subsystem.let(leaf.name).value)
                yield f"read {leaf.name} = {self._value_or_unknown(leaf)}, which is {meaning}"
            else:
                yield f"read {self._value(leaf)}"


def _indented(lines: Iterable[str]) -> Iterator[str]:
    return (f"  {line}" for line in lines)


def _is_literal(expr: m.Expr) -> bool:
    return isinstance(expr, m.Number | m.Truth | m.TextLiteral | m.Member | m.Nothing)


def _text(expr: m.Expr) -> str:
    return truncate(show(expr), _LONGEST_TEXT)


def _length(value: Any, type_: Type) -> str:
    unit = f" {type_.unit}" if isinstance(type_, Real) and type_.unit != DIMENSIONLESS else ""
    return f"{value:.3g}{unit}" if isinstance(value, float) else f"{truncate(str(value), 30)}{unit}"


def value_text(type_: Type, value: Any) -> str:
    """A value with its unit, in SI units."""
    return truncate(_value_text(type_, value), _LONGEST_VALUE)


def _value_text(type_: Type, value: Any) -> str:
    if isinstance(value, NotRecorded):
        return "not recorded"
    inner = complete_type(type_)
    if inner.units or inner.is_array:
        return _quantity(inner, value)
    some = value[:_MOST_ITEMS] if isinstance(type_, ListOf) else value
    match kind(type_).map_parts(type_, some, _value_text):
        case tuple() as items if isinstance(type_, ListOf):
            return f"{len(value)} {'item' if len(value) == 1 else 'items'} [{', '.join(items)}]"
        case tuple() as items:
            return f"[{', '.join(items)}]"
        case Fields() as fields:
            return f"{{{', '.join(f'{name}: {text}' for name, text in fields)}}}"
        case int() as number if kind(type_).sort == "whole":
            return truncate(str(number), 30)
        case other:
            return repr(other) if isinstance(type_, Text) else str(other)


def _quantity(type_: Type, value: Any) -> str:
    if isinstance(type_, Pose):
        return f"at {_numbers(position(value))} m, turned by {_number(angle(value, _HERE))} rad"
    units = " and ".join(map(str, type_.units))
    units = f" in {units}" if len(type_.units) > 1 else f" {units}" if units != "1" else ""
    return (_numbers(value) if type_.is_array else _number(value)) + units


_HERE = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def _number(value: float) -> str:
    return "_" if math.isnan(value) else f"{value:.6g}"


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join('_' if math.isnan(v) else f'{v:.4g}' for v in values)}]"


# Why a requirement is violated: what it asked for, from which moment, and until when.

Steps = Callable[[float], Mapping[str, Mapping[str, Any]]]
"""The messages of the last steps until a time in s, by subsystem."""


def violation_reasons(
    requirement: Requirement, time_s: float, steps: Steps, shown_s: Callable[[float], str]
) -> Iterator[str]:
    """Why its formula fails at a time; `shown_s` makes words of times.

    The values follow that it reads, then and at the deadline if there is one.
    """
    formula = requirement.formula
    yield from _missed(requirement, formula, time_s, shown_s)
    for at_s in dict.fromkeys((time_s, time_s + float(horizon_s(formula)))):
        last_steps = steps(at_s)
        for reading in requirement.readings:
            if text := _read(reading, last_steps.get(reading.subsystem)):
                yield f"at {shown_s(at_s)}: {reading.name} = {text}"


def _missed(
    requirement: Requirement,
    formula: TemporalFormula,
    time_s: float,
    shown_s: Callable[[float], str],
) -> Iterator[str]:
    """What did not hold, and why it had to, from the outside to the inside of a formula."""
    at = shown_s(time_s)

    def text(part: TemporalFormula) -> str:
        return truncate(requirement.part(part), _LONGEST_TEXT)

    def until(span_s: Fraction) -> str:
        return shown_s(time_s + float(span_s))

    match formula:
        case BoolOp(operands=(_, conclusion), premise=premise) if premise is not None:
            yield f"at {at}: {text(premise)} held"
            yield from _missed(requirement, conclusion, time_s, shown_s)
        case Temporal(op="within", operands=(part,), span_s=s):
            yield f"{text(part)} had to hold by {until(s)}, {float(s):g} s later, and did not"
        case Stays(span_s=s):
            yield f"at {at}: {text(formula)} did not hold: it changed in the {float(s):g} s before"
        case Temporal(op="throughout", operands=(part,), span_s=s):
            part_until = f"{text(part)} had to hold until {until(s)}"
            yield f"{part_until}, for {float(s):g} s, and did not all the time"
        case _:
            yield f"at {at}: {text(formula)} did not hold"


def _read(reading: Reading, step: Mapping[str, Any] | None) -> str:
    """A value that counts from the time stamp of a step; nothing for others."""
    if step is None or reading.asks_presence:
        return ""
    if reading.kind == "state":
        return truncate(str(step.get("state")), _LONGEST_TEXT)
    data: Any = step.get({"memory": "memory", "reported": "x"}.get(reading.kind, ""))
    for name in reading.element:
        data = data.get(name) if isinstance(data, dict) else None
    try:
        return "" if data is None else value_text(reading.type, value_of(reading.type, data))
    except NotKnown:
        return ""
