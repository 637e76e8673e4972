"""States that can be reached, left and ended, and do not wait forever."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import product

from specc.analysis import Facts, Machine
from specc.analysis.graph import RowEdge, all_lead_to, components, reachable_from
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.model.expr import FALSE, Expr, Fresh, LazyByDependence, LetRef, Logic, Truth, Unary
from specc.model.fsm import State, Transition
from specc.model.system import Subsystem
from specc.model.wires import Wire
from specc.proof import InputName, InputNames
from specc.reachable import grouped, reachable

# A state whose behaviour has a terminal condition can be ended by it.


def states_end(facts: Facts) -> Iterator[Diagnostic]:
    """W0614, for a state that its terminal condition, though it may hold, never ends.

    Where there are rows, they are `rows_can_apply`'s matter; a condition that never holds at all
    is `conditions_vary`'s.
    """
    for machine in facts.complete_machines:
        for state in machine.subsystem.states:
            verdict = machine.verdict(state.name, "terminal")
            if verdict.rows or verdict.decision.possible:
                continue
            condition = state.behaviour.terminal
            if machine.prover.constant(condition.when) is not False:
                names = [f"`{error.name}`" for _, error in state.behaviour.errors]
                errors = f"the error condition {names[0]} holds"
                if len(names) > 1:
                    errors = f"one of the error conditions {join_words(names, 'and')} holds"
                yield Diagnostic(
                    "W0614",
                    f"state `{state.name}` never ends by its terminal condition `{condition.name}`",
                    state.place,
                    f"{errors} whenever the terminal one does",
                    (Related(condition.place, "the terminal condition"),),
                    "write `terminal: never` if that is meant, or change a condition",
                )


# Every state can be reached from the initial one.


def states_reached(facts: Facts) -> Iterator[Diagnostic]:
    """W0607, once for each group of connected states, where the others are reached from."""
    for machine in facts.machines:
        names = [state.name for state in machine.subsystem.states]
        unreached = [name for name in names if name not in machine.reachable_states]
        if machine.is_finished and unreached:
            yield from _unreachable(machine, unreached)


def _unreachable(machine: Machine, left: list[str]) -> Iterator[Diagnostic]:
    """Components of unreachable states into which no other component leads."""
    subsystem = machine.subsystem
    entries = [each for each in enumerate(subsystem.transitions) if not each[1].is_return]
    edges = [(row.source, row.target) for _, row in entries]
    order = {name: index for index, name in enumerate(left)}
    targets = grouped(edge for edge in edges if edge[1] in order)
    entering = grouped(
        (row.target, (index, row))
        for index, row in entries
        if row.source in machine.reachable_states
    )
    reported: set[str] = set()
    for part in components(left, edges):
        ways_in = sorted(way for name in part.states for way in entering.get(name, ()))
        dead = {row.place: row for _, row in ways_in}
        if (part.has_entry and not dead) or reported.issuperset(part.states):
            continue
        first = part.states[0]
        new = reachable([first], lambda name: set(targets.get(name, ())) - reported)
        group = sorted(new, key=order.__getitem__)
        reported.update(group)
        related = []
        for row in dead.values():
            why = ": the times rule it out" if machine.dwell_times.excludes_row(row) else ""
            related.append(Related(row.place, f"this row can never be taken{why}"))
        others = (s for s in subsystem.states if s.name not in group)
        sent_elsewhere = {a.target for s in others for a in s.behaviour.assignments}
        sent = (a for name in group for a in subsystem.state(name).behaviour.assignments if a.peer)
        unsent = {a.target: a for a in sent if a.target not in sent_elsewhere}
        related += [Related(a.place, f"so `{a.target}` is never sent") for a in unsent.values()]
        named = ", ".join(f"`{name}`" for name in group)
        through = f", `{first}` would have to be entered first" if len(group) > 1 else ""
        way_in = f"add a row that leads to `{first}`"
        yield Diagnostic(
            "W0607",
            f"{'state' if len(group) == 1 else 'states'} {named} cannot be reached from "
            f"`{subsystem.initial_state}`",
            subsystem.state(first).place,
            f"never entered{through}",
            tuple(related),
            f"{'make the condition of the row possible' if dead else way_in}, "
            "or delete what is not needed",
        )


# No state holds its machine for ever unless the specification says so with `never`.


def states_can_be_left(facts: Facts) -> Iterator[Diagnostic]:
    """W0612, once for states that only lead to one another."""
    for machine in facts.complete_machines:
        if not machine.has_known_edges:
            continue
        subsystem, reached = machine.subsystem, machine.reachable_states
        edges = [(step.row.source, step.row.target) for step in machine.edges]
        if all_lead_to(subsystem.initial_state, edges, reached):
            continue
        names = [state.name for state in subsystem.states if state.name in reached]
        found = components(names, edges)
        cycles = sum(len(part.states) > 1 for part in found)
        for part in found:
            # Several states are a trap if other states form a cycle, which is then left for good.
            # Otherwise the others are the steps that lead to the work. A single state is the end if
            # nothing ends it.
            first, is_one = subsystem.state(part.states[0]), len(part.states) == 1
            is_trap = (first.name, first.name) in edges if is_one else cycles > 1
            if part.has_exit or not is_trap:
                continue
            named = join_words([f"`{name}`" for name in part.states], "and")
            rows = {r.place: r for r in subsystem.transitions if r.source in part.states}
            help = "add a row that leads back to the other states"
            if is_one:
                help = f"add a row that leads on, or make `{first.name}` an intended end "
                help += "with a behaviour that has `terminal: never`"
            yield Diagnostic(
                "W0612",
                f"{'state' if is_one else 'states'} {named} cannot be left once entered",
                first.place,
                "no row leads out",
                tuple(Related(place, "does not lead out") for place in [*rows][:4]),
                help,
            )


# Implicants of a condition in terms of freshness: sets of inputs, all of one of which must be fresh
# for it to hold.
#
# Other questions are left out, so that a condition has rather too many implicants than too few.


Implicants = tuple[InputNames, ...]
FREE: Implicants = (frozenset(),)
_MOST = 64


def conjunction_implicants(parts: Iterable[Implicants]) -> Implicants:
    """The implicants of a conjunction."""
    found = FREE
    for part in parts:
        found = minimal_implicants(one | other for one, other in product(found, part))
    return found


def minimal_implicants(implicants: Iterable[InputNames]) -> Implicants:
    """The minimal implicants, or `FREE` if there are more than `_MOST`."""
    found: list[InputNames] = []
    for inputs in sorted(set(implicants), key=lambda i: (len(i), sorted(i))):
        if not any(other <= inputs for other in found):
            found.append(inputs)
    return tuple(found) if len(found) <= _MOST else FREE


class RowNeeds:
    """The rows that a machine may take, and what must be fresh for each of them."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.subsystem = machine.subsystem
        lets = {item.name: item.value for item in machine.subsystem.lets}
        self._of_lets = LazyByDependence(
            lets, lambda name: tuple(self._implicants(lets[name], yes) for yes in (False, True))
        )
        self._of_rows: dict[tuple[str, str, str], Implicants] = {}
        self.predecessors = grouped((step.row.target, step) for step in machine.edges)

    def needed(self, row: Transition) -> Implicants:
        """The implicants of a row: inputs that must be fresh for it to be taken."""
        end = self.subsystem.state(row.source).behaviour.ending(row.cause)
        key = row.cause, end.name, row.condition.name
        if key not in self._of_rows:
            self._of_rows[key] = conjunction_implicants(
                map(self._implicants, (end.when, row.condition.when))
            )
        return self._of_rows[key]

    def ways_out(self, state: str) -> Implicants:
        """The implicants of leaving a state, or of its self-loops if no row leaves it."""
        steps = self.machine.successors.get(state, [])
        found: set[InputNames] = set()
        for step in [s for s in steps if s.row.target != state] or steps:
            found.update(self.needed(step.row))
            if frozenset() in found:
                return FREE
        return minimal_implicants(found)

    def _implicants(self, expr: Expr, holds: bool = True) -> Implicants:
        """The implicants of a condition or of its negation."""
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
                    return conjunction_implicants(parts)
                return minimal_implicants(inputs for part in parts for inputs in part)
        return FREE


# What a state waits for, and whether the subsystem that is to send it may come to rest without.


@dataclass(frozen=True, slots=True)
class RestingState:
    """A `state` of a sender from which it never sends what the waiting state needs.

    `row` is the row of the sender that accepts what the waiting subsystem sent earlier and no
    longer sends, if such a row leads there.
    """

    sender: Machine
    state: State
    row: Transition | None


class Waiting:
    """Finds states that wait for a sender that may rest."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._needs: dict[str, RowNeeds] = {}
        self._waits: dict[tuple[str, str, frozenset[InputNames]], Wait] = {}

    def unserved(self, reader: Machine) -> Iterator[tuple[State, InputNames, RestingState]]:
        """Yield states that wait for a sender that may rest, what they need, and where it rests."""
        rows = self._needs_of(reader)
        for state in reader.subsystem.states:
            found = rows.ways_out(state.name) if state.name in reader.reachable_states else FREE
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

    def _needs_of(self, machine: Machine) -> RowNeeds:
        name = machine.subsystem.qualified_name
        if name not in self._needs:
            self._needs[name] = RowNeeds(machine)
        return self._needs[name]

    def _wait(self, reader: Machine, wire: Wire, needs: frozenset[InputNames]) -> Wait | None:
        """The `Wait` that states with these needs share; None if the wire has no sender."""
        key = reader.subsystem.qualified_name, wire.port.peer, needs
        if key not in self._waits:
            if wire.peer_subsystem is None or wire.peer_port is None:
                return None
            ends = self._needs_of(reader), self._needs_of(self._facts.of(wire.peer_subsystem))
            senders = self._facts.wires.wires_to(wire.subsystem.qualified_name, "x")
            back = next((w for w in senders if w.subsystem is wire.peer_subsystem), None)
            self._waits[key] = Wait(*ends, wire, back, needs)
        return self._waits[key]


@dataclass(frozen=True, eq=False)
class Wait:
    """States of `reader` that need, on each of their ways out, something of `sender`.

    `wire` is that of the input; `back` is that on which the reader sends to the sender, if it does.
    """

    reader: RowNeeds
    sender: RowNeeds
    wire: Wire
    back: Wire | None
    needs: frozenset[InputNames]
    _unanswered: dict[tuple[InputNames, InputNames], RestingState | None] = field(
        default_factory=dict
    )

    def rest_in(self, state: State) -> RestingState | None:
        """Where the sender may rest while the reader is in a state."""
        if self._serving.isdisjoint(self.sender.machine.reachable_states):
            return None  # said of the element, or of the state that would send it
        if self._rest is not None and self.reader.machine.is_on_cycle(state.name):
            return self._rest
        still_sent = self._sent_in(state)
        before = {step.row.source for step in self.reader.predecessors.get(state.name, ())}
        states = map(self.reader.subsystem.state, before - {state.name})
        no_longer_sent = frozenset[InputName]().union(*map(self._sent_in, states)) - still_sent
        if (no_longer_sent, still_sent) not in self._unanswered:
            self._unanswered[no_longer_sent, still_sent] = self._rest_unanswered(
                no_longer_sent, still_sent
            )
        return self._unanswered[no_longer_sent, still_sent]

    @cached_property
    def _serving(self) -> frozenset[str]:
        """The states of the sender that send all that one way out needs."""
        return frozenset(
            s.name
            for s in self.sender.subsystem.states
            if any(need <= self.wire.inputs_sent_by(s.behaviour) for need in self.needs)
        )

    @cached_property
    def _rest(self) -> RestingState | None:
        """Where the sender may come to rest whatever is sent to it."""
        machine = self.sender.machine
        resting = self._resting(machine.edges) & machine.reachable_states
        if not resting or _gives_up_work(resting, machine.reachable_states, machine.edges):
            return None
        return RestingState(machine, _first(resting, machine.subsystem), None)

    def _rest_unanswered(
        self, no_longer_sent: InputNames, still_sent: InputNames
    ) -> RestingState | None:
        """Where the sender may rest after consuming what the reader sent before this state.

        The reader no longer sends `spent`, and still sends `still`.
        """
        machine, peers = self.sender.machine, {peer for peer, _ in no_longer_sent}
        free: list[RowEdge] = []
        taking: list[RowEdge] = []
        for step in machine.edges if no_longer_sent else ():
            found = self.sender.needed(step.row)
            bound = all(any(n[0] in peers and n not in still_sent for n in i) for i in found)
            if not bound:
                free.append(step)
            elif any(inputs & no_longer_sent for inputs in found):
                taking.append(step)
        resting = self._resting(free) if taking else frozenset()
        silent = [s for s in free if not {s.row.source, s.row.target} & self._serving]
        leaving = grouped((step.row.source, step) for step in silent)
        for step in taking if resting else ():
            if step.row.target not in self._serving:
                here = resting & reachable_from(step.row.target, leaving)
                if here:
                    return RestingState(machine, _first(here, machine.subsystem), step.row)
        return None

    def _sent_in(self, state: State) -> InputNames:
        """The inputs of the sender that a state of the reader sends."""
        return self.back.inputs_sent_by(state.behaviour) if self.back else frozenset()

    def _resting(self, steps: Iterable[RowEdge]) -> frozenset[str]:
        """States from which the sender can reach neither a sending state nor a declared end."""
        sources = grouped((step.row.target, step.row.source) for step in steps)
        states = self.sender.subsystem.states
        ends = (s.name for s in states if s.behaviour.terminal.when == FALSE)
        active = reachable((*self._serving, *ends), lambda name: sources.get(name, ()))
        return frozenset(s.name for s in states if s.name not in active)


def _first(names: frozenset[str], subsystem: Subsystem) -> State:
    return next(state for state in subsystem.states if state.name in names)


def _gives_up_work(
    resting: frozenset[str], reached: frozenset[str], steps: Sequence[RowEdge]
) -> bool:
    """Whether the resting states are a trap, which `states_can_be_left` reports."""
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
        for state, needed, rest in waiting.unserved(machine):
            if rest.sender.has_known_edges:
                names = [f"`x.{peer}.{element}`" for peer, element in sorted(needed)]
                sender = f"`{rest.sender.subsystem.qualified_name}`"
                related = [Related(rest.state.place, f"from here on {sender} never sends it")]
                if rest.row is not None:
                    words = f"here {sender} accepts what it was sent before"
                    where = f"may come to `{rest.state.name}` without an answer"
                    related = [Related(rest.row.place, words), Related(rest.state.place, where)]
                yield Diagnostic(
                    "W0417",
                    f"state `{state.name}` may wait forever for {join_words(names, 'or')}",
                    state.place,
                    "nothing else ends it",
                    tuple(related),
                    f"let {sender} send it on every path, or leave `{state.name}` after some time, "
                    "with `elapsed`; if the sender is meant to end there, say so with "
                    "`terminal: never`",
                )
