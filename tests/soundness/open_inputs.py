"""One generated subsystem, with all its checks, among peers that may do anything they declare.

Beside it goes the code that is shipped, without the checks that proofs spare: it has to take the
same row, or stop with a fault where arithmetic has no result.

A sender is in any of its states at each of its time stamps, the first excepted, and writes what the
behaviour of that state writes; the values are random, among them those that conditions compare with
and their neighbours. Devices report at their rates. Inputs that break an assumption are drawn
again.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from random import Random
from types import ModuleType
from typing import Literal

import numpy as np
from specc_runtime.buffers import lower_flags, setter
from specc_runtime.faults import UndecidedTransition
from specc_runtime.subsystem import Subsystem as Generated

from specc.emit import fill_templates
from specc.lower import Proofs, lower
from specc.model.system import Operator, Port, Subsystem, System
from specc.model.types import Type
from specc.pipeline import Result
from tests.soundness.evaluator import Absent, Key, Situation, Value, value
from tests.soundness.interpreter import at_start, base_tick_s, constants_of
from tests.soundness.law import marks_of, warned
from tests.soundness.running import memory_of, package
from tests.soundness.values import Chooser, for_runtime, key_of

STUBS = "stubs_of_operators"
MOST_DRAWS = 30
"""How often inputs are drawn again before it is said that no inputs satisfy the assumptions."""


Asks = Callable[[str, str, str], bool]
"""Asks about a subsystem, a state and a cause."""


@dataclass(slots=True)
class Findings:
    """What happened in all steps; `faults` are those that must not happen, in words."""

    steps: int = 0
    systems: int = 0
    runs: int = 0
    ended: Counter[str] = field(default_factory=Counter)
    visited: int = 0
    states: int = 0
    rows_taken: int = 0
    rows: int = 0
    faults: list[str] = field(default_factory=list)


def with_stubs(system: System) -> System:
    """The system with operators of no meaning, which `stubs` provides."""
    operators = tuple(replace(o, python=f"{STUBS}:{_named(o)}") for o in system.operators)
    return replace(system, operators=operators)


def _named(operator: Operator) -> str:
    """A name in Python; that of one in a description says which it is of, with which sizes."""
    return re.sub(r"\W", "_", operator.name)


@contextmanager
def stubs(
    system: System, seed: str, marks: tuple[float, ...], odd: tuple[float, ...]
) -> Iterator[dict[str, Callable[..., Value]]]:
    """Random functions that give the same for the same arguments; those on plain values."""
    module, on_plain_values = ModuleType(STUBS), {}
    for operator in system.operators:
        on_plain_values[operator.name] = _stub(operator, seed, marks, odd)
        setattr(
            module, _named(operator), _on_arrays(on_plain_values[operator.name], operator.result)
        )
    sys.modules[STUBS] = module
    try:
        yield on_plain_values
    finally:
        del sys.modules[STUBS]


def _stub(
    operator: Operator, seed: str, marks: tuple[float, ...], odd: tuple[float, ...]
) -> Callable[..., Value]:
    def stub(*args: Value) -> Value:
        rng = Random(f"{seed} {operator.name} {','.join(map(key_of, args))}")
        return Chooser(rng, marks, odd).value(operator.result)

    return stub


def _on_arrays(stub: Callable[..., Value], result: Type) -> Callable[..., Value]:
    return lambda *args: for_runtime(stub(*args), result)


class Peers:
    """Everything that sends to one subsystem."""

    def __init__(self, system: System, subsystem: Subsystem) -> None:
        tick_s = base_tick_s(system)
        others = {s.qualified_name: s for s in system.subsystems}
        self.ticks = _ticks(1 / subsystem.rate_hz, tick_s)
        self.types = {
            (port.peer, element.name): element.type
            for port in subsystem.ports
            if port.direction == "x"
            for element in port.elements
        }
        ports = [port for port in subsystem.ports if port.direction == "x"]
        self.senders = [
            _Sender(others[port.other_end], port, subsystem, tick_s)
            for port in ports
            if port.other_end in others
        ]
        windows = {
            f"{b.device}.{b.element}": _ticks(1 / b.rate_hz, tick_s)
            for b in (system.plant.bindings if system.plant else ())
            if b.rate_hz
        }
        self.sensors = {
            (port.peer, element.name): windows.get(f"{port.other_end}.{element.name}", 1)
            for port in ports
            if port.other_end not in others
            for element in port.elements
        }

        sporadic = {
            f"{b.device}.{b.element}"
            for b in (system.plant.bindings if system.plant else ())
            if b.sporadic
        }
        self.sporadic = [
            (port.peer, element.name)
            for port in ports
            for element in port.elements
            if f"{port.other_end}.{element.name}" in sporadic
        ]

    def arrivals(self, tick: int, chooser: Chooser) -> dict[Key, Value]:
        """What became visible since the time stamp before the one at `tick`."""
        before = tick - self.ticks
        found: set[Key] = set()
        for sender in self.senders:
            found |= sender.sent(before, tick, chooser.rng)
        for key, window in self.sensors.items():
            if tick == 0 or tick // window * window > before:
                found.add(key)
        for key in self.sporadic:
            if tick and chooser.rng.random() < 0.5:
                found.discard(key)
        return {key: chooser.value(self.types[key]) for key in sorted(found)}


class _Sender:
    def __init__(self, sender: Subsystem, port: Port, reader: Subsystem, tick_s: Fraction) -> None:
        self.ticks = _ticks(1 / sender.rate_hz, tick_s)
        peers = [
            p.peer
            for p in sender.ports
            if p.direction == "y" and p.other_end == reader.qualified_name
        ]
        self.writes = [
            {
                (port.peer, a.name)
                for a in state.behaviour.assignments
                if a.peer in peers and port.element(a.name)
            }
            for state in sender.states
        ]
        names = [state.name for state in sender.states]
        self.first = self.writes[names.index(sender.initial_state)]

    def sent(self, before: int, until: int, rng: Random) -> set[Key]:
        """What comes into sight after tick `before` and until tick `until`."""
        found: set[Key] = set()
        start = max(self.ticks, (before // self.ticks + 1) * self.ticks)
        for visible in range(start, until + 1, self.ticks):
            found |= self.first if visible == self.ticks else rng.choice(self.writes)
        return found


def _ticks(period_s: Fraction, tick_s: Fraction) -> int:
    return max(1, round(period_s / tick_s))


class Trial:
    """Steps of the subsystems of one system."""

    def __init__(
        self,
        system: System,
        operators: Mapping[str, Callable[..., Value]],
        classes: Mapping[str, type[Generated]],
        shipped: Mapping[str, type[Generated]],
        findings: Findings,
        is_excused: Asks,
        odd: tuple[float, ...] = (),
    ) -> None:
        self.system = system
        self.is_excused = is_excused
        self.operators = operators
        self.classes = classes
        self.shipped = shipped
        self.findings = findings
        self.marks = marks_of(system)
        self.odd = odd
        self.constants = constants_of(system, operators)

    def run(self, subsystem: Subsystem, steps: int, rng: Random) -> None:
        """Up to so many steps from the start; a fault that must not happen is written down."""
        live = at_start(self.system)
        constants = constants_of(self.system, self.operators, subsystem.constants)
        peers = Peers(self.system, subsystem)
        chooser = Chooser(rng, self.marks, self.odd)
        files = {name: name for name, _ in self.system.files}
        machine = self.classes[subsystem.qualified_name](files)
        shipped = self.shipped[subsystem.qualified_name](files)
        clear = lower_flags(machine.x), lower_flags(shipped.x)
        puts = {
            key: [setter(code.x, f"{key[0]}_{key[1]}") for code in (machine, shipped)]
            for key in peers.types
        }
        at = Situation({}, frozenset(), {}, {}, constants, self.operators, live=live)
        inputs: dict[Key, Value] = {
            (port.peer, e.name): value(e.init, at)
            for port in subsystem.ports
            for e in port.elements
            if port.direction == "x" and e.init is not None
        }
        self.findings.runs += 1
        visited, taken = set(), set()
        for number in range(steps):
            if live:
                live = self._changed(live, rng)
                constants = constants_of(self.system, self.operators, subsystem.constants, live)
                for name in live:
                    for code in (machine, shipped):
                        if hasattr(code.x, f"live_{name}"):
                            setattr(code.x, f"live_{name}", live[name])
            arrived = self._allowed(
                subsystem, machine, peers, inputs, chooser, number, constants, live
            )
            if arrived is None:
                self.findings.ended["no inputs satisfy the assumptions"] += 1
                break
            inputs |= arrived
            for key, sent in arrived.items():
                for put in puts[key]:
                    put(for_runtime(sent, peers.types[key]))
            state = machine.state
            fresh = frozenset(arrived)
            now = number and self._situation(subsystem, machine, inputs, fresh, constants, live)
            outcome = self._stepped(machine)
            differs = _difference(subsystem, now, state, outcome, self._stepped(shipped))
            outcome = differs or outcome
            for lower_all in clear:
                lower_all()
            self.findings.steps += 1
            visited.add(machine.state)
            if isinstance(outcome, str):
                self.findings.ended[outcome.split(":")[0]] += 1
                if not outcome.startswith(("arithmetic", "undecided where")):
                    where = f"{self.system.file} {subsystem.qualified_name} in {machine.state}"
                    self.findings.faults.append(f"{where}, step {number}: {outcome}")
                break
            taken.add(outcome)
        self.findings.visited += len(visited)
        self.findings.states += len(subsystem.states)
        self.findings.rows_taken += len(taken - {-1})
        self.findings.rows += len(subsystem.transitions)

    def _changed(self, live: Mapping[str, Value], rng: Random) -> dict[str, Value]:
        """Constants that may change, some of them with other values of their ranges."""
        found = dict(live)
        for constant in self.system.constants:
            if constant.initial is not None and constant.bounds and rng.random() < 0.5:
                low, high = constant.bounds
                inside = rng.randint if isinstance(low, int) else rng.uniform
                found[constant.name] = rng.choice([low, high, inside(low, high)])
        return found

    def _stepped(self, machine: Generated) -> int | str:
        """The row taken or -1, or what went wrong."""
        try:
            with np.errstate(all="ignore"):
                row = machine.step()
        except UndecidedTransition as fault:
            if self.is_excused(machine.name, machine.state, fault.cause):
                return "undecided where it is not proved"
            return f"undecided: {fault.message}; inputs {fault.inputs}"
        except AttributeError as error:
            return f"absent: {error}"
        except (ArithmeticError, ValueError) as error:
            kind = "missing" if str(error).startswith(("None where", "max()")) else "arithmetic"
            return f"{kind}: {error}"
        if machine.violations:
            return f"assumption: {machine.violations} said to hold by the interpreter"
        return row

    def _allowed(
        self,
        subsystem: Subsystem,
        machine: Generated,
        peers: Peers,
        inputs: dict[Key, Value],
        chooser: Chooser,
        number: int,
        constants: Mapping[str, Value],
        live: Mapping[str, Value],
    ) -> dict[Key, Value] | None:
        """Arrivals with which the assumptions hold; None if none were found."""
        for _ in range(MOST_DRAWS):
            arrived = peers.arrivals(number * peers.ticks, chooser)
            if number == 0 or not subsystem.axioms:
                return arrived
            now = self._situation(
                subsystem, machine, inputs | arrived, frozenset(arrived), constants, live
            )
            try:
                if all(value(axiom.that, now) for axiom in subsystem.axioms):
                    return arrived
            except (Absent, ArithmeticError, ValueError):
                continue
        return None

    def _situation(
        self,
        subsystem: Subsystem,
        machine: Generated,
        inputs: Mapping[Key, Value],
        fresh: frozenset[Key],
        constants: Mapping[str, Value],
        live: Mapping[str, Value],
    ) -> Situation:
        return Situation(
            inputs,
            fresh,
            dict(memory_of(machine)),
            {item.name: item.value for item in subsystem.lets},
            constants,
            self.operators,
            period=float(1 / subsystem.rate_hz),
            live=live,
        )


def _difference(
    subsystem: Subsystem,
    now: Situation | Literal[0],
    state: str,
    checked: int | str,
    shipped: int | str,
) -> str:
    """What the shipped code did that it must not, beside the code with all checks.

    Shipped code evaluates no more than it has to, so it may go on where a condition that it needs
    not has no value; the row that it takes must be true.
    """
    if checked == shipped or (isinstance(checked, str) and isinstance(shipped, str)):
        return ""
    if isinstance(shipped, int) and str(checked).startswith("arithmetic"):
        went_on = shipped < 0 or not now
        if went_on or value(subsystem.transitions[shipped].condition.when, now):
            return ""
    return f"shipped code: {shipped} in {state}, with all checks {checked}"


def _excuse(result: Result) -> Asks:
    """Where rows may turn out not to decide: where that is said."""
    excused = not result.ok or warned(result)

    def is_excused(subsystem: str, state: str, cause: str) -> bool:
        proved = result.proofs.is_proved(subsystem, state, cause)
        return excused and not proved

    return is_excused


@contextmanager
def _classes(system: System, proofs: Proofs | None) -> Iterator[dict[str, type[Generated]]]:
    """Generated classes of all subsystems, by the names of those."""
    files = dict(fill_templates(lower(system, proofs, stand_ins=True)))
    files.pop("system.py")
    with package(files) as modules:
        yield {
            kind.name: kind
            for module in modules.values()
            for kind in vars(module).values()
            if isinstance(kind, type) and issubclass(kind, Generated) and kind is not Generated
        }


def tried(
    result: Result, seed: str, steps: int, findings: Findings, *, odd: tuple[float, ...] = ()
) -> None:
    """So many steps of the subsystems of a system, in turn and from the start each time.

    What was not proved and is said so (W0606) may turn out undecided; that is counted.

    Raises:
        ImportError: the specification names Python classes that are not there.
    """
    assert result.system is not None
    system = with_stubs(result.system)
    rng = Random(seed)
    with (
        stubs(system, seed, marks_of(system), odd) as operators,
        _classes(system, None) as classes,
        _classes(system, result.proofs) as shipped,
    ):
        trial = Trial(system, operators, classes, shipped, findings, _excuse(result), odd)
        findings.systems += 1
        goal = findings.steps + steps
        while findings.steps < goal:
            before = findings.steps
            for subsystem in system.subsystems:
                trial.run(subsystem, min(rng.choice((10, 60, 300)), goal - findings.steps), rng)
            if findings.steps == before:
                break
