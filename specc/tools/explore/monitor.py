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
MAX_PENDING = 64
"""The most pending operands of a conjunction; with more, their truth is unknown."""


@dataclass(frozen=True, slots=True)
class TruthConstant:
    """A truth value."""

    value: TruthValue


@dataclass(frozen=True, slots=True)
class MonitorAtom:
    """A condition on one tick, or the value of a past operator there; perhaps negated."""

    index: int
    is_positive: bool


@dataclass(frozen=True, slots=True)
class BoolOp:
    """A conjunction or disjunction of formulas."""

    op: Literal["and", "or"]
    operands: frozenset[Obligation]


@dataclass(frozen=True, slots=True)
class Future:
    """A bounded future operator: a formula at some tick, or at all ticks, of a window from now."""

    op: Literal["within", "throughout"]
    ticks: int
    operand: Obligation


Obligation = TruthConstant | MonitorAtom | BoolOp | Future


@dataclass(frozen=True, slots=True)
class Past:
    """A past operator; its operands have no future operators. `since` has no `ticks`."""

    op: Literal["once", "since"]
    ticks: int
    operands: tuple[Obligation, ...]


class MonitorState(NamedTuple):
    """The obligation, and how long ago each past operator surely, and maybe, held.

    `waiting` are the ticks before the first one that is judged.
    """

    obligation: Obligation
    past: tuple[tuple[int, int], ...]
    waiting: int = 0


class UnsupportedFormulaError(Exception):
    """A formula with a future operator inside a past operator."""


class Monitor:
    """The monitor of one requirement. The caller judges its conditions, `atoms`, at each tick.

    Those in `watched` are values: the truth of each is whether it changed at the tick, as it did at
    the first one.
    """

    def __init__(self, requirement: r.Requirement, tick_s: Fraction, lag: int = 0) -> None:
        """`tick_s` is the base tick of the whole system.

        A monitor that lags judges at each tick what was so `lag` ticks before, with changes told
        as they are: what has not changed for so much longer had not changed then, and of what has
        nothing is known.

        Raises:
            UnsupportedFormulaError: a past operator has a future operator in it.
        """
        self.atoms: list[Expr] = []
        self.watched: set[int] = set()
        self._lag, self._lagging = lag, set[int]()
        self._past: dict[int, Past] = {}
        self._count = 0
        self._tick_s = tick_s
        self._holds_always = requirement.holds_always
        formula = requirement.formula
        self._formula = self._compile(
            _pointwise(formula) if self._holds_always else formula, positive=True
        )
        self._atom_indexes = [i for i in range(self._count) if i not in self._past]
        obligation = TruthConstant(True) if self._holds_always else self._formula
        self.initial_state = MonitorState(obligation, tuple((-1, -1) for _ in self._past), lag)

    def step(
        self, state: MonitorState, atoms: tuple[TruthValue, ...], ticks: int
    ) -> tuple[MonitorState, set[TruthValue]]:
        """The state after some ticks with constant conditions, and the verdicts on these ticks."""
        verdicts: set[TruthValue] = set()
        while ticks:
            ticks -= 1
            obligation, past, waiting = state
            values, past = self._tick_values(atoms, past)
            if waiting:  # the run has not begun yet
                state = MonitorState(obligation, past, waiting - 1)
                continue
            parts = [_progress(obligation, values)]
            if self._holds_always:
                parts.append(_progress(self._formula, values))
            pending = []
            for part in _conjuncts(_combine("and", parts)):
                if isinstance(part, TruthConstant):
                    verdicts.add(part.value)
                else:
                    pending.append(part)
            if len(pending) > MAX_PENDING:
                verdicts.add(None)
                pending = []
            after = MonitorState(_combine("and", pending), past)
            if after == state:
                break
            state, passed = self._skip_ticks(state, after, ticks) if ticks else (after, 0)
            ticks -= passed
        return state, verdicts

    def holds_now(self, atoms: tuple[TruthValue, ...]) -> TruthValue:
        """Whether a formula about single ticks holds where its conditions are so."""
        return _truth_now(self._formula, dict(zip(self._atom_indexes, atoms, strict=True)))

    # While conditions are constant, most ticks only move deadlines and ages by one.

    def _skip_ticks(
        self, before: MonitorState, after: MonitorState, ticks: int
    ) -> tuple[MonitorState, int]:
        """Skip ticks on which only deadlines and ages move, at most `ticks`; and their number."""
        deadlines, ages = (
            _nearer_deadlines(before.obligation, after.obligation),
            self._remaining_ages(before.past, after.past),
        )
        if deadlines is None or ages is None:
            return after, 0
        passed = min([ticks, *ages, *(each.ticks for each in deadlines)])
        parts = [
            replace(each, ticks=each.ticks - passed) if each in deadlines else each
            for each in _conjuncts(after.obligation)
        ]
        past = tuple(
            (a + passed * (a != was), b + passed * (b != had))
            for (was, had), (a, b) in zip(before.past, after.past, strict=True)
        )
        return MonitorState(_combine("and", parts), past), passed

    def _remaining_ages(
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

    def _tick_values(
        self, atoms: tuple[TruthValue, ...], past: tuple[tuple[int, int], ...]
    ) -> tuple[dict[int, TruthValue], tuple[tuple[int, int], ...]]:
        """The truth values at a tick, inner past operators first, and their memory after it."""
        values: dict[int, TruthValue] = dict(zip(self._atom_indexes, atoms, strict=True))
        remembered = []
        for (index, item), (surely, maybe) in zip(self._past.items(), past, strict=True):
            found = [_truth_now(operand, values) for operand in item.operands]
            if item.op == "since":
                holding, started = found
                surely = int(started is True or (holding is True and surely == 1))
                maybe = int(started is not False or (holding is not False and maybe == 1))
                now = surely == 1, maybe == 1
            else:  # ticks since it held, -1 for too many
                (holding,) = found
                surely = 0 if holding is True else _next_age(surely, item.ticks)
                maybe = 0 if holding is not False else _next_age(maybe, item.ticks)
                now = surely >= 0, maybe >= 0
            values[index] = None if now[0] != now[1] else now[0]
            if index in self._lagging and now[0]:
                values[index] = None
            remembered.append((surely, maybe))
        return values, tuple(remembered)

    # Formulas with negations only in front of leaves.

    def _compile(self, formula: r.TemporalFormula, *, positive: bool) -> Obligation:
        match formula:
            case r.TickCondition(that=that):
                self.atoms.append(that)
                return self._new_atom(positive=positive)
            case r.BoolOp(op="not", operands=(operand,)):
                return self._compile(operand, positive=not positive)
            case r.BoolOp(op=op, operands=operands):
                parts = [self._compile(operand, positive=positive) for operand in operands]
                return _combine("and" if (op == "and") == positive else "or", parts)
            case r.Temporal(op="within" | "throughout" as op, operands=(operand,)):
                known = self._compile(operand, positive=positive)
                ticks = int(formula.span_s // self._tick_s)
                return Future(
                    "within" if (op == "within") == positive else "throughout", ticks, known
                )
        if isinstance(formula, r.Stays):
            return self._compile_stays(formula, positive=positive)
        assert isinstance(formula, r.Temporal)
        return self._compile_past(formula, positive=positive)

    def _compile_past(self, formula: r.Temporal, *, positive: bool) -> MonitorAtom:
        # `historically p` is `not once not p`.
        is_opposite = formula.op == "historically"
        if any(map(r.horizon_s, formula.operands)):
            raise UnsupportedFormulaError
        inside = tuple(self._compile(each, positive=not is_opposite) for each in formula.operands)
        leaf = self._new_atom(positive=positive != is_opposite)
        ticks = int(formula.span_s // self._tick_s)
        self._past[leaf.index] = Past("since" if formula.op == "since" else "once", ticks, inside)
        return leaf

    def _compile_stays(self, formula: r.Stays, *, positive: bool) -> Obligation:
        """`stays(v, T)` is `not once(T - 1 tick, v changed)`."""
        ticks = int(formula.span_s // self._tick_s)
        if not ticks:
            return TruthConstant(positive)
        self.watched.add(len(self.atoms))
        self.atoms.append(formula.value)
        changed = self._new_atom(positive=True)
        leaf = self._new_atom(positive=not positive)
        self._past[leaf.index] = Past("once", ticks - 1 + self._lag, (changed,))
        if self._lag:
            self._lagging.add(leaf.index)
        return leaf

    def _new_atom(self, *, positive: bool) -> MonitorAtom:
        self._count += 1
        return MonitorAtom(self._count - 1, positive)


def _pointwise(formula: r.TemporalFormula) -> r.TemporalFormula:
    """A formula that holds at every tick if this one does: an outer `historically` adds nothing."""
    match formula:
        case r.Temporal(op="historically", operands=(operand,)) if r.horizon_s(operand):
            return _pointwise(operand)
        case r.BoolOp(op="and", operands=operands):
            return replace(formula, operands=tuple(map(_pointwise, operands)))
    return formula


def _nearer_deadlines(before: Obligation, after: Obligation) -> set[Future] | None:
    """The deadlines that came nearer; None if anything else changed, or may change before them."""
    was, now = set(_conjuncts(before)), set(_conjuncts(after))
    found = {each for each in now - was if isinstance(each, Future) and _is_plain_deadline(each)}
    earlier = {replace(each, ticks=each.ticks + 1) for each in found}
    return found if (was - now, now - was) == (earlier, found) else None


def _is_plain_deadline(node: Future) -> bool:
    """Whether each tick decides its operand alone: then a sooner deadline absorbs a later one."""
    return node.op == "within" and not _has_future(node.operand)


def _has_future(node: Obligation) -> bool:
    if isinstance(node, BoolOp):
        return any(map(_has_future, node.operands))
    return isinstance(node, Future)


def _next_age(ticks: int, most: int) -> int:
    return ticks + 1 if 0 <= ticks < most else -1


def _truth_now(node: Obligation, values: Mapping[int, TruthValue]) -> TruthValue:
    """The truth of a formula without future operators."""
    found = _progress(node, values)
    assert isinstance(found, TruthConstant)
    return found.value


def _progress(node: Obligation, values: Mapping[int, TruthValue]) -> Obligation:
    """Formula progression: the obligation from the next tick on."""
    match node:
        case MonitorAtom(index=index, is_positive=positive):
            value = values[index]
            return TruthConstant(value if value is None or positive else not value)
        case BoolOp(op=op, operands=operands):
            return _combine(op, [_progress(operand, values) for operand in operands])
        case Future(op=op, ticks=ticks, operand=operand):
            now = _progress(operand, values)
            if not ticks:
                return now
            return _combine(
                "or" if op == "within" else "and", [now, Future(op, ticks - 1, operand)]
            )
    return node


def _conjuncts(node: Obligation) -> Iterable[Obligation]:
    if isinstance(node, BoolOp) and node.op == "and":
        return node.operands
    return (node,)


def _combine(op: Literal["and", "or"], operands: Iterable[Obligation]) -> Obligation:
    """The conjunction or disjunction, without operands that follow from the others."""
    absorbing, parts, futures = (
        op == "or",
        set[Obligation](),
        dict[tuple[str, Obligation], Future](),
    )
    for part in _flatten(op, operands):
        if isinstance(part, TruthConstant) and part.value is not None:
            if part.value is absorbing:
                return part
        elif isinstance(part, Future):
            key = part.op, part.operand
            other = futures.setdefault(key, part)
            # A sooner deadline is stronger, and so is a longer duration.
            if (part.ticks < other.ticks) == ((part.op == "within") == (op == "and")):
                futures[key] = part
        else:
            parts.add(part)
    parts.update(futures.values())
    if len(parts) < 2:
        return next(iter(parts), TruthConstant(not absorbing))
    return BoolOp(op, frozenset(parts))


def _flatten(op: str, operands: Iterable[Obligation]) -> Iterator[Obligation]:
    for operand in operands:
        if isinstance(operand, BoolOp) and operand.op == op:
            yield from operand.operands
        else:
            yield operand
