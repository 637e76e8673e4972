"""Bottom components: strongly connected components of configurations that no edge leaves.

A machine that does not change its state in such a component never will. The abstraction has more
runs than the system, never fewer. So a machine without a way on in the component has none in any
run that comes there.
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
from specc.tools.explore.symmetry import Permutation, turned
from specc.tools.explore.trace import ExploredTrace, trace
from specc.tools.explore.walker import Walker


@dataclass(frozen=True, slots=True)
class Stuck:
    """A machine that stays in a state, or in a cycle of states, although rows lead to others.

    `needs` are the inputs that these rows ask about; `missing` are the needed inputs that nobody
    sends any more. The machine is `blocked` if it takes no row at all, not even back to its state.
    """

    index: int
    state: State
    needs: frozenset[InputName]
    missing: frozenset[InputName]
    blocked: bool
    goes_round: bool

    @property
    def awaited(self) -> frozenset[InputName]:
        """The inputs that it waits for."""
        return self.missing or self.needs


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
            for edge in self.graph.going_on(number):
                for index, move in (composition.real_move(frame, *each) for each in edge.moves):
                    self.states[index] |= {move.source, move.target}
                    self.sent |= {(index, key) for key, _ in move.sent}
                    if move.row >= 0:
                        self.rows.add((index, move.row))
        self._spread(self._exchanges(frames))

    # Where copies are put in order, a path back to a configuration may have exchanged them. Then
    # each copy does whatever the others do.

    def _frames(self) -> dict[int, Permutation]:
        """The frame of each configuration (machine -> real machine), on paths from the entry."""
        if not self.graph.composition.copies:
            return dict.fromkeys(self.members, self.graph.frame(min(self.members)))
        found = {self.entry: self.graph.frame(self.entry)}
        waiting = [self.entry]
        for number in waiting:
            for edge in self.graph.going_on(number):
                if edge.target not in found:
                    found[edge.target] = turned(found[number], edge.turn)
                    waiting.append(edge.target)
        return found

    def _exchanges(self, frames: dict[int, Permutation]) -> set[Permutation]:
        """The permutations of machines that some path back makes."""
        if not self.graph.composition.copies:
            return set()
        found = set()
        for number, frame in frames.items():
            for edge in self.graph.going_on(number):
                there = frames[edge.target]
                became = dict(zip(there, turned(frame, edge.turn), strict=True))
                found.add(tuple(became[index] for index in range(len(there))))
        return found - {tuple(range(len(self.walkers)))}

    def _spread(self, exchanges: set[Permutation]) -> None:
        """Give the rows, states and outputs of a machine to the machines exchanged with it."""
        composition, before = self.graph.composition, -1
        while exchanges and before != (before := self._size()):
            for frame in exchanges:
                for index, became in enumerate(frame):
                    self.states[became] |= self.states[index]
                self.rows |= {(frame[index], row) for index, row in self.rows}
                self.sent |= {
                    (frame[i], composition.real(frame, i, key, is_sent=True))
                    for i, key in self.sent
                }

    def _size(self) -> int:
        return sum(map(len, self.states.values())) + len(self.rows) + len(self.sent)

    @cached_property
    def entry(self) -> int:
        """The configuration with the easiest path to it."""
        return min(self.members, key=lambda number: (self.graph.cost(number), number))

    @cached_property
    def way(self) -> ExploredTrace:
        """The trace to the entry."""
        return trace(self.graph, self.entry)

    @property
    def walkers(self) -> tuple[Walker, ...]:
        """The machines."""
        return self.graph.composition.walkers

    @property
    def still(self) -> bool:
        """Whether no machine ever changes its state again."""
        return all(len(states) == 1 for states in self.states.values())

    def sender(self, index: int, key: InputName) -> tuple[int, InputName]:
        """The machine that sends an input of another one, and its output there."""
        walker = self.walkers[index]
        sent = self.abstraction.sender_of(walker.name, key)
        assert sent is not None  # only such inputs are kept
        return self.graph.composition.names.index(sent[0]), sent[1]

    @cached_property
    def stuck(self) -> dict[int, Stuck]:
        """The machines that wait in one state although rows lead on, without intended waits.

        A machine that goes from state to state is at work.
        """
        meant = {stuck.index for stuck in self.resting}
        return {i: s for i, s in self._staying.items() if i not in meant and not s.goes_round}

    @cached_property
    def resting(self) -> list[Stuck]:
        """The machines that wait for a sender at a declared end, directly or through others."""
        found = self._staying
        meant = [i for i, s in found.items() if any(self._ended(i, k) for k in s.awaited)]
        behind = grouped((j, i) for i in found for j in self._held_up(found[i]))
        return [found[index] for index in sorted(reachable(meant, lambda i: behind.get(i, ())))]

    def _held_up(self, stuck: Stuck) -> Iterator[int]:
        """The waiting machines that would send the inputs that one waits for."""
        for key in stuck.awaited:
            sender, output = self.sender(stuck.index, key)
            other = self._staying.get(sender)
            if other is not None and (not other.goes_round or self._would_send(sender, output)):
                yield sender

    def _would_send(self, index: int, output: InputName) -> bool:
        """Whether a machine sends an output in states that it does not reach here."""
        states = (
            s for s in self.walkers[index].subsystem.states if s.name not in self.states[index]
        )
        sent = ((a.peer, a.name) for s in states for a in s.behaviour.assignments)
        return output in sent

    @cached_property
    def _staying(self) -> dict[int, Stuck]:
        return {stuck.index: stuck for stuck in self._stays()}

    def _stays(self) -> Iterator[Stuck]:
        for index, walker in enumerate(self.walkers):
            states = self.states[index]
            ways = self._ways(walker, states)
            if ways:
                needs = walker.cone.rests.all(ways).inputs & walker.slots.keys()
                missing = frozenset(k for k in needs if self.sender(index, k) not in self.sent)
                blocked = not any(one == index for one, _ in self.rows)
                state = walker.subsystem.state(min(states))
                yield Stuck(index, state, frozenset(needs), missing, blocked, len(states) > 1)

    def _ways(self, walker: Walker, states: set[str]) -> list[m.Expr]:
        """The conditions of the rows that lead out of a set of states."""
        rows = [step.row for step in self.abstraction.kept[walker.name].machine.edges]
        away = [row for row in rows if row.source in states and row.target not in states]
        ends = {name: dict(walker.subsystem.state(name).behaviour.endings) for name in states}
        return [e for row in away for e in (ends[row.source][row.cause].when, row.condition.when)]

    def _ended(self, index: int, key: InputName) -> bool:
        """Whether the sender of an input is in a state that is declared to be its end."""
        sender, output = self.sender(index, key)
        begun = self.states[sender] == {self.walkers[sender].subsystem.initial_state}
        return self.is_at_end(sender) and (not begun or (sender, output) not in self.sent)

    def is_at_end(self, index: int) -> bool:
        """Whether a machine stays in one state without any condition."""
        (state, *others) = self.states[index]
        return not others and not list(conditions_of(self.walkers[index].subsystem, state))

    def waits(self, stuck: Stuck) -> frozenset[int]:
        """The machines that send the awaited inputs."""
        return frozenset(self.sender(stuck.index, key)[0] for key in stuck.awaited)

    @cached_property
    def circles(self) -> list[tuple[int, ...]]:
        """Machines that wait for one another."""
        names = {str(i): i for i in self.stuck}
        edges = [(str(i), str(j)) for i, s in self.stuck.items() for j in self.waits(s)]
        found = components(tuple(names), edges)
        return [tuple(names[n] for n in c.states) for c in found if len(c.states) > 1]

    @cached_property
    def roots(self) -> list[Stuck]:
        """The machines that cannot go on, without those that wait for another such machine.

        A machine that only takes rows back to its state is at rest, unless no machine changes its
        state any more and it waits for an input that nobody sends.
        """
        circle = {i for each in self.circles for i in each}
        held = {
            i
            for i, s in self.stuck.items()
            if i not in circle and (s.blocked or (self.still and s.missing))
        }
        found = []
        for index in sorted(held):
            waited = reachable([index], lambda i: self.waits(self.stuck[i]) & self.stuck.keys())
            if not waited.keys() & (circle | held) - {index}:
                found.append(self.stuck[index])
        return found


def terminal_components(graph: Graph, abstraction: Abstraction) -> list[BottomComponent]:
    """The bottom components that were explored completely, in the order of their discovery."""
    beyond = range(len(graph.edges), len(graph.configurations))
    following = {n: {e.target for e in graph.going_on(n)} for n in range(len(graph.edges))}
    before = grouped((there, here) for here, out in following.items() for there in out)
    leaving = reachable(beyond, lambda number: before.get(number, ()))
    closed = {number: out for number, out in following.items() if number not in leaving}
    found = last_components(closed)
    return [BottomComponent(graph, abstraction, each) for each in found if closed[min(each)]]
