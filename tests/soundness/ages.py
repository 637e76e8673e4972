"""The interpreter with the ages of values: section 8 of docs/language.md, "Age", read once more.

Every value carries the base tick at which it was computed, by whoever did so first where nothing
was measured, and that of the oldest measurement behind it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from specc.model import expr as m
from specc.model.system import Subsystem, System
from tests.soundness.evaluator import Key, Value
from tests.soundness.interpreter import Interpreter, Measure

Element = tuple[str, Key]
"""An element of an input buffer: its reader, and what the reader calls it."""
Read = tuple[Key, bool]
"""An input that is read, and whether only where it is fresh."""


@dataclass(frozen=True, slots=True)
class Origin:
    """When a value was computed, and the oldest measurement behind it, in base ticks."""

    computed: int
    measured: int | None = None

    @property
    def since(self) -> int:
        return self.computed if self.measured is None else self.measured


@dataclass(frozen=True, slots=True)
class Arrived:
    """The origin of a value that can be seen from a base tick on."""

    visible: int
    origin: Origin


@dataclass(slots=True)
class Met:
    """The greatest age of an input, ever, and if fresh.

    Where a measurement may be behind it, only values that have one count.
    """

    ever: Fraction = field(default_factory=Fraction)
    fresh: Fraction = field(default_factory=Fraction)


class AgedInterpreter(Interpreter):
    """Runs a system whose subsystems enter the states that are `entered`, and no others."""

    def __init__(
        self,
        system: System,
        operators: Mapping[str, Callable[..., Value]],
        measure: Measure,
        entered: Mapping[str, frozenset[str]],
    ) -> None:
        super().__init__(system, operators, measure)
        self.subsystems = {s.qualified_name: s for s in system.subsystems}
        self.entered = entered
        self.above = {e: frozenset(self._above(e)) for e in self._elements()}
        self.upstream = {e: self._upstream(e) for e in self.above}
        self.arrived: dict[Element, list[Arrived]] = {}
        self.known: dict[str, dict[Key, Origin]] = {}
        self.came: dict[str, frozenset[Key]] = {}
        self.began: dict[str, int] = {}
        self.met: dict[Element, Met] = {}

    def snapshot(self, name: str, tick: int) -> tuple[dict[Key, Value], frozenset[Key]]:
        inputs, fresh = super().snapshot(name, tick)
        self.known[name] = {key: self.origin((name, key), tick) for key in inputs}
        self.came[name], self.began[name] = fresh, tick
        self.machines[name].ages = {
            key: float((tick - origin.since) * self.tick_s)
            for key, origin in self.known[name].items()
        }
        for key, origin in self.known[name].items():
            if origin.measured is not None or not self.is_measured((name, key)):
                met, age = self.met.setdefault((name, key), Met()), tick - origin.since
                met.ever = max(met.ever, age * self.tick_s)
                met.fresh = max(met.fresh, age * self.tick_s) if key in fresh else met.fresh
        return inputs, fresh

    def origin(self, element: Element, tick: int) -> Origin:
        """That of the value which an input has; an initial one is there from the begin."""
        reader, (peer, name) = element
        device = self.subsystems[reader].sender(peer)
        if device not in self.machines:
            sampled = self.sampled(f"{device}.{name}", reader, tick)
            return Origin(sampled, sampled)
        seen = [a.origin for a in self.arrived.get(element, ()) if a.visible <= tick]
        return seen[-1] if seen else Origin(0)

    def send(self, name: str, to: str, element: str, tick: int, result: Value) -> None:
        super().send(name, to, element, tick, result)
        for reader in self._readers(name, to, element):
            self.arrived.setdefault(reader, []).append(Arrived(tick, self._sent(name, reader)))

    def _readers(self, name: str, to: str, element: str) -> Iterator[Element]:
        for port in self.subsystems[to].ports if to in self.machines else ():
            if port.direction == "x" and port.other_end == name:
                yield to, (port.peer, element)

    def _sent(self, name: str, reader: Element) -> Origin:
        known = self.known[name]
        behind = [
            known[key]
            for key, only_fresh in self.reads_in(name, self.machines[name].state, reader)
            if self.is_followed((name, key), reader)
            and key in known
            and (key in self.came[name] or not only_fresh)
        ]
        if not self.is_measured(reader):
            return Origin(min((origin.computed for origin in behind), default=self.began[name]))
        found = [origin.measured for origin in behind if origin.measured is not None]
        return Origin(self.began[name], min(found, default=None))

    # What is computed from what, in which states.

    def _elements(self) -> Iterator[Element]:
        for name, subsystem in self.subsystems.items():
            yield from ((name, key) for key in subsystem.inputs)

    def _above(self, element: Element) -> Iterator[Element]:
        sender = self.subsystems[element[0]].sender(element[1][0])
        for state in self.entered.get(sender, ()):
            yield from ((sender, key) for key, _ in self.reads_in(sender, state, element))

    def reads_in(self, sender: str, state: str, element: Element) -> Iterator[Read]:
        """What a subsystem reads for an element that it sends in a state."""
        for value in self._targets(sender, state, element):
            yield from reads(value, self.subsystems[sender], frozenset())

    def _targets(self, sender: str, state: str, element: Element) -> Iterator[m.Expr]:
        reader, (_, name) = element
        subsystem = self.subsystems[sender]
        behaviour = next(s for s in subsystem.states if s.name == state).behaviour
        peers = {p.peer for p in subsystem.ports if p.direction == "y" and p.other_end == reader}
        for function in behaviour.functions:
            for target in function.assignments:
                if target.peer in peers and target.name == name:
                    yield target.value

    def sends(self, sender: str, state: str, element: Element) -> bool:
        """Whether a subsystem sends an element to its reader in a state."""
        return any(True for _ in self._targets(sender, state, element))

    def is_followed(self, above: Element, element: Element) -> bool:
        """Whether the age of a value counts for what is computed from it."""
        counts = self.is_measured(above) or not self.is_measured(element)
        return element not in self.upstream[above] and counts

    def is_measured(self, element: Element) -> bool:
        """Whether a measurement is behind an element, not counting what comes back to it."""
        reader, (peer, _) = element
        if self.subsystems[reader].sender(peer) not in self.machines:
            return True
        return any(
            element not in self.upstream[above] and self.is_measured(above)
            for above in self.above[element]
        )

    def _upstream(self, element: Element) -> frozenset[Element]:
        found, open_ = {element}, [element]
        while open_:
            new = self.above[open_.pop()] - found
            found |= new
            open_ += new
        return frozenset(found)


def reads(expr: m.Expr, of: Subsystem, fresh: frozenset[Key]) -> Iterator[Read]:
    """What the value of an expression depends on where some inputs are known to be fresh."""
    match expr:
        case m.Input(peer=peer, element=name):
            yield (peer, name), (peer, name) in fresh
        case m.Fresh() | m.Present() | m.Lag():
            return
        case m.LetRef(name=name):
            yield from reads(of.let(name).value, of, fresh)
        case m.Logic(op=op, operands=operands):
            for part in operands:
                yield from reads(part, of, fresh)
                fresh |= told(part, of, holds=op == "and")
        case m.Choice(test=test, then=then, otherwise=otherwise):
            yield from reads(test, of, fresh)
            yield from reads(then, of, fresh | told(test, of, holds=True))
            yield from reads(otherwise, of, fresh | told(test, of, holds=False))
        case _:
            for part in m.children(expr):
                yield from reads(part, of, fresh)


def told(test: m.Expr, of: Subsystem, *, holds: bool) -> frozenset[Key]:
    """The inputs that are fresh where a test came out so, whatever else is the case."""
    match test:
        case m.Fresh(input=asked) if holds:
            return frozenset({(asked.peer, asked.element)})
        case m.Unary(op="not", operand=operand):
            return told(operand, of, holds=not holds)
        case m.LetRef(name=name):
            return told(of.let(name).value, of, holds=holds)
        case m.Logic(op=op, operands=operands):
            parts = [told(part, of, holds=holds) for part in operands]
            if (op == "and") == holds:
                return frozenset[Key]().union(*parts)
            return frozenset.intersection(*parts)
        case m.Choice(test=asked, then=then, otherwise=otherwise):
            one = told(asked, of, holds=True) | told(then, of, holds=holds)
            return one & (told(asked, of, holds=False) | told(otherwise, of, holds=holds))
    return frozenset()
