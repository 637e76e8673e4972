"""Monitors by formula progression: each tick rewrites the obligation, with three truth values.

The obligation is the formula that the ticks to come have to meet. Past operators keep how long ago
their operands held. So the state of a monitor is small, and two runs with the same obligation are
in one state.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal, NamedTuple

from specc.model import requirement as r
from specc.model.expr import Expr

TruthValue = bool | None
"""None is unknown."""
MANY = 2**62
"""Ticks that no run has."""
MOST_PENDING = 64
"""Pending operands of a junction; with more of them, their truth is unknown."""


@dataclass(frozen=True, slots=True)
class Said:
    """A truth value."""

    holds: TruthValue


@dataclass(frozen=True, slots=True)
class Leaf:
    """A condition on one tick, or the value of a past operator there; perhaps negated."""

    index: int
    is_meant: bool


@dataclass(frozen=True, slots=True)
class Junction:
    """A conjunction or disjunction of formulas."""

    op: Literal["and", "or"]
    operands: frozenset[Obligation]


@dataclass(frozen=True, slots=True)
class Ahead:
    """A bounded future operator: a formula at some tick, or at all ticks, of a window from now."""

    op: Literal["within", "throughout"]
    ticks: int
    operand: Obligation


Obligation = Said | Leaf | Junction | Ahead


@dataclass(frozen=True, slots=True)
class Past:
    """A past operator; its operands do not look ahead. `since` has no `ticks`."""

    op: Literal["once", "since"]
    ticks: int
    operands: tuple[Obligation, ...]


class MonitorState(NamedTuple):
    """The obligation, and for each past operator when it surely, and when it maybe, held."""

    left: Obligation
    past: tuple[tuple[int, int], ...]


class NotFollowedError(Exception):
    """A formula that looks ahead from the past."""


class Monitor:
    """The monitor of one requirement. The caller judges its conditions, `atoms`, at each tick."""

    def __init__(self, requirement: r.Requirement, tick_s: Fraction) -> None:
        """`tick_s` is the base tick of the whole system.

        Raises:
            NotFollowedError: the formula cannot be followed.
        """
        self.atoms: list[Expr] = []
        self._past: dict[int, Past] = {}
        self._count = 0
        self._tick_s = tick_s
        self._lasts = requirement.lasts
        formula = requirement.formula
        self._formula = self._node(_each_tick(formula) if self._lasts else formula, meant=True)
        self._atom_leaves = [i for i in range(self._count) if i not in self._past]
        begun = Said(True) if self._lasts else self._formula
        self.begin = MonitorState(begun, tuple((-1, -1) for _ in self._past))

    def step(
        self, state: MonitorState, atoms: tuple[TruthValue, ...], ticks: int
    ) -> tuple[MonitorState, set[TruthValue]]:
        """The state after some ticks with constant conditions, and the verdicts on these ticks."""
        said: set[TruthValue] = set()
        while ticks:
            ticks -= 1
            left, past = state
            values, past = self._values(atoms, past)
            parts = [_after(left, values)]
            if self._lasts:
                parts.append(_after(self._formula, values))
            pending = []
            for part in _conjuncts(_joined("and", parts)):
                if isinstance(part, Said):
                    said.add(part.holds)
                else:
                    pending.append(part)
            if len(pending) > MOST_PENDING:
                said.add(None)
                pending = []
            after = MonitorState(_joined("and", pending), past)
            if after == state:
                break
            state, passed = self._passed(state, after, ticks) if ticks else (after, 0)
            ticks -= passed
        return state, said

    def moving(self, state: MonitorState, atoms: tuple[TruthValue, ...]) -> int:
        """For how many ticks with constant conditions only deadlines and ages move."""
        after, _ = self.step(state, atoms, 1)
        return 1 + self._passed(state, after, MANY)[1]

    # While conditions are constant, most ticks only move deadlines and ages by one.

    def _passed(
        self, before: MonitorState, after: MonitorState, ticks: int
    ) -> tuple[MonitorState, int]:
        """Skip ticks on which only deadlines and ages move, at most `ticks`; and their number."""
        awaited, left = _awaited(before.left, after.left), self._aging(before.past, after.past)
        if awaited is None or left is None:
            return after, 0
        passed = min([ticks, *left, *(each.ticks for each in awaited)])
        parts = [
            replace(each, ticks=each.ticks - passed) if each in awaited else each
            for each in _conjuncts(after.left)
        ]
        past = tuple(
            (a + passed * (a != was), b + passed * (b != had))
            for (was, had), (a, b) in zip(before.past, after.past, strict=True)
        )
        return MonitorState(_joined("and", parts), past), passed

    def _aging(
        self, before: tuple[tuple[int, int], ...], after: tuple[tuple[int, int], ...]
    ) -> list[int] | None:
        """For how many ticks each age that grew may still grow; None if anything else changed."""
        found = []
        for item, was, now in zip(self._past.values(), before, after, strict=True):
            changed = [(a, b) for a, b in zip(was, now, strict=True) if a != b]
            if any(item.op == "since" or not 0 <= a == b - 1 for a, b in changed):
                return None
            found += [item.ticks - b for _, b in changed]
        return found

    def _values(
        self, atoms: tuple[TruthValue, ...], past: tuple[tuple[int, int], ...]
    ) -> tuple[dict[int, TruthValue], tuple[tuple[int, int], ...]]:
        """The truth values at a tick, inner past operators first, and their memory after it."""
        values: dict[int, TruthValue] = dict(zip(self._atom_leaves, atoms, strict=True))
        remembered = []
        for (index, item), (surely, maybe) in zip(self._past.items(), past, strict=True):
            found = [_now(operand, values) for operand in item.operands]
            if item.op == "since":
                held, begun = found
                surely = int(begun is True or (held is True and surely == 1))
                maybe = int(begun is not False or (held is not False and maybe == 1))
                now = surely == 1, maybe == 1
            else:  # ticks since it held, -1 for too many
                (held,) = found
                surely = 0 if held is True else _aged(surely, item.ticks)
                maybe = 0 if held is not False else _aged(maybe, item.ticks)
                now = surely >= 0, maybe >= 0
            values[index] = None if now[0] != now[1] else now[0]
            remembered.append((surely, maybe))
        return values, tuple(remembered)

    # Formulas with negations only in front of leaves.

    def _node(self, formula: r.TemporalFormula, *, meant: bool) -> Obligation:
        match formula:
            case r.TickCondition(that=that):
                self.atoms.append(that)
                return self._leaf(meant=meant)
            case r.Junction(op="not", operands=(operand,)):
                return self._node(operand, meant=not meant)
            case r.Junction(op=op, operands=operands):
                parts = [self._node(operand, meant=meant) for operand in operands]
                return _joined("and" if (op == "and") == meant else "or", parts)
            case r.Temporal(op="within" | "throughout" as op, operands=(operand,)):
                known = self._node(operand, meant=meant)
                ticks = int(formula.span_s // self._tick_s)
                return Ahead("within" if (op == "within") == meant else "throughout", ticks, known)
        assert isinstance(formula, r.Temporal)
        return self._looking_back(formula, meant=meant)

    def _looking_back(self, formula: r.Temporal, *, meant: bool) -> Leaf:
        # `historically p` is `not once not p`.
        is_opposite = formula.op == "historically"
        if any(map(r.reach_s, formula.operands)):
            raise NotFollowedError
        inside = tuple(self._node(each, meant=not is_opposite) for each in formula.operands)
        leaf = self._leaf(meant=meant != is_opposite)
        ticks = int(formula.span_s // self._tick_s)
        self._past[leaf.index] = Past("since" if formula.op == "since" else "once", ticks, inside)
        return leaf

    def _leaf(self, *, meant: bool) -> Leaf:
        self._count += 1
        return Leaf(self._count - 1, meant)


def _each_tick(formula: r.TemporalFormula) -> r.TemporalFormula:
    """A formula that holds at every tick if this one does: an outer `historically` adds nothing."""
    match formula:
        case r.Temporal(op="historically", operands=(operand,)) if r.reach_s(operand):
            return _each_tick(operand)
        case r.Junction(op="and", operands=operands):
            return replace(formula, operands=tuple(map(_each_tick, operands)))
    return formula


def _awaited(before: Obligation, after: Obligation) -> set[Ahead] | None:
    """The deadlines that came nearer; None if anything else changed, or may before them."""
    was, now = set(_conjuncts(before)), set(_conjuncts(after))
    found = {each for each in now - was if isinstance(each, Ahead) and _is_awaited(each)}
    earlier = {replace(each, ticks=each.ticks + 1) for each in found}
    return found if (was - now, now - was) == (earlier, found) else None


def _is_awaited(node: Ahead) -> bool:
    """Whether each tick decides its operand alone: then a sooner deadline absorbs a later one."""
    return node.op == "within" and not _looks_ahead(node.operand)


def _looks_ahead(node: Obligation) -> bool:
    if isinstance(node, Junction):
        return any(map(_looks_ahead, node.operands))
    return isinstance(node, Ahead)


def _aged(ticks: int, most: int) -> int:
    return ticks + 1 if 0 <= ticks < most else -1


def _now(node: Obligation, values: Mapping[int, TruthValue]) -> TruthValue:
    """The truth of a formula that does not look ahead."""
    found = _after(node, values)
    assert isinstance(found, Said)
    return found.holds


def _after(node: Obligation, values: Mapping[int, TruthValue]) -> Obligation:
    """The obligation from the next tick on, so that a formula holds at this tick."""
    match node:
        case Leaf(index=index, is_meant=meant):
            value = values[index]
            return Said(value if value is None or meant else not value)
        case Junction(op=op, operands=operands):
            return _joined(op, [_after(operand, values) for operand in operands])
        case Ahead(op=op, ticks=ticks, operand=operand):
            now = _after(operand, values)
            if not ticks:
                return now
            return _joined("or" if op == "within" else "and", [now, Ahead(op, ticks - 1, operand)])
    return node


def _conjuncts(node: Obligation) -> Iterable[Obligation]:
    if isinstance(node, Junction) and node.op == "and":
        return node.operands
    return (node,)


def _joined(op: Literal["and", "or"], operands: Iterable[Obligation]) -> Obligation:
    """The conjunction or disjunction, without operands that follow from the others."""
    end, parts, ahead = op == "or", set[Obligation](), dict[tuple[str, Obligation], Ahead]()
    for part in _flat(op, operands):
        if isinstance(part, Said) and part.holds is not None:
            if part.holds is end:
                return part
        elif isinstance(part, Ahead):
            key = part.op, part.operand
            other = ahead.setdefault(key, part)
            # A sooner deadline is stronger, and so is a longer duration.
            if (part.ticks < other.ticks) == ((part.op == "within") == (op == "and")):
                ahead[key] = part
        else:
            parts.add(part)
    parts.update(ahead.values())
    if len(parts) < 2:
        return next(iter(parts), Said(not end))
    return Junction(op, frozenset(parts))


def _flat(op: str, operands: Iterable[Obligation]) -> Iterator[Obligation]:
    for operand in operands:
        if isinstance(operand, Junction) and operand.op == op:
            yield from operand.operands
        else:
            yield operand
