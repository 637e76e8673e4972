"""The abstract successors of one machine, one period at a time.

A condition on unknown values may be true or false, except for combinations that the proofs
exclude. The answer is remembered until one of these values is renewed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

from specc.analysis.reads import Dependence
from specc.frozen import frozen
from specc.model import expr as m
from specc.model.logic import conjuncts, negation
from specc.proof import InputName
from specc.tools.explore.abstraction import Abstraction, Kept, conditions_of
from specc.tools.explore.partial import SOME, AbstractValue, Known, filled, static
from specc.tools.explore.regions import leaves
from specc.tools.explore.symmetry import renamed
from specc.tools.explore.timing import Clocks
from specc.tools.explore.values import ABSENT, Numbers, ValueNumbers, combinable

OVER = -1
"""The clock of a machine that has failed: others go on until its outputs are due."""
STAYS = -2
"""In place of the clock of a machine that stays in its state: it is set by what steps it."""
MOST_REMEMBERED = 12
"""Answers about unknown values; with more of them, all are forgotten."""
SentValues = tuple[tuple[InputName, int], ...]
"""Outputs with the numbers of their values."""


class Local(NamedTuple):
    """A machine between two periods: memory in numbers, and answers about unknown values."""

    state: str
    clock: int
    memory: tuple[int, ...]
    answers: frozenset[int]


class Move(NamedTuple):
    """The step of a machine at a time stamp.

    `row` is an index, -1 for none. `free` are the conditions that could have turned out otherwise;
    `lost` are inputs that were fresh and not looked at; `broken` are assumptions that failed.
    """

    source: str
    target: str
    row: int
    sent: SentValues
    free: tuple[str, ...] = ()
    lost: tuple[InputName, ...] = ()
    broken: tuple[int, ...] = ()


class Outcome(NamedTuple):
    """A possible result of a period: the number of the machine after it, and its move.

    If a fault `ends` the run, the machine has not moved.
    """

    local: int
    move: Move
    ends: bool = False


@frozen
class Branch:
    """A branch of a period: the row, or -1, and the conditions that hold on it."""

    row: int
    target: str
    holds: tuple[m.Expr, ...]


class Walker:
    """Steps one machine. `exact` says whether time in a state is counted or only passes."""

    def __init__(self, kept: Kept, abstraction: Abstraction, values: ValueNumbers, *, exact: bool):
        self.kept = kept
        self.subsystem = kept.subsystem
        self.name = self.subsystem.qualified_name
        self.values = values
        self.inputs = tuple(key for key in self.subsystem.inputs if key in kept.inputs)
        self.slots = {key: index for index, key in enumerate(self.inputs)}
        self.events = {key for key, element in self.subsystem.inputs.items() if element.event}
        self._ignores = {state.name: frozenset(state.ignores) for state in self.subsystem.states}
        self._memory = tuple(i for i in self.subsystem.memory if i.name in kept.memory)
        self.memory_slots = {item.name: slot for slot, item in enumerate(self._memory)}
        self.within = dict(kept.memory_within())
        """What unknown memory lies within at all times."""
        self.static = static(self.subsystem, abstraction.facts.system)
        self.clocks = Clocks(kept, self.static, exact=exact)
        others = [key for key in self.subsystem.inputs if key not in kept.inputs]
        self._steady = {key for key in others if abstraction.is_steady(self.name, key)}
        self._measured = {key for key in others if abstraction.sender_of(self.name, key) is None}
        self._noise = {key: v for key in others if (v := abstraction.noise_within(self.name, key))}
        self.locals = Numbers()
        self._formulas = Numbers()
        self._steps: dict[tuple[int, tuple[int, ...]], tuple[Outcome, ...]] = {}
        self._periods: dict[tuple[Local, tuple[int, ...], bool], list[tuple[Local, Move]]] = {}
        """The results of a period: by the machine, with the number of turns in place of its clock,
        its buffers, and whether other clocks are possible."""
        self._possible: dict[frozenset[int], bool] = {}
        self.assumed: dict[int, set[bool | None]] = {}
        """The truth values of assumptions, by index; None where unknown."""
        self.open: dict[str, dict[str, None]] = {}
        """By state, the conditions that could turn out either way."""
        self.kind = self.name
        """The name of the first of the machines that are the same as this one."""

    def join(self, first: Walker) -> None:
        """Share the results and the numbers of an equal machine."""
        self.kind = first.name
        self.locals, self._formulas, self.assumed = first.locals, first._formulas, first.assumed
        self._steps, self._possible, self.open = first._steps, first._possible, first.open
        self._periods = first._periods

    def renamed(self, local: int, names: Mapping[InputName, InputName]) -> int:
        """The number of the machine in which the inputs have other names."""
        now: Local = self.locals.things[local]
        if not now.answers:
            return local
        formulas = (renamed(self._formulas.things[a], names) for a in now.answers)
        answers = frozenset(map(self._formulas.of, formulas))
        return self.locals.of(now._replace(answers=answers))

    # The first period, and any other.

    def begin(self) -> tuple[int, ...]:
        """The buffers before the first arrival."""
        found = []
        for key in self.inputs:
            init = self.subsystem.inputs[key].init
            value = None if init is None else filled(init, self.static)
            target = f"{self.kind}.x.{key[0]}.{key[1]}"
            found.append(ABSENT if value is None else self.values.of(target, value, self.static))
        return tuple(found)

    def start(self, buffers: tuple[int, ...]) -> Outcome:
        """The first period: memory gets its values, no condition is evaluated."""
        known = self._known(buffers, {}, first=True)
        known.periods = 0
        memory = {
            i.name: self.values.of(self._target(("", i.name)), filled(i.init, known), known)
            for i in self._memory
        }
        begin = Branch(-1, self.subsystem.initial_state, ())
        known = self._known(buffers, memory, first=True)
        first = Local("", OVER, tuple(memory.values()), frozenset())
        ((begun, move),) = self._outcomes(begin, known, first, buffers)
        return Outcome(self.locals.of(begun), move)

    def step(self, local: int, buffers: tuple[int, ...]) -> tuple[Outcome, ...]:
        """All possible results of a period."""
        key = local, buffers
        if key not in self._steps:
            self._steps[key] = tuple(
                dict.fromkeys(self._stepped(self.locals.things[local], buffers))
            )
        return self._steps[key]

    def _stepped(self, local: Local, buffers: tuple[int, ...]) -> Iterator[Outcome]:
        new = {key for key, slot in self.slots.items() if buffers[slot] % 2}
        answers = frozenset(a for a in local.answers if not self._rests(a).inputs & new)
        known = self.before(local, buffers)
        clocks = self.clocks.after(local.state, local.clock, known)
        for clock in clocks:
            turned = self.clocks.turned(local.state, clock, known)
            key = local._replace(clock=turned, answers=answers), buffers, len(clocks) > 1
            if key not in self._periods:
                self.clocks.set(known, local.state, clock)
                self._periods[key] = list(self._period(known, *key))
            for after, move in self._periods[key]:
                ends = after.clock == OVER
                after = after._replace(clock=clock) if after.clock == STAYS else after
                yield Outcome(self.locals.of(after), move, ends)

    def _period(
        self, known: Known, local: Local, buffers: tuple[int, ...], several: bool
    ) -> Iterator[tuple[Local, Move]]:
        """The machine after a period, which is the same until a condition turns."""
        broken = self._assumptions(known)
        branches = [] if broken else list(self.branches(local.state, known))
        branches = [each for each in branches if self._may(each, local.answers)]
        if not branches:
            nothing = Move(local.state, local.state, -1, (), (), (), broken)
            yield local._replace(clock=OVER), nothing
        free = self._free(branches, known, local.state) if len(branches) > 1 else ()
        free += (f"how long `{local.state}` has lasted",) if several else ()
        for branch in branches:
            kept = (self._remembered(part) for part in branch.holds)
            now = local._replace(answers=local.answers.union(*kept))
            yield from self._outcomes(branch, known, now, buffers, free)

    def branches(self, state: str, known: Known) -> Iterator[Branch]:
        """The branches: staying, and each row that known values do not exclude."""
        before: list[m.Expr] = []
        for cause, end in self.subsystem.state(state).behaviour.endings:
            ended = known.asked(end.when)
            if ended == m.FALSE:
                continue
            self._doubt(ended, known)
            for index, row in self.subsystem.rows(state, cause):
                enabled = known.asked(row.condition.when)
                if enabled != m.FALSE:
                    self._doubt(enabled, known)
                    yield Branch(index, row.target, (*before, ended, enabled))
            before.append(negation(ended))
            if ended == m.TRUE:
                return
        yield Branch(-1, state, tuple(before))

    def _doubt(self, asked: m.Expr, known: Known) -> None:
        """Note values whose region is not enough for a decision."""
        if known.is_unclear(asked):
            self.values.widened |= {f"{self.kind}.{_name(leaf)}" for leaf in leaves(asked)}

    def _may(self, branch: Branch, answers: frozenset[int]) -> bool:
        """Whether the proofs allow a branch and remembered answers to hold together."""
        asked = {self._formulas.of(e) for e in branch.holds if e != m.TRUE}
        if not asked:
            return True
        key = answers | asked
        if key not in self._possible:
            formulas = [self._formulas.things[number] for number in sorted(key)]
            self._possible[key] = self.kept.machine.prover.satisfiable(formulas) is not False
        return self._possible[key]

    def _free(self, branches: list[Branch], known: Known, state: str) -> tuple[str, ...]:
        """The conditions that could have turned out otherwise."""
        found: dict[str, None] = {}
        for cause, end in self.subsystem.state(state).behaviour.endings:
            rows = self.subsystem.rows(state, cause)
            taken = {b.row for b in branches}
            for condition in (end, *(row.condition for i, row in rows if i in taken)):
                if not isinstance(known.asked(condition.when), m.Truth):
                    found[f"`{condition.name}`"] = None
        self.open.setdefault(state, {}).update(found)
        return tuple(found)

    def _assumptions(self, known: Known) -> tuple[int, ...]:
        broken = []
        for index, axiom in enumerate(self.subsystem.axioms):
            said = filled(axiom.that, known)
            answer = said.value if isinstance(said, m.Truth) else None
            self._doubt(said, known)
            self.assumed.setdefault(index, set()).add(answer)
            if answer is False:
                broken.append(index)
        return tuple(broken)

    # Executing the behaviour of a state.

    def _outcomes(
        self,
        branch: Branch,
        known: Known,
        before: Local,
        buffers: tuple[int, ...],
        free: tuple[str, ...] = (),
    ) -> Iterator[tuple[Local, Move]]:
        """The machine after a branch; its clock is `STAYS` where no state is entered."""
        answers, stays = before.answers, branch.row < 0 and before.state != ""
        known = known if stays else replace(known, periods=0, _lets={})
        written = dict[InputName, tuple[int, ...]]()
        for key, value in self.written(branch.target, known):
            target = self._target(key)
            output = self.subsystem.outputs[key].type if key[0] else None
            written[key] = self.values.options(target, value, known, sent=output)
            if not key[0]:
                answers = self._without(answers, key[1])
        if len(answers) > MOST_REMEMBERED:
            answers = frozenset()
        free += tuple(f"what `{name}` is" for (_, name), n in written.items() if len(n) > 1)
        lost = self._lost(buffers, before.state, branch.target)
        clock = STAYS if stays else self.clocks.begin(branch.target)
        written, memory = combinable(written), self._named(before.memory)
        for numbers in product(*written.values()):
            values = dict(zip(written, numbers, strict=True))
            kept = tuple(values.get(("", name), number) for name, number in memory.items())
            now = Local(branch.target, clock, kept, answers)
            sent = tuple(sorted((key, number) for key, number in values.items() if key[0]))
            yield now, Move(before.state, branch.target, branch.row, sent, free, lost)

    def written(self, state: str, known: Known) -> Iterator[tuple[InputName, m.Expr]]:
        """The values that the functions of a state give to kept outputs and memory."""
        for item in self.subsystem.state(state).behaviour.assignments:
            key = item.peer, item.name
            if key in self.kept.outputs or (not item.peer and item.name in self.memory_slots):
                value = filled(item.value, known)
                if item.peer or not (isinstance(value, m.MemoryRef) and value.name == item.name):
                    yield key, value

    def _target(self, key: InputName) -> str:
        peer, name = key
        return f"{self.kind}.y.{peer}.{name}" if peer else f"{self.kind}.{name}"

    def given(self, local: Local, sent: SentValues) -> dict[InputName, int]:
        """The numbers of what memory and outputs have after a step."""
        memory = self._named(local.memory).items()
        return {**{("", name): number for name, number in memory}, **dict(sent)}

    def follows(self, local: Local, sent: SentValues) -> bool:
        """Whether the values that memory and outputs come to have are followed."""
        given = self.given(local, sent).items()
        return all(self.values.follows(self._target(key), number) for key, number in given)

    def _without(self, answers: frozenset[int], memory: str) -> frozenset[int]:
        return frozenset(a for a in answers if memory not in self._rests(a).memory)

    def _lost(self, buffers: tuple[int, ...], source: str, target: str) -> tuple[InputName, ...]:
        """Fresh inputs that neither the conditions nor the functions look at.

        Measurements that are events are assumed fresh in every period but the first.
        """
        new = [key for key, slot in self.slots.items() if buffers[slot] % 2]
        new += sorted(self.events & self._measured) if source else []
        if not new:
            return ()
        looked = self.looks_into[target] | self.looks_at.get(source, frozenset())
        looked |= self._ignores[source or target]
        return tuple(key for key in new if key not in looked)

    def may_be_absent(self, key: InputName) -> bool:
        """Whether a measurement that is assumed fresh may be absent."""
        return key in self._measured and key not in self._steady

    @cached_property
    def looks_at(self) -> dict[str, frozenset[InputName]]:
        """The inputs that conditions ask about, by state."""
        states = (state.name for state in self.subsystem.states)
        return {s: self.kept.rests.all(conditions_of(self.subsystem, s)).inputs for s in states}

    @cached_property
    def looks_into(self) -> dict[str, frozenset[InputName]]:
        """The inputs that functions read, by state."""
        return {
            state.name: self.kept.rests.all(i.value for i in state.behaviour.assignments).inputs
            for state in self.subsystem.states
        }

    # Known values at a time stamp.

    def before(self, local: Local, buffers: tuple[int, ...]) -> Known:
        """The known values before a step."""
        return self._known(buffers, self._named(local.memory))

    def _named(self, memory: tuple[int, ...]) -> dict[str, int]:
        return dict(zip(self.memory_slots, memory, strict=True))

    def _known(
        self, buffers: tuple[int, ...], memory: dict[str, int], *, first: bool = False
    ) -> Known:
        base = self.static
        known = Known(base.lets, base.constants, base.period_s, turns=base.turns)
        fresh, present, inputs = {}, {}, {}
        for key, slot in self.slots.items():
            number, new = divmod(buffers[slot], 2)
            fresh[key], present[key] = bool(new), number != ABSENT
            value = self.values.value(number)
            if value is not None:
                inputs[key] = value
        for key in () if first else self._steady:
            fresh[key] = present[key] = True
        for key in self._measured:
            present[key] = True
        known.fresh, known.present, known.inputs = fresh, present, {**self._noise, **inputs}
        values = ((name, self.valued(name, number)) for name, number in memory.items())
        known.memory = {name: value for name, value in values if value is not None}
        return known

    def valued(self, memory: str, number: int) -> AbstractValue | None:
        """What is known of memory by the number of its value."""
        value = self.values.value(number)
        return (self.within.get(memory) or value) if value in (None, SOME) else value

    # Answers about unknown values.

    def _rests(self, formula: int) -> Dependence:
        return self.kept.rests.of(self._formulas.things[formula])

    def _remembered(self, expr: m.Expr) -> Iterator[int]:
        """The formulas that stay true until an input or memory is renewed, by number."""
        for part in conjuncts(expr):
            rests = self.kept.rests.of(part)
            changes = rests.clock or rests.lags
            if part != m.TRUE and not changes and rests.inputs <= self.slots.keys():
                yield self._formulas.of(part)


def _name(leaf: m.Input | m.MemoryRef) -> str:
    return leaf.name if isinstance(leaf, m.MemoryRef) else f"x.{leaf.peer}.{leaf.element}"
