"""A slow, obvious interpreter of whole specifications, section 8 of docs/language.md in Python.

It reads the resolved model and nothing else of the compiler, and shares no line with the executor:
every value that was ever sent is kept with the time at which it can be seen, and a snapshot looks
through all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from random import Random
from typing import Any

from specc.model.fsm import Behaviour
from specc.model.system import Subsystem, System
from tests.soundness.evaluator import Absent, Key, Situation, Value, value

Measure = Callable[[str, int], Value]
"""Name of a reported element of a device and base tick -> what it measures."""


@dataclass(frozen=True, slots=True)
class Step:
    """What a subsystem did at its time stamp `stamp`."""

    stamp: int
    state: str
    transition: int
    sent: tuple[tuple[str, Value], ...]
    memory: tuple[tuple[str, Value], ...]


@dataclass(frozen=True, slots=True)
class Failure:
    """A fault: `kind` is the class that the runtime has for it, `about` its axioms or rows."""

    subsystem: str
    stamp: int
    state: str
    kind: str
    about: tuple[str, ...] = ()
    cause: str = ""


@dataclass(slots=True)
class Run:
    """What came of a run: steps by subsystem, faults, and commands as (tick, element, value)."""

    steps: dict[str, list[Step]]
    failures: list[Failure] = field(default_factory=list)
    commands: list[tuple[int, str, Value]] = field(default_factory=list)
    empty: list[str] = field(default_factory=list)
    """Types of what was said to be there and was not, of steps in which the assumptions held."""


class Undecided(Exception):
    """Not exactly one row holds; `args` are the cause and those that do."""


class Machine:
    """One subsystem between two periods."""

    def __init__(
        self,
        subsystem: Subsystem,
        constants: Mapping[str, Value],
        operators: Mapping[str, Callable[..., Value]],
        files: Mapping[str, str] | None = None,
    ) -> None:
        self.subsystem = subsystem
        self.files = files or {}
        self.constants = constants
        self.operators = operators
        self.lets = {item.name: item.value for item in subsystem.lets}
        self.state = ""
        self.periods = 0
        self.memory: dict[str, Value] = {}
        self.stamp = -1
        self.broken: list[int] = []
        self.ages: Mapping[Key, float] = {}
        """How old inputs are in this period, in s."""
        self.empty: list[str] = []
        """What was said to be there and was not, in all steps."""

    def situation(self, inputs: Mapping[Key, Value], fresh: frozenset[Key]) -> Situation:
        """What expressions see now."""
        return Situation(
            inputs=inputs,
            fresh=fresh,
            memory=self.memory,
            lets=self.lets,
            constants=self.constants,
            operators=self.operators,
            elapsed=float(self.periods / self.subsystem.rate_hz),
            entered=self.periods == 0,
            period=float(1 / self.subsystem.rate_hz),
            files=self.files,
            ages=self.ages,
            empty=self.empty,
        )

    def step(self, inputs: Mapping[Key, Value], fresh: frozenset[Key]) -> Step | Failure:
        """One period of the work cycle."""
        self.stamp += 1
        self.broken = []
        self.empty = []
        cause = ""
        try:
            return self._step(inputs, fresh)
        except Undecided as error:
            cause, *rows = map(str, error.args)
            kind, about = "UndecidedTransition", tuple(rows)
        except Absent as error:
            kind, about = "Absent", (str(error),)
        except (ArithmeticError, ValueError, IndexError):  # the last: of a list without items
            kind, about = "StepFailed", ()
        if self.broken:
            return self._broken()
        return self._failed(kind, about, cause)

    def _failed(self, kind: str, about: tuple[str, ...], cause: str = "") -> Failure:
        return Failure(self.subsystem.qualified_name, self.stamp, self.state, kind, about, cause)

    def _broken(self) -> Failure:
        return self._failed("AxiomViolated", tuple(map(str, self.broken)))

    def _step(self, inputs: Mapping[Key, Value], fresh: frozenset[Key]) -> Step | Failure:
        row = -1
        if not self.state:
            now = self.situation(inputs, fresh)
            self.memory = {item.name: value(item.init, now) for item in self.subsystem.memory}
            self.state = self.subsystem.initial_state
        else:
            self.periods += 1
            now = self.situation(inputs, fresh)
            for index, axiom in enumerate(self.subsystem.axioms):
                if not value(axiom.that, now):
                    self.broken.append(index)
            row = self.decide(now)
            if row >= 0:
                taken = self.subsystem.transitions[row]
                self.state, self.periods = taken.target, 0
                self.memory |= {name: value(what, now) for name, what in taken.sets}
        sent = self.execute(inputs, fresh)
        if self.broken:
            return self._broken()
        return Step(self.stamp, self.state, row, sent, tuple(self.memory.items()))

    def decide(self, now: Situation) -> int:
        """The row to take, or -1: an error goes before an end, and exactly one row must hold."""
        endings = self.behaviour().endings
        cause = next((name for name, end in endings if value(end.when, now)), None)
        if cause is None:
            return -1
        rows = [
            (index, row)
            for index, row in enumerate(self.subsystem.transitions)
            if row.source == self.state and row.cause == cause
        ]
        enabled = [i for i, row in rows if not row.is_otherwise and value(row.condition.when, now)]
        enabled = enabled or [i for i, row in rows if row.is_otherwise]
        if len(enabled) != 1:
            raise Undecided(cause, *enabled)
        return enabled[0]

    def behaviour(self) -> Behaviour:
        """That of the state."""
        return next(s for s in self.subsystem.states if s.name == self.state).behaviour

    def execute(
        self, inputs: Mapping[Key, Value], fresh: frozenset[Key]
    ) -> tuple[tuple[str, Value], ...]:
        """All functions of the behaviour once; what they give counts from the next stamp on."""
        now = self.situation(inputs, fresh)
        sent: dict[str, Value] = {}
        after = dict(self.memory)
        for function in self.behaviour().functions:
            for target in function.assignments:
                result = value(target.value, now)
                if target.peer:
                    sent[f"{target.peer}_{target.name}"] = result
                else:
                    after[target.name] = result
        self.memory = after
        return tuple(sorted(sent.items()))


@dataclass(frozen=True, slots=True)
class Sent:
    """A value on its way to an input, to be seen from base tick `visible` on."""

    to: str
    key: Key
    visible: int
    value: Value


class Interpreter:
    """Runs a system from base tick to base tick."""

    def __init__(
        self, system: System, operators: Mapping[str, Callable[..., Value]], measure: Measure
    ) -> None:
        self.system = system
        self.measure = measure
        self.machines = {
            s.qualified_name: Machine(
                s, constants_of(system, operators, s.constants), operators, dict(system.files)
            )
            for s in system.subsystems
        }
        self.tick_s = base_tick_s(system)
        self.periods = {
            name: int(1 / machine.subsystem.rate_hz / self.tick_s)
            for name, machine in self.machines.items()
        }
        self.sent: list[Sent] = []
        self.under_way: dict[str, Step | Failure] = {}
        self.run_ = Run({name: [] for name in self.machines})

    def run(self, ticks: int) -> Run:
        """So many base ticks, or until a fault; then what is under way comes to its end."""
        tick = 0
        while tick < ticks:
            due = [n for n in sorted(self.machines) if tick % self.ticks(n) == 0]
            for name in due:
                self.complete(name, tick)
            if self.run_.failures:
                break
            snapshots = {name: self.snapshot(name, tick) for name in due}
            for name in due:
                self.under_way[name] = self.machines[name].step(*snapshots[name])
                if not self.machines[name].broken:
                    self.run_.empty += [f"{name}: {what}" for what in self.machines[name].empty]
            tick += 1
        for name in sorted(self.under_way):
            self.complete(name, tick)
        return self.run_

    def ticks(self, name: str) -> int:
        """Base ticks in a period."""
        return self.periods[name]

    def complete(self, name: str, tick: int) -> None:
        """What was computed at stamp i becomes visible at i + 1."""
        done = self.under_way.pop(name, None)
        if isinstance(done, Failure):
            self.run_.failures.append(done)
        elif done is not None:
            self.run_.steps[name].append(done)
            subsystem = self.machines[name].subsystem
            for port in subsystem.ports:
                for element in port.elements if port.direction == "y" else ():
                    for sent, result in done.sent:
                        if sent == f"{port.peer}_{element.name}":
                            self.send(name, port.other_end, element.name, tick, result)

    def send(self, name: str, to: str, element: str, tick: int, result: Value) -> None:
        """To the subsystem or device at the other end."""
        if to not in self.machines:
            self.run_.commands.append((tick, f"{to}.{element}", result))
            return
        for port in self.machines[to].subsystem.ports:
            if port.direction == "x" and port.other_end == name:
                self.sent.append(Sent(to, (port.peer, element), tick, result))

    def snapshot(self, name: str, tick: int) -> tuple[dict[Key, Value], frozenset[Key]]:
        """The last value of every input, and which became visible since the previous stamp."""
        machine = self.machines[name]
        inputs: dict[Key, Value] = {}
        fresh = set()
        before = machine.situation({}, frozenset())
        for port in machine.subsystem.ports:
            for element in port.elements if port.direction == "x" else ():
                key = port.peer, element.name
                if element.init is not None:
                    inputs[key] = value(element.init, before)
                if port.other_end not in self.machines:
                    sampled = self.sampled(f"{port.other_end}.{element.name}", name, tick)
                    inputs[key] = self.measure(f"{port.other_end}.{element.name}", sampled)
                    if tick == 0 or sampled > tick - self.ticks(name):
                        fresh.add(key)
        for item in self.sent:
            if item.to == name and item.visible <= tick:
                inputs[item.key] = item.value
                if item.visible > tick - self.ticks(name):
                    fresh.add(item.key)
        return inputs, frozenset(fresh)

    def sampled(self, element: str, reader: str, tick: int) -> int:
        """The base tick of the latest sample: with a rate the start of its period, else now.

        A sporadic device is asked whenever a reader is due, and may have had nothing new.
        """
        for binding in self.system.plant.bindings if self.system.plant else ():
            if f"{binding.device}.{binding.element}" != element:
                continue
            if binding.sporadic:
                asked = (t for t in range(tick, -1, -1) if self.is_asked(binding.device, t))
                return next(t for t in asked if has_new(element, t))
            if binding.rate_hz:
                window = int(1 / binding.rate_hz / self.tick_s)
                return tick // window * window
        return tick

    def is_asked(self, device: str, tick: int) -> bool:
        """Whether a reader of a device is due."""
        readers = [
            name
            for name, machine in self.machines.items()
            if any(p.direction == "x" and p.other_end == device for p in machine.subsystem.ports)
        ]
        return any(tick % self.ticks(name) == 0 for name in readers)


def has_new(element: str, tick: int) -> bool:
    """Whether a sporadic device has a new sample at a base tick."""
    return tick == 0 or Random(f"{element} {tick}").random() < 0.4


def base_tick_s(system: System) -> Fraction:
    """The greatest common divisor of all periods."""
    periods = [1 / s.rate_hz for s in system.subsystems]
    scale = math.lcm(*(p.denominator for p in periods))
    return Fraction(math.gcd(*(int(p * scale) for p in periods)), scale)


def at_start(system: System) -> dict[str, Value]:
    """The values with which constants begin that may change."""
    return {c.name: c.initial.value for c in system.constants if c.initial is not None}


def constants_of(
    system: System,
    operators: Mapping[str, Callable[..., Value]],
    own: Any = (),
    live: Mapping[str, Value] | None = None,
) -> dict[str, Value]:
    """Values of the constants, each over those above it; those that may change are `live`."""
    known: dict[str, Value] = {}
    live = at_start(system) if live is None else live
    files = dict(system.files)
    now = Situation({}, frozenset(), {}, {}, known, operators, files=files, live=live)
    for constant in (*system.constants, *own):
        known[constant.name] = value(constant.value, now)
    return known
