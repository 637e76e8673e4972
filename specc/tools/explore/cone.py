"""The cone of influence of a machine: everything that its abstract steps read, as a value.

`Walker` steps a machine from its cone and from nothing else. So machines with equal cones take
equal steps, and symmetry compares cones (`specc.tools.explore.symmetry`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from operator import itemgetter

from specc.analysis.reads import Dependences
from specc.lang.show import show
from specc.model import expr as m
from specc.model.types import Type
from specc.proof import InputName, Prover
from specc.reachable import reachable
from specc.tools.explore.partial import AbstractValue, KnownValues, residual
from specc.tools.explore.regions import BoundedUnknown

Renaming = Mapping[InputName, InputName]


@dataclass(frozen=True, slots=True)
class ConeRow:
    """A row of the transition table; `index` is its place there."""

    index: int
    target: str
    condition: str
    when: m.Expr
    sets: tuple[tuple[str, m.Expr], ...] = ()
    """Memory of modes that is followed, and the literals that it gets."""


@dataclass(frozen=True, slots=True)
class ConeEnding:
    """What ends a behaviour, and the rows that apply then."""

    condition: str
    when: m.Expr
    rows: tuple[ConeRow, ...]


@dataclass(frozen=True, slots=True)
class ConeState:
    """A state. `reads` are the inputs that its functions read, followed or not."""

    name: str
    endings: tuple[ConeEnding, ...]
    assignments: tuple[tuple[InputName, m.Expr], ...]
    """Values of memory and outputs that are followed; the peer of memory is ""."""
    failing: tuple[m.Expr, ...]
    """Values that its functions compute, followed or not, and that may fail."""
    reads: frozenset[InputName]
    ignores: frozenset[InputName]
    members: tuple[tuple[InputName, frozenset[str], frozenset[str]], ...]
    """Of events with an enum the members to which its conditions react, and its functions."""

    def members_in_conditions(self, event: InputName) -> frozenset[str]:
        """The members of an event to which its conditions react."""
        return next(
            (conditional for key, conditional, _ in self.members if key == event), frozenset()
        )

    def members_in_functions(self, event: InputName) -> frozenset[str]:
        """The members of an event to which its functions react."""
        return next((read for key, _, read in self.members if key == event), frozenset())

    @property
    def expressions(self) -> Iterator[m.Expr]:
        """Everything that its steps evaluate."""
        for end in self.endings:
            yield end.when
            yield from (row.when for row in end.rows)
        yield from (value for _, value in self.assignments)
        yield from self.failing

    @property
    def conditions(self) -> Iterator[m.Expr]:
        """The error and terminal conditions and those of the rows, where there are rows."""
        for end in self.endings:
            if end.rows and end.when != m.FALSE:
                yield end.when
                yield from (row.when for row in end.rows)


@dataclass(frozen=True, slots=True)
class ConeInput:
    """An input. `bounds` are those of an input that is not followed."""

    key: InputName
    type: Type
    init: m.Expr | None
    is_event: bool
    is_tracked: bool
    is_measured: bool
    is_steady: bool
    bounds: BoundedUnknown | None


@dataclass(frozen=True, slots=True)
class ConeMemory:
    """Memory that is followed. `bounds` hold at all times.

    If it `is_timer`, it counts the periods of a mode. If it `is_forgotten`, its value is never
    known after the start.
    """

    name: str
    type: Type
    init: m.Expr
    bounds: BoundedUnknown | None
    is_timer: bool = False
    is_forgotten: bool = False


@dataclass(frozen=True)
class Cone:
    """Everything that the steps of one machine read."""

    period_s: Fraction
    initial_state: str
    states: tuple[ConeState, ...]
    inputs: tuple[ConeInput, ...]
    outputs: tuple[tuple[InputName, Type], ...]
    memory: tuple[ConeMemory, ...]
    lets: tuple[tuple[str, m.Expr], ...]
    constants: tuple[tuple[str, m.Expr], ...]
    axioms: tuple[m.Expr, ...]
    always_present: frozenset[InputName]
    measured: frozenset[InputName]
    """Inputs, and memory without a peer, whose values are computed from measurements."""
    prover: Prover = field(compare=False)
    """What it answers follows from the lets, constants, axioms, period and `always_present`."""

    @cached_property
    def dependences(self) -> Dependences:
        """The dependences of its expressions."""
        return Dependences(dict(self.lets))

    @cached_property
    def state(self) -> dict[str, ConeState]:
        """The states by name."""
        return {state.name: state for state in self.states}

    @cached_property
    def row_sets(self) -> dict[int, dict[str, m.Expr]]:
        """What each row sets, by its index; nothing for -1, which takes no row."""
        rows = (row for state in self.states for end in state.endings for row in end.rows)
        return {-1: {}} | {row.index: dict(row.sets) for row in rows}

    def is_measured(self, expr: m.Expr) -> bool:
        """Whether an expression is computed from measurements, or from ages."""
        rests = self.dependences.of(expr)
        memory = {("", name) for name in rests.memory}
        return rests.has_lag or not self.measured.isdisjoint(rests.inputs | memory)

    @property
    def static_values(self) -> KnownValues:
        """The values that are known at all times."""
        return KnownValues(dict(self.lets), dict(self.constants), self.period_s)

    @cached_property
    def normal_form(self) -> Cone:
        """The cone with lets and constants filled in, and everything without an order sorted."""
        known = self.static_values
        transformed = self._transformed(lambda expr: normalized(residual(expr, known)), {}, {})
        exprs = [*transformed.axioms, *(item.init for item in transformed.memory)]
        exprs += [expr for state in transformed.states for expr in state.expressions]
        lets, constants = named_definitions(exprs, self.dependences, known.constants)
        lets = tuple((let, normalized(value)) for let, value in lets)
        return replace(transformed, lets=lets, constants=constants)

    @cached_property
    def size(self) -> int:
        """How many parts the expressions of the normal form have, and the lets that these name."""
        normal = self.normal_form
        every = [expr for state in normal.states for expr in state.expressions]
        every += [*normal.axioms, *(value for _, value in normal.lets)]
        return sum(1 for expr in every for _ in m.walk(expr))

    def renamed(self, inputs: Renaming, outputs: Renaming) -> Cone:
        """The normal form of the cone with other names of inputs and outputs."""
        transformed = self.normal_form._transformed(
            lambda expr: renamed(expr, inputs), inputs, outputs
        )
        lets = tuple((let, renamed(value, inputs)) for let, value in transformed.lets)
        return replace(transformed, lets=lets)

    def _transformed(
        self, change: Callable[[m.Expr], m.Expr], inputs: Renaming, outputs: Renaming
    ) -> Cone:
        """The cone with its expressions changed, and with other names of inputs and outputs."""

        def name(key: InputName) -> InputName:
            return inputs.get(key, key)

        inputs_ = (
            replace(x, key=name(x.key), init=None if x.init is None else change(x.init))
            for x in self.inputs
        )
        sent = ((outputs.get(key, key), type_) for key, type_ in self.outputs)
        return replace(
            self,
            states=tuple(_renamed_state(state, change, name, outputs) for state in self.states),
            inputs=tuple(sorted(inputs_, key=lambda x: x.key)),
            outputs=tuple(sorted(sent, key=itemgetter(0))),
            memory=tuple(replace(item, init=change(item.init)) for item in self.memory),
            axioms=tuple(map(change, self.axioms)),
            always_present=frozenset(map(name, self.always_present)),
            measured=frozenset(map(name, self.measured)),
        )


def _renamed_state(
    state: ConeState,
    change: Callable[[m.Expr], m.Expr],
    name: Callable[[InputName], InputName],
    outputs: Renaming,
) -> ConeState:
    endings = (
        replace(
            end,
            when=change(end.when),
            rows=tuple(replace(row, when=change(row.when)) for row in end.rows),
        )
        for end in state.endings
    )
    assigned = {outputs.get(key, key): change(value) for key, value in state.assignments}
    return ConeState(
        state.name,
        tuple(endings),
        tuple((key, assigned[key]) for key in sorted(assigned)),
        tuple(sorted(map(change, state.failing), key=show)),
        frozenset(map(name, state.reads)),
        frozenset(map(name, state.ignores)),
        tuple(sorted(((name(key), a, r) for key, a, r in state.members), key=itemgetter(0))),
    )


def named_definitions(
    exprs: Iterable[m.Expr], dependences: Dependences, constants: Mapping[str, m.Expr]
) -> tuple[tuple[tuple[str, m.Expr], ...], tuple[tuple[str, m.Expr], ...]]:
    """The lets and the constants that expressions name, directly or through others, in order."""
    every = list(exprs)

    def named(name: str) -> Iterator[str]:
        nodes = m.walk(constants[name])
        return (node.name for node in nodes if isinstance(node, m.ConstantRef))

    needed = reachable(dependences.all(every).constants, named)
    used = ((name, value) for name, value in constants.items() if name in needed)
    return tuple(dependences.lets(every).items()), tuple(used)


def normalized(expr: m.Expr) -> m.Expr:
    """An expression with the parts of `and` and `or` in one order."""
    ordered = m.map_children(expr, normalized)
    return _sort_operands(ordered) if isinstance(ordered, m.Logic) else ordered


def renamed(expr: m.Expr, names: Renaming) -> m.Expr:
    """An expression that is in order, with other names of inputs, and in order again."""
    if isinstance(expr, m.Input):
        new = names.get(expr.key, expr.key)
        return expr if new == expr.key else replace(expr, peer=new[0], element=new[1])
    ordered = m.map_children(expr, lambda part: renamed(part, names))
    return (
        _sort_operands(ordered) if isinstance(ordered, m.Logic) and ordered is not expr else ordered
    )


def _sort_operands(expr: m.Logic) -> m.Logic:
    return replace(expr, operands=tuple(sorted(expr.operands, key=show)))


class InputUse:
    """The inputs that the states of one machine read."""

    def __init__(self, cone: Cone) -> None:
        self._state = cone.state
        self.events = {x.key for x in cone.inputs if x.is_event}
        self.read_by_conditions: dict[str, frozenset[InputName]] = {"": frozenset()}
        """The inputs that conditions read, by state."""
        for state in cone.states:
            self.read_by_conditions[state.name] = cone.dependences.all(state.conditions).inputs
        self.read_by_functions = {state.name: state.reads for state in cone.states}
        """The inputs that functions read, by state."""

    def lost_inputs(
        self,
        new: Iterable[InputName],
        values: Mapping[InputName, AbstractValue],
        source: str,
        target: str,
    ) -> Iterator[tuple[InputName, str]]:
        """The new inputs that neither the conditions of one state nor the functions of the next
        read; and events with a member to which these do not react, with that member.
        """
        read = self.read_by_functions[target] | self.read_by_conditions[source]
        for key in new:
            if key in self._state[source or target].ignores:
                continue
            value = values.get(key) if key in self.events else None
            if key not in read:
                yield key, ""
            elif isinstance(value, m.Member) and value.name not in self._members_read(
                key, source, target
            ):
                yield key, value.name

    def _members_read(self, key: InputName, source: str, target: str) -> frozenset[str]:
        """The members of an input to which a step from a state to another reacts."""
        in_conditions = self._state[source].members_in_conditions(key) if source else frozenset()
        return in_conditions | self._state[target].members_in_functions(key)
