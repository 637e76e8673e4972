"""All that a small system can do, found by running its generated code on all that devices report.

It shares nothing with `specc explore` but the compiler. Steps of a machine are functions of its
state, its memory and its inputs, so each of them is made once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from types import SimpleNamespace
from typing import Any

from specc_runtime.buffers import FRESH, PRESENT, setter, slots
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import Scheduled
from specc_runtime.system import System as Built

MOST_CONFIGURATIONS = 4_000
Values = tuple[Any, ...]
Local = tuple[str, int, Values]
"""A state, the periods in it, and memory."""
Inputs = tuple[tuple[Any, bool], ...]
"""Values with whether they are fresh."""
Lost = tuple[str, str]
"""A machine and its input."""


@dataclass(frozen=True, slots=True)
class Part:
    """A machine between two ticks: its inputs with whether they are fresh, and what it has sent."""

    local: Local
    inputs: Inputs
    pending: tuple[tuple[str, Any], ...]


@dataclass(frozen=True, slots=True)
class Configuration:
    """All machines after a base tick; its phase is that tick modulo the hyperperiod."""

    phase: int
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Move:
    """What a machine does at its time stamp; the row is an index, -1 for none."""

    name: str
    source: str
    target: str
    row: int


@dataclass(frozen=True, slots=True)
class Edge:
    """A base tick: where it leads, the moves of the machines, and events that nobody looks at."""

    target: int
    moves: tuple[Move, ...]
    lost: frozenset[Lost]


@dataclass(frozen=True, slots=True)
class Look:
    """The states whose conditions look at an event, and those whose functions do."""

    conditions: frozenset[str]
    functions: frozenset[str]

    def misses(self, move: Move) -> bool:
        """Whether an event that is fresh at a move is lost there."""
        return move.source not in self.conditions and move.target not in self.functions


class Machine:
    """Steps one generated subsystem from any place that it has come to."""

    def __init__(self, scheduled: Scheduled, longest: int, domains: Mapping[str, Values]) -> None:
        """`longest` is a number of periods from which on no condition on `elapsed` turns.

        `domains` has what may be measured for its inputs.
        """
        self.subsystem: Subsystem = scheduled.subsystem
        self.ticks = scheduled.ticks
        self.name = self.subsystem.name
        self.memory = tuple(type(self.subsystem.memory).__slots__)
        names = [n for n in slots(self.subsystem.x) if not n.startswith((FRESH, PRESENT))]
        self.inputs = tuple(names)
        self.measured = {names.index(name): values for name, values in domains.items()}
        self._longest = longest
        self._works = {"": vars(self.subsystem)["_work"]}
        self._put = [setter(self.subsystem.x, name) for name in names]
        self._made: dict[tuple[Local, Inputs], tuple[Part, Move]] = {}
        x = self.subsystem.x
        self.first = Part(("", 0, ()), tuple((getattr(x, name, None), False) for name in names), ())

    def step(self, local: Local, inputs: Inputs) -> tuple[Part, Move]:
        """What it is after a step, its inputs read, and its move."""
        key = local, inputs
        if key not in self._made:
            self._made[key] = self._step(*key)
        return self._made[key]

    def _step(self, local: Local, inputs: Inputs) -> tuple[Part, Move]:
        subsystem, (state, periods, memory) = self.subsystem, local
        subsystem.state, subsystem.violations = state, ()
        own = vars(subsystem)
        own["_work"] = self._works[state]
        if "_periods" in own:
            own["_periods"] = periods
        for name, value in zip(self.memory, memory, strict=bool(state)):
            setattr(subsystem.memory, name, value)
        for (value, is_fresh), put, name in zip(inputs, self._put, self.inputs, strict=True):
            if value is not None:
                put(value)
            if hasattr(type(subsystem.x), FRESH + name):
                setattr(subsystem.x, FRESH + name, is_fresh)
        row = subsystem.step()
        assert own.keys() <= {"x", "y", "memory", "state", "violations", "_work", "_periods"}
        assert not subsystem.violations
        self._works[subsystem.state] = own["_work"]
        after = (
            subsystem.state,
            min(own.get("_periods", 0), self._longest),
            tuple(getattr(subsystem.memory, name) for name in self.memory),
        )
        sent = [(n, getattr(subsystem.y, n)) for n in subsystem.sends[subsystem.state]]
        seen = tuple((value, False) for value, _ in inputs)
        part = Part(after, seen, tuple(sent))
        return part, Move(self.name, state, subsystem.state, row)

    def arrivals(self, inputs: Inputs) -> Iterator[tuple[Any, ...]]:
        """The inputs with each that may be measured now."""
        for values in product(*self.measured.values()):
            found = list(inputs)
            for place, value in zip(self.measured, values, strict=True):
                found[place] = value, True
            yield tuple(found)


@dataclass
class Enumeration:
    """The graph of a system; without all configurations if there are too many."""

    system: Built
    longest_s: float
    """No condition on `elapsed` turns later."""
    domains: Mapping[str, Values]
    """What each sensor reports."""
    events: Mapping[Lost, Look] = field(default_factory=dict)
    """The inputs that may not be lost."""
    most: int = MOST_CONFIGURATIONS
    configurations: list[Configuration] = field(default_factory=list)
    edges: list[list[Edge]] = field(default_factory=list)
    _views: dict[int, dict[str, Any]] = field(default_factory=dict)
    _seen: dict[tuple[int, Values, Inputs], SimpleNamespace] = field(default_factory=dict)
    _steps: dict[tuple[int, Part], list[tuple[Part, Move, frozenset[Lost]]]] = field(
        default_factory=dict
    )

    def __post_init__(self) -> None:
        spec, tick_s = self.system.plant, self.system.tick_s
        sensed: dict[str, dict[str, Values]] = {}
        for each in spec.inputs if spec else ():
            sensed.setdefault(each.subsystem, {})[each.element] = self.domains[each.sensor]
        self.machines = [
            Machine(
                s,
                int(self.longest_s / (s.ticks * tick_s)) + 3,
                sensed.get(s.subsystem.name, {}),
            )
            for s in self.system.subsystems
        ]
        names = [machine.name for machine in self.machines]
        self._wires: dict[tuple[int, str], tuple[int, int]] = {}
        for c in self.system.connections:
            reader = names.index(c.target)
            if c.input in self.machines[reader].inputs:
                place = self.machines[reader].inputs.index(c.input)
                self._wires[names.index(c.source), c.output] = reader, place
        self.hyperperiod = 1
        for machine in self.machines:
            while self.hyperperiod % machine.ticks:
                self.hyperperiod += 1
        self._explore()

    @property
    def is_complete(self) -> bool:
        """Whether each configuration has its edges."""
        return len(self.edges) == len(self.configurations)

    def _explore(self) -> None:
        begin = Configuration(-1, tuple(machine.first for machine in self.machines))
        numbers: dict[Configuration, int] = {}
        self.first = self._edges(begin, numbers)
        while len(self.edges) < len(self.configurations) <= self.most:
            self.edges.append(self._edges(self.configurations[len(self.edges)], numbers))

    def _edges(self, here: Configuration, numbers: dict[Configuration, int]) -> list[Edge]:
        found: dict[Edge, None] = {}
        for there, moves, lost in self._ticks(here):
            number = numbers.setdefault(there, len(numbers))
            if number == len(self.configurations):
                self.configurations.append(there)
            found[Edge(number, moves, lost)] = None
        return list(found)

    def _ticks(
        self, here: Configuration
    ) -> Iterator[tuple[Configuration, tuple[Move, ...], frozenset[Lost]]]:
        """All that one base tick may make of a configuration."""
        phase = (here.phase + 1) % self.hyperperiod
        due = [i for i, machine in enumerate(self.machines) if phase % machine.ticks == 0]
        parts, overtaken = list(here.parts), set[Lost]()
        for i in due:
            for name, value in here.parts[i].pending:
                if (i, name) not in self._wires:
                    continue
                reader, place = self._wires[i, name]
                machine, part = self.machines[reader], parts[reader]
                if part.inputs[place][1]:
                    overtaken.add((machine.name, machine.inputs[place]))
                arrived = ((value, True),)
                inputs = part.inputs[:place] + arrived + part.inputs[place + 1 :]
                parts[reader] = Part(part.local, inputs, part.pending)
        options = []
        for i in due:
            if (i, parts[i]) not in self._steps:
                self._steps[i, parts[i]] = self._options(i, parts[i])
            options.append(self._steps[i, parts[i]])
        for chosen in product(*options):
            lost = {each for each in overtaken if each in self.events}
            for i, (part, _, unseen) in zip(due, chosen, strict=True):
                parts[i] = part
                lost |= unseen
            moves = tuple(move for _, move, _ in chosen)
            yield Configuration(phase, tuple(parts)), moves, frozenset(lost)

    def _options(self, i: int, part: Part) -> list[tuple[Part, Move, frozenset[Lost]]]:
        machine, found = self.machines[i], dict[tuple[Part, Move, frozenset[Lost]], None]()
        for inputs in machine.arrivals(part.inputs):
            after, move = machine.step(part.local, inputs)
            unseen = frozenset(
                (machine.name, name)
                for (_, is_fresh), name in zip(inputs, machine.inputs, strict=True)
                if is_fresh
                and (machine.name, name) in self.events
                and self.events[machine.name, name].misses(move)
            )
            # What is measured is no part of a configuration: it comes anew.
            kept = tuple(
                (None, False) if place in machine.measured else each
                for place, each in enumerate(after.inputs)
            )
            found[Part(after.local, kept, after.pending), move, unseen] = None
        return list(found)

    # What is asked of it.

    def view(self, number: int) -> dict[str, Any]:
        """The names of formulas at a configuration."""
        if number not in self._views:
            self._views[number] = self._view(self.configurations[number])
        return self._views[number]

    def _view(self, configuration: Configuration) -> dict[str, Any]:
        states, agents = {}, dict[str, Any]()
        for i, (machine, part) in enumerate(zip(self.machines, configuration.parts, strict=True)):
            agent, _, name = machine.name.partition(".")
            states[machine.name] = part.local[0]
            key = i, part.local[2], part.inputs
            if key not in self._seen:
                self._seen[key] = _namespace(machine, part)
            setattr(agents.setdefault(agent, SimpleNamespace()), name, self._seen[key])
        return {**agents, "state": lambda machine: states[machine.full_name]}

    def leads_to(self, goals: Iterable[int]) -> set[int]:
        """The configurations from which some run comes to one of these, and these."""
        before: list[list[int]] = [[] for _ in self.configurations]
        for number, edges in enumerate(self.edges):
            for edge in edges:
                before[edge.target].append(number)
        found = set(goals)
        waiting = list(found)
        while waiting:
            for number in before[waiting.pop()]:
                if number not in found:
                    found.add(number)
                    waiting.append(number)
        return found

    def reached_from(self, starts: Iterable[int]) -> set[int]:
        """The configurations that runs come to from these, and these."""
        found, waiting = set(starts), list(starts)
        while waiting:
            here = waiting.pop()
            for edge in self.edges[here] if here < len(self.edges) else ():
                if edge.target not in found:
                    found.add(edge.target)
                    waiting.append(edge.target)
        return found

    def stuck(self) -> Iterator[tuple[str, str, set[int]]]:
        """Machine, state, and the configurations from which on it takes no row any more."""
        for i, machine in enumerate(self.machines):
            acts = self.leads_to(
                number
                for number, edges in enumerate(self.edges)
                if any(m.name == machine.name and m.row >= 0 for e in edges for m in e.moves)
            )
            by_state: dict[str, set[int]] = {}
            for number in {*range(len(self.edges))} - acts:
                state = self.configurations[number].parts[i].local[0]
                by_state.setdefault(state, set()).add(number)
            for state, numbers in by_state.items():
                yield machine.name, state, numbers


def _namespace(machine: Machine, part: Part) -> SimpleNamespace:
    """What formulas name of a machine."""
    here = SimpleNamespace(**dict(zip(machine.memory, part.local[2], strict=True)))
    here.full_name, here.x = machine.name, SimpleNamespace()
    for (value, _), element in zip(part.inputs, machine.inputs, strict=True):
        peer, _, element_name = element.partition("_")
        if not hasattr(here.x, peer):
            setattr(here.x, peer, SimpleNamespace())
        setattr(getattr(here.x, peer), element_name, value)
    return here
