"""States that wait for what their senders never send, or may never send again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import product

from specc.analysis import Facts, Machine
from specc.analysis.graph import RowEdge, reached_from
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import listed
from specc.lang.dependence_order import InDependenceOrder
from specc.model.expr import Expr, Fresh, LetRef, Logic, Truth, Unary
from specc.model.fsm import State, Transition
from specc.model.system import Subsystem
from specc.model.wires import Wire
from specc.proof import InputName, InputNames
from specc.reachable import grouped, reachable

# Implicants of a condition in terms of freshness: sets of inputs, all of one of which must be fresh
# for it to hold.
#
# Other questions are left out, so that a condition has rather too many implicants than too few.


Implicants = tuple[InputNames, ...]
FREE: Implicants = (frozenset(),)
_MOST = 64


def all_of(parts: Iterable[Implicants]) -> Implicants:
    """The implicants of a conjunction."""
    found = FREE
    for part in parts:
        found = least(one | other for one, other in product(found, part))
    return found


def least(implicants: Iterable[InputNames]) -> Implicants:
    """Those that need no more than another one does; too many count as no need at all."""
    found: list[InputNames] = []
    for inputs in sorted(set(implicants), key=lambda i: (len(i), sorted(i))):
        if not any(other <= inputs for other in found):
            found.append(inputs)
    return tuple(found) if len(found) <= _MOST else FREE


class Moves:
    """The rows that a machine may take, and what must be fresh for each of them."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.subsystem = machine.subsystem
        lets = {item.name: item.value for item in machine.subsystem.lets}
        self._of_lets = InDependenceOrder(
            lets, lambda name: tuple(self._implicants(lets[name], yes) for yes in (False, True))
        )
        self._of_rows: dict[tuple[str, str, str], Implicants] = {}
        self.entering = grouped((step.row.target, step) for step in machine.steps)

    def needed(self, row: Transition) -> Implicants:
        """What must be fresh for a row to be taken."""
        end = self.subsystem.state(row.source).behaviour.ending(row.cause)
        key = row.cause, end.name, row.condition.name
        if key not in self._of_rows:
            self._of_rows[key] = all_of(map(self._implicants, (end.when, row.condition.when)))
        return self._of_rows[key]

    def ways_out(self, state: str) -> Implicants:
        """What the ways out of a state need: those to others or, without these, to itself."""
        steps = self.machine.leaving.get(state, [])
        found: set[InputNames] = set()
        for step in [s for s in steps if s.row.target != state] or steps:
            found.update(self.needed(step.row))
            if frozenset() in found:
                return FREE
        return least(found)

    def returns(self, state: str) -> bool:
        """Whether a state can be entered again after it was left."""

        def following(name: str) -> list[str]:
            return [step.row.target for step in self.machine.leaving.get(name, ())]

        return state in reachable(following(state), following)

    def _implicants(self, expr: Expr, holds: bool = True) -> Implicants:
        """Those of a condition that holds, or does not."""
        match expr:
            case Truth(value=value):
                return FREE if value == holds else ()
            case Fresh(input=element) if holds:
                return (frozenset((element.key,)),)
            case Unary(op="not", operand=operand):
                return self._implicants(operand, not holds)
            case LetRef(name=name) if name in self._of_lets:
                return self._of_lets[name][holds]
            case Logic(op=op, operands=operands):
                parts = [self._implicants(part, holds) for part in operands]
                if (op == "and") == holds:
                    return all_of(parts)
                return least(inputs for part in parts for inputs in part)
        return FREE


# What a state waits for, and whether the subsystem that is to send it may come to rest without.


@dataclass(frozen=True, slots=True)
class Rest:
    """A sender gets to `state` and from there never sends what the waiting state needs.

    `row` is the row of the sender that accepts what the waiting subsystem sent earlier and no
    longer sends, if such a row leads there.
    """

    sender: Machine
    state: State
    row: Transition | None


class Waiting:
    """Follows two machines that are connected."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._moves: dict[str, Moves] = {}
        self._waits: dict[tuple[str, str, frozenset[InputNames]], Wait] = {}

    def in_vain(self, reader: Machine) -> Iterator[tuple[State, InputNames, Rest]]:
        """States with what every way out of them needs of one sender, and where that may rest."""
        moves = self._moves_of(reader)
        for state in reader.subsystem.states:
            found = moves.ways_out(state.name) if state.name in reader.reached else FREE
            for wire in (
                self._facts.wires.wires_of(reader.subsystem) if found and all(found) else ()
            ):
                peer = wire.port.peer
                needs = frozenset(frozenset(n for n in each if n[0] == peer) for each in found)
                if wire.port.direction == "x" and all(needs):
                    wait = self._wait(reader, wire, needs)
                    rest = wait.rest_in(state) if wait else None
                    if rest is not None:
                        yield state, frozenset().union(*needs), rest

    def _moves_of(self, machine: Machine) -> Moves:
        name = machine.subsystem.qualified_name
        if name not in self._moves:
            self._moves[name] = Moves(machine)
        return self._moves[name]

    def _wait(self, reader: Machine, wire: Wire, needs: frozenset[InputNames]) -> Wait | None:
        """What many states may wait for, which is looked into once."""
        key = reader.subsystem.qualified_name, wire.port.peer, needs
        if key not in self._waits:
            if wire.peer_subsystem is None or wire.peer_port is None:
                return None
            moves = self._moves_of(reader), self._moves_of(self._facts.of(wire.peer_subsystem))
            senders = self._facts.wires.wires_to(wire.subsystem.qualified_name, "x")
            back = next((w for w in senders if w.subsystem is wire.peer_subsystem), None)
            self._waits[key] = Wait(*moves, wire, back, needs)
        return self._waits[key]


@dataclass(frozen=True, eq=False)
class Wait:
    """States of `reader` that need, on each of their ways out, something of `sender`.

    `wire` is that of the input; `back` is that on which the reader sends to the sender, if it does.
    """

    reader: Moves
    sender: Moves
    wire: Wire
    back: Wire | None
    needs: frozenset[InputNames]
    _unanswered: dict[tuple[InputNames, InputNames], Rest | None] = field(default_factory=dict)

    def rest_in(self, state: State) -> Rest | None:
        """Where the sender may rest while the reader is in a state."""
        if self._served.isdisjoint(self.sender.machine.reached):
            return None  # said of the element, or of the state that would send it
        if self._rest is not None and self.reader.returns(state.name):
            return self._rest
        still = self._asks(state)
        spent = self._sent_before(state) - still
        if (spent, still) not in self._unanswered:
            self._unanswered[spent, still] = self._rest_unanswered(spent, still)
        return self._unanswered[spent, still]

    @cached_property
    def _served(self) -> frozenset[str]:
        """The states of the sender that send all that some way out needs."""
        return frozenset(
            s.name
            for s in self.sender.subsystem.states
            if any(need <= self.wire.inputs_sent_by(s.behaviour) for need in self.needs)
        )

    @cached_property
    def _rest(self) -> Rest | None:
        """Where the sender may come to rest whatever is sent to it."""
        machine = self.sender.machine
        resting = self._resting(machine.steps) & machine.reached
        if not resting or _is_trap(resting, machine.reached, machine.steps):
            return None
        return Rest(machine, _first(resting, machine.subsystem), None)

    def _rest_unanswered(self, spent: InputNames, still: InputNames) -> Rest | None:
        """Where the sender may rest after it has taken up what was sent before this state.

        `spent` is no longer sent, `still` is still sent.
        """
        machine, peers = self.sender.machine, {peer for peer, _ in spent}
        free: list[RowEdge] = []
        taking: list[RowEdge] = []
        for step in machine.steps if spent else ():
            found = self.sender.needed(step.row)
            bound = all(any(n[0] in peers and n not in still for n in i) for i in found)
            if not bound:
                free.append(step)
            elif any(inputs & spent for inputs in found):
                taking.append(step)
        resting = self._resting(free) if taking else frozenset()
        silent = [s for s in free if not {s.row.source, s.row.target} & self._served]
        leaving = grouped((step.row.source, step) for step in silent)
        for step in taking if resting else ():
            if step.row.target not in self._served:
                here = resting & reached_from(step.row.target, leaving)
                if here:
                    return Rest(machine, _first(here, machine.subsystem), step.row)
        return None

    def _sent_before(self, state: State) -> InputNames:
        """What the states before the waiting one send to the one that is waited for."""
        before = {step.row.source for step in self.reader.entering.get(state.name, ())}
        states = map(self.reader.subsystem.state, before - {state.name})
        return frozenset[InputName]().union(*map(self._asks, states))

    def _asks(self, state: State) -> InputNames:
        """What a state of the reader sends to the sender, as that calls it."""
        return self.back.inputs_sent_by(state.behaviour) if self.back else frozenset()

    def _resting(self, steps: Iterable[RowEdge]) -> frozenset[str]:
        """States from which the sender can reach neither a sending state nor a declared end."""
        sources = grouped((step.row.target, step.row.source) for step in steps)
        states = self.sender.subsystem.states
        ends = (s.name for s in states if _is_end(s))
        active = reachable((*self._served, *ends), lambda name: sources.get(name, ()))
        return frozenset(s.name for s in states if s.name not in active)


def _first(names: frozenset[str], subsystem: Subsystem) -> State:
    return next(state for state in subsystem.states if state.name in names)


def _is_end(state: State) -> bool:
    when = state.behaviour.terminal.when
    return isinstance(when, Truth) and not when.value


def _is_trap(resting: frozenset[str], reached: frozenset[str], steps: Sequence[RowEdge]) -> bool:
    """Whether the machine gives up other work there, which is a finding of its own."""
    edges = {(s.row.source, s.row.target) for s in steps}
    if any((name, name) in edges for name in resting):
        return True
    outside = grouped(e for e in edges if e[0] in reached - resting and e[1] not in resting)
    try:
        TopologicalSorter(outside).prepare()
    except CycleError:
        return True
    return False


# What a state waits for is sent, however the sender goes on.


def waits_end(facts: Facts) -> Iterator[Diagnostic]:
    """W0417, once for each sender that a state may wait for forever."""
    waiting = Waiting(facts)
    for machine in facts.complete_machines:
        for state, needed, rest in waiting.in_vain(machine):
            if rest.sender.ways_are_known:
                yield _finding(state, needed, rest)


def _finding(state: State, needed: InputNames, rest: Rest) -> Diagnostic:
    names = [f"`x.{peer}.{element}`" for peer, element in sorted(needed)]
    sender = f"`{rest.sender.subsystem.qualified_name}`"
    related = [Related(rest.state.place, f"from here on {sender} never sends it")]
    if rest.row is not None:
        words = f"here {sender} accepts what it was sent before"
        where = f"may come to `{rest.state.name}` without an answer"
        related = [Related(rest.row.place, words), Related(rest.state.place, where)]
    return Diagnostic(
        "W0417",
        f"state `{state.name}` may wait forever for {listed(names, 'or')}",
        state.place,
        "nothing else ends it",
        tuple(related),
        f"let {sender} send it on every path, or leave `{state.name}` after some time, with "
        "`elapsed`; if the sender is meant to end there, say so with `terminal: never`",
    )


USES = (waits_end,)
