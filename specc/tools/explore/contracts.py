"""Contracts of devices: what the steps of machines say of their conditions on measurements.

A machine that takes a row, or stays, has seen its conditions hold or fail. Where this refutes a
condition of a contract, the contract was not met at that tick: its monitor notes it, and a trace on
which the contract is surely broken is not followed. Nothing else is concluded from a contract.

An observer of a device reads what the device reports: the subsystem that uses the device itself,
and others if each value is passed on unchanged in every period. They see it a `lag` later, so the
monitors for them lag by as much.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

from specc.lang.evaluate import range_of
from specc.lang.kinds import kind
from specc.model import expr as m
from specc.model.expr import negation
from specc.model.requirement import Reading, Requirement
from specc.model.system import Subsystem
from specc.proof.ticks import Ticks
from specc.tools.explore.abstraction import Abstraction, conditions_of
from specc.tools.explore.cone import ConeEnding
from specc.tools.explore.monitor import Monitor, TruthValue
from specc.tools.explore.partial import (
    MAX_FLOAT,
    KnownValues,
    may_fail,
    residual,
    static_values,
)
from specc.tools.explore.regions import BoundedUnknown, value_leaves
from specc.tools.explore.transitions import MachineState, Transition
from specc.tools.explore.walker import Walker


class Move(NamedTuple):
    """A step of a machine: its number, and of its state before; the buffers that it read."""

    machine: int
    local: int
    buffers: tuple[int, ...]
    transition: Transition


@dataclass(frozen=True, slots=True)
class DeviceView:
    """How a machine sees what a device reports: its inputs, by the names of readings."""

    machine: str
    lag_s: Fraction
    inputs: Mapping[str, m.Input]


def views(contract: Requirement, abstraction: Abstraction) -> list[DeviceView]:
    """The machines that see what the device of a contract reports, and decide on it."""
    reported = [each for each in contract.readings if each.kind == "reported"]
    seen: dict[tuple[str, Fraction], dict[str, m.Input]] = {}
    for reading in reported:
        for machine, lag_s, node in readers(reading, abstraction):
            seen.setdefault((machine, lag_s), {})[reading.name] = node
    found = (DeviceView(machine, lag_s, inputs) for (machine, lag_s), inputs in seen.items())
    return [view for view in found if _decides(view, abstraction)]


def _decides(view: DeviceView, abstraction: Abstraction) -> bool:
    """Whether a condition of the machine depends on these inputs."""
    machine = abstraction.machines[view.machine]
    states = (state.name for state in machine.subsystem.states)
    conditions = [expr for state in states for expr in conditions_of(machine.subsystem, state)]
    read = machine.dependences.all(conditions).inputs
    return any(node.key in read for node in view.inputs.values())


def readers(reading: Reading, abstraction: Abstraction) -> Iterator[tuple[str, Fraction, m.Input]]:
    """The machines that read a measurement, each with its lag and its input.

    One that passes it on is stepped at each time stamp of its reader, so the lag is the same in
    all periods.
    """
    if reading.subsystem not in abstraction.machines:
        return
    node = m.Input(reading.element[0], reading.element[1], type=reading.type)
    waiting, seen = [(reading.subsystem, Fraction(0), node)], {(reading.subsystem, node.key)}
    while waiting:
        sender, lag_s, node = waiting.pop(0)
        yield sender, lag_s, node
        machine = abstraction.machines[sender].subsystem
        period_s = 1 / machine.rate_hz
        for name, reader in abstraction.machines.items():
            for element in reader.subsystem.inputs:
                source, output = abstraction.sender_of(name, element) or ("", ("", ""))
                is_new = source == sender and (name, element) not in seen
                if not is_new or (1 / reader.subsystem.rate_hz) % period_s:
                    continue
                if _passes_on(machine, output, node.key, abstraction):
                    seen.add((name, element))
                    waiting.append((name, lag_s + period_s, m.Input(*element, type=reading.type)))


def _passes_on(
    subsystem: Subsystem, output: tuple[str, str], key: tuple[str, str], abstraction: Abstraction
) -> bool:
    """Whether every state sends the value of an input as it is."""
    known = static_values(subsystem, abstraction.facts.system)
    for state in subsystem.states:
        sent = [
            residual(item.value, known)
            for item in state.behaviour.assignments
            if (item.peer, item.name) == output
        ]
        if len(sent) != 1 or not isinstance(sent[0], m.Input) or sent[0].key != key:
            return False
    return True


@dataclass(eq=False, slots=True)
class ContractWatch:
    """The monitor of a contract for one observer, by its index among the machines.

    One without an observer only knows commands.
    """

    contract: Requirement
    walker: Walker | None
    observer: int
    lag: int
    inputs: Mapping[str, m.Input]
    monitor: Monitor
    measured_atoms: tuple[m.Expr, ...] = ()
    """Its conditions about what the device reports."""
    _answers: dict[tuple[object, ...], TruthValue] = field(default_factory=dict)

    def __post_init__(self) -> None:
        atoms = enumerate(self.monitor.atoms)
        found = (a for i, a in atoms if i not in self.monitor.watched and self.is_measured(a))
        self.measured_atoms = tuple(dict.fromkeys(found))

    def is_measured(self, atom: m.Expr) -> bool:
        """Whether a condition reads what the device reports."""
        reported = {each.name for each in self.contract.readings if each.kind == "reported"}
        return any(isinstance(n, m.MemoryRef) and n.name in reported for n in m.walk(atom))

    def answer(self, atom: m.Expr, known: KnownValues, move: Move) -> TruthValue:
        """What a step says of a condition; `known` are the values of the device's commands."""
        condition = _with_inputs(residual(atom, known), self.inputs)
        key = condition, move.local, move.buffers, move.transition.row, move.transition.target
        if key not in self._answers:
            self._answers[key] = self._answer(condition, move)
        return self._answers[key]

    def _answer(self, condition: m.Expr, move: Move) -> TruthValue:
        if isinstance(condition, m.Truth):
            return condition.value
        # What is not known of the device has no name in the machine; what is live may have changed.
        unknown = (m.MemoryRef, m.Call)
        if m.is_live(condition) or any(isinstance(n, unknown) for n in m.walk(condition)):
            return None
        if may_fail(condition, ()):  # then a run would not call the contract broken
            return None
        walker = self.walker
        assert walker is not None  # it has an observer
        local: MachineState = walker.states.by_number[move.local]
        known = walker.known_before(local, move.buffers)
        seen = _branch_conditions(walker.cone.state[local.state].endings, move.transition.row)
        if seen is None:
            return None
        conditions = [residual(each, known) for each in seen]
        conditions = [each for each in conditions if each != m.TRUE]
        satisfiable = walker.cone.prover.satisfiable
        if not conditions:
            return None
        if satisfiable([condition, *conditions]) is False or _is_refuted(
            condition, conditions, known
        ):
            return False
        return True if satisfiable([negation(condition), *conditions]) is False else None


class Conclusions:
    """What conditions on what devices report say of one another at one tick."""

    def __init__(self, ticks: Ticks) -> None:
        self._ticks = ticks
        self._known: dict[tuple[m.Expr, bool, m.Expr], TruthValue] = {}

    def under(self, assumed: m.Expr, truth: bool, condition: m.Expr) -> TruthValue:
        """The truth of a condition where another one has a truth value."""
        if isinstance(condition, m.Truth):
            return condition.value
        key = assumed, truth, condition
        if key not in self._known:
            self._known[key] = self._under(assumed if truth else negation(assumed), condition)
        return self._known[key]

    def _under(self, assumed: m.Expr, condition: m.Expr) -> TruthValue:
        ticks, nothing = self._ticks, KnownValues({}, {}, Fraction(1))
        holds, fails = ticks.formula_at(condition), ticks.formula_at(negation(condition))
        given = ticks.formula_at(assumed)
        if may_fail(condition, ()) or any(isinstance(n, m.Call) for n in m.walk(condition)):
            return None  # then a run would not call the contract broken
        if not ticks.is_possible(given, holds) or _is_refuted(condition, [assumed], nothing):
            return False
        return None if ticks.is_possible(given, fails) else True


def contract_watches(
    contracts: Collection[Requirement],
    requirements: Collection[Requirement],
    abstraction: Abstraction,
    walkers: Sequence[Walker],
    tick_s: Fraction,
) -> list[ContractWatch]:
    """The monitors of contracts for all their observers among some machines.

    There is one without an observer if a requirement is about what the device reports.
    """
    index = {walker.name: number for number, walker in enumerate(walkers)}
    measured = {x.name for each in requirements for x in each.readings if x.kind == "reported"}
    found = []
    for contract in contracts:
        if any(each.name in measured for each in contract.readings):
            found.append(ContractWatch(contract, None, -1, 0, {}, Monitor(contract, tick_s)))
        for view in views(contract, abstraction):
            if view.machine not in index:
                continue
            number, lag = index[view.machine], int(view.lag_s / tick_s)
            monitor = Monitor(contract, tick_s, lag)
            found.append(
                ContractWatch(contract, walkers[number], number, lag, view.inputs, monitor)
            )
    return found


def _with_inputs(expr: m.Expr, inputs: Mapping[str, m.Input]) -> m.Expr:
    """An expression with inputs in place of readings."""
    if isinstance(expr, m.MemoryRef):
        return inputs.get(expr.name, expr)
    return m.map_children(expr, lambda part: _with_inputs(part, inputs))


def _branch_conditions(endings: Sequence[ConeEnding], row: int) -> list[m.Expr] | None:
    """What held in a step that took a row, or none (-1); None if that is not clear."""
    found = list[m.Expr]()
    ended_by = [end for end in endings if any(each.index == row for each in end.rows)]
    if len(ended_by) != (row >= 0):
        return None
    for end in endings:
        if end in ended_by:
            return [*found, end.when, *(each.when for each in end.rows if each.index == row)]
        found.append(negation(end.when))
    return found


# Bounds, where tables do not relate two conditions on one number.


def _is_refuted(condition: m.Expr, others: Sequence[m.Expr], known: KnownValues) -> bool:
    """Whether some of the others fail for all values of a number that a condition allows."""
    leaves = dict.fromkeys(value_leaves(condition))
    numbers = (leaf for leaf in leaves if kind(leaf.type).sort in ("whole", "real"))
    return any(_is_refuted_by(leaf, condition, others, known) for leaf in numbers)


def _is_refuted_by(
    leaf: m.Input | m.MemoryRef, condition: m.Expr, others: Sequence[m.Expr], known: KnownValues
) -> bool:
    def fails(expr: m.Expr, low: float, high: float) -> bool:
        """Whether a condition fails for all values of the number between two others."""
        within, value = replace(known, _residuals={}), BoundedUnknown(low, high)
        if isinstance(leaf, m.Input):
            within.inputs = {**known.inputs, leaf.key: value}
        else:
            within.memory = {**known.memory, leaf.name: value}
        return range_of(expr, within.range_of) == (0, 0)

    low = _last(lambda end: fails(condition, -MAX_FLOAT, end))
    high = -_last(lambda end: fails(condition, -end, MAX_FLOAT))
    return low <= high and any(fails(other, low, high) for other in others)


def _last(test: Callable[[float], bool]) -> float:
    """The greatest float that passes a test, as smaller ones do; the least one if none does."""
    low, high = -_ORDERS, _ORDERS
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if test(_float(middle)) else (low, middle - 1)
    return _float(low)


def _float(order: int) -> float:
    """The finite float in this place, counted from 0."""
    (found,) = struct.unpack("<d", struct.pack("<q", abs(order)))
    return float(found if order >= 0 else -found)


(_ORDERS,) = struct.unpack("<q", struct.pack("<d", MAX_FLOAT))
"""How many finite floats are greater than 0."""


def unsigned(expr: m.Expr) -> m.Expr:
    """A literal without the sign of zeros, which are equal in a run."""
    if isinstance(expr, m.Number):
        return replace(expr, value=expr.value + 0)
    return m.map_children(expr, unsigned)
