"""Bottom components: strongly connected components of configurations that no edge leaves.

A machine that does not change its state in such a component never will. The abstraction has more
runs than the system, never fewer. So a machine that cannot leave its state in the component cannot
leave it in any run that comes there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from specc.analysis.graph import components, last_components
from specc.model import expr as m
from specc.model.fsm import State
from specc.proof import InputName
from specc.reachable import grouped, reachable
from specc.tools.explore.abstraction import Abstraction, conditions_of
from specc.tools.explore.graph import Graph
from specc.tools.explore.symmetry import Permutation, composed
from specc.tools.explore.trace import ExploredTrace, easiest_trace
from specc.tools.explore.walker import Walker


@dataclass(frozen=True, slots=True)
class StuckMachine:
    """A machine that stays in a state, or in a cycle of states, although rows lead to others.

    `needed` are the inputs that these rows read; `missing` are those that nobody sends any more.
    The machine `is_blocked` if it takes no row at all, not even back to its state.
    """

    index: int
    state: State
    needed: frozenset[InputName]
    missing: frozenset[InputName]
    is_blocked: bool
    is_cycling: bool

    @property
    def awaited(self) -> frozenset[InputName]:
        """The inputs that it waits for."""
        return self.missing or self.needed


@dataclass
class BottomComponent:
    """A bottom component: the numbers of its configurations, and the moves in it."""

    graph: Graph
    abstraction: Abstraction
    members: frozenset[int]
    rows: set[tuple[int, int]] = field(default_factory=set)
    """Machine and index of each row that is taken in it."""
    states: dict[int, set[str]] = field(default_factory=dict)
    sent: set[tuple[int, InputName]] = field(default_factory=set)
    """Machine and output of each value that is sent in it."""

    def __post_init__(self) -> None:
        self.states = {index: set() for index in range(len(self.graph.composition.walkers))}
        composition, frames = self.graph.composition, self._frames()
        for number, frame in frames.items():
            for edge in self.graph.continuing_edges(number):
                for index, move in (
                    composition.real_transition(frame, *each) for each in edge.transitions
                ):
                    self.states[index] |= {move.source, move.target}
                    self.sent |= {(index, key) for key, _ in move.sent}
                    if move.row >= 0:
                        self.rows.add((index, move.row))
        self._apply_exchanges(self._exchanges(frames))

    # Where copies are put in order, a path back to a configuration may have exchanged them. Then
    # each copy does whatever the others do.

    def _frames(self) -> dict[int, Permutation]:
        """The frame of each configuration (machine -> real machine), on paths from the entry."""
        if not self.graph.composition.copies:
            return dict.fromkeys(self.members, self.graph.frame(min(self.members)))
        found = {self.entry: self.graph.frame(self.entry)}
        waiting = [self.entry]
        for number in waiting:
            for edge in self.graph.continuing_edges(number):
                if edge.target not in found:
                    found[edge.target] = composed(found[number], edge.permutation)
                    waiting.append(edge.target)
        return found

    def _exchanges(self, frames: dict[int, Permutation]) -> set[Permutation]:
        """The permutations of machines that some path back makes."""
        if not self.graph.composition.copies:
            return set()
        found = set()
        for number, frame in frames.items():
            for edge in self.graph.continuing_edges(number):
                target = frames[edge.target]
                became = dict(zip(target, composed(frame, edge.permutation), strict=True))
                found.add(tuple(became[index] for index in range(len(target))))
        return found - {tuple(range(len(self.walkers)))}

    def _apply_exchanges(self, exchanges: set[Permutation]) -> None:
        """Give the rows, states and outputs of a machine to the machines exchanged with it."""
        composition, before = self.graph.composition, -1
        while exchanges and before != (before := self._count()):
            for frame in exchanges:
                for index, became in enumerate(frame):
                    self.states[became] |= self.states[index]
                self.rows |= {(frame[index], row) for index, row in self.rows}
                self.sent |= {
                    (frame[i], composition.real_name(frame, i, key, is_sent=True))
                    for i, key in self.sent
                }

    def _count(self) -> int:
        return sum(map(len, self.states.values())) + len(self.rows) + len(self.sent)

    @cached_property
    def entry(self) -> int:
        """The configuration with the easiest path to it."""
        return min(self.members, key=lambda number: (self.graph.cost(number), number))

    @cached_property
    def trace(self) -> ExploredTrace:
        """The trace to the entry."""
        return easiest_trace(self.graph, self.entry)

    @property
    def walkers(self) -> tuple[Walker, ...]:
        """The machines."""
        return self.graph.composition.walkers

    @property
    def is_static(self) -> bool:
        """Whether no machine ever changes its state again."""
        return all(len(states) == 1 for states in self.states.values())

    def sender(self, index: int, key: InputName) -> tuple[int, InputName]:
        """The machine that sends an input of another one, and its output there."""
        walker = self.walkers[index]
        sent = self.abstraction.sender_of(walker.name, key)
        assert sent is not None  # only such inputs are tracked
        return self.graph.composition.names.index(sent[0]), sent[1]

    @cached_property
    def stuck(self) -> dict[int, StuckMachine]:
        """The machines that wait unintendedly in one state although rows lead on.

        A machine that changes its state is at work.
        """
        intended = {stuck.index for stuck in self.intended_waits}
        return {i: s for i, s in self._waiting.items() if i not in intended and not s.is_cycling}

    @cached_property
    def intended_waits(self) -> list[StuckMachine]:
        """The machines that wait for a sender at a declared end, directly or through others."""
        found = self._waiting
        intended = [
            i for i, s in found.items() if any(self._sender_has_ended(i, k) for k in s.awaited)
        ]
        waiters = grouped((j, i) for i in found for j in self._blocking_senders(found[i]))
        return [found[index] for index in sorted(reachable(intended, lambda i: waiters.get(i, ())))]

    def _blocking_senders(self, stuck: StuckMachine) -> Iterator[int]:
        """The waiting machines that would send the awaited inputs."""
        for key in stuck.awaited:
            sender, output = self.sender(stuck.index, key)
            other = self._waiting.get(sender)
            if other is not None and (not other.is_cycling or self._would_send(sender, output)):
                yield sender

    def _would_send(self, index: int, output: InputName) -> bool:
        """Whether a machine sends an output in states that it does not reach here."""
        states = (
            s for s in self.walkers[index].subsystem.states if s.name not in self.states[index]
        )
        sent = ((a.peer, a.name) for s in states for a in s.behaviour.assignments)
        return output in sent

    @cached_property
    def _waiting(self) -> dict[int, StuckMachine]:
        return {stuck.index: stuck for stuck in self._find_waiting()}

    def _find_waiting(self) -> Iterator[StuckMachine]:
        for index, walker in enumerate(self.walkers):
            states = self.states[index]
            conditions = self._exit_conditions(walker, states)
            if conditions:
                needs = walker.cone.dependences.all(conditions).inputs & walker.slots.keys()
                missing = frozenset(k for k in needs if self.sender(index, k) not in self.sent)
                blocked = not any(one == index for one, _ in self.rows)
                state = walker.subsystem.state(min(states))
                yield StuckMachine(
                    index, state, frozenset(needs), missing, blocked, len(states) > 1
                )

    def _exit_conditions(self, walker: Walker, states: set[str]) -> list[m.Expr]:
        """The conditions of the rows that lead out of a set of states."""
        rows = [step.row for step in self.abstraction.machines[walker.name].analysis.edges]
        away = [row for row in rows if row.source in states and row.target not in states]
        ends = {name: dict(walker.subsystem.state(name).behaviour.endings) for name in states}
        return [e for row in away for e in (ends[row.source][row.cause].when, row.condition.when)]

    def _sender_has_ended(self, index: int, key: InputName) -> bool:
        """Whether the sender of an input stays in a state without conditions.

        If that is its initial state, it only counts if it does not send the input there.
        """
        sender, output = self.sender(index, key)
        is_initial = self.states[sender] == {self.walkers[sender].subsystem.initial_state}
        return self.is_at_end(sender) and (not is_initial or (sender, output) not in self.sent)

    def is_at_end(self, index: int) -> bool:
        """Whether a machine stays in one state without any condition."""
        (state, *others) = self.states[index]
        return not others and not list(conditions_of(self.walkers[index].subsystem, state))

    def awaited_senders(self, stuck: StuckMachine) -> frozenset[int]:
        """The machines that send the awaited inputs."""
        return frozenset(self.sender(stuck.index, key)[0] for key in stuck.awaited)

    @cached_property
    def wait_cycles(self) -> list[tuple[int, ...]]:
        """Machines that wait for one another."""
        names = {str(i): i for i in self.stuck}
        edges = [(str(i), str(j)) for i, s in self.stuck.items() for j in self.awaited_senders(s)]
        found = components(tuple(names), edges)
        return [tuple(names[n] for n in c.states) for c in found if len(c.states) > 1]

    @cached_property
    def root_causes(self) -> list[StuckMachine]:
        """The machines that cannot go on, without those that wait for another such machine.

        A machine that only takes rows back to its state is at rest, unless no machine changes its
        state any more and it waits for an input that nobody sends.
        """
        cyclic = {i for each in self.wait_cycles for i in each}
        stuck = {
            i
            for i, s in self.stuck.items()
            if i not in cyclic and (s.is_blocked or (self.is_static and s.missing))
        }
        found = []
        for index in sorted(stuck):
            waited = reachable(
                [index], lambda i: self.awaited_senders(self.stuck[i]) & self.stuck.keys()
            )
            if not waited.keys() & (cyclic | stuck) - {index}:
                found.append(self.stuck[index])
        return found


def terminal_components(graph: Graph, abstraction: Abstraction) -> list[BottomComponent]:
    """The bottom components that were explored completely, in the order of their discovery."""
    beyond = range(len(graph.edges), len(graph.configurations))
    following = {n: {e.target for e in graph.continuing_edges(n)} for n in range(len(graph.edges))}
    before = grouped((target, here) for here, out in following.items() for target in out)
    leaving = reachable(beyond, lambda number: before.get(number, ()))
    closed = {number: out for number, out in following.items() if number not in leaving}
    found = last_components(closed)
    return [BottomComponent(graph, abstraction, each) for each in found if closed[min(each)]]
