"""The abstract successors of one machine, one period at a time.

A condition on unknown values may be true or false, except for combinations that the proofs
exclude. The answer is remembered until one of these values is renewed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

from specc.analysis.reads import Dependence
from specc.model import expr as m
from specc.model.logic import conjuncts, negation
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.tools.explore.attention import Attention
from specc.tools.explore.cone import Cone, renamed
from specc.tools.explore.moves import OVER, STAYS, Branch, Local, Move, Outcome, SentValues
from specc.tools.explore.partial import SOME, AbstractValue, Known, fails, filled
from specc.tools.explore.regions import leaves
from specc.tools.explore.timing import Clocks
from specc.tools.explore.values import ABSENT, Numbers, ValueNumbers, combinable

MOST_REMEMBERED = 12
"""Answers about unknown values; with more of them, all are forgotten."""


class Walker:
    """Steps one machine. `exact` says whether time in a state is counted or only passes."""

    def __init__(self, cone: Cone, subsystem: Subsystem, values: ValueNumbers, *, exact: bool):
        """`subsystem` has the names and places for messages; no step reads it."""
        self.cone = cone
        self.subsystem = subsystem
        self.name = subsystem.qualified_name
        self.values = values
        followed = [x.key for x in cone.inputs if x.is_followed]
        others = [x for x in cone.inputs if not x.is_followed]
        self.inputs = tuple(followed)
        self.slots = {key: index for index, key in enumerate(followed)}
        self.attention = Attention(cone)
        self.events = self.attention.events
        self._inits = {x.key: x.init for x in cone.inputs}
        self._outputs = dict(cone.outputs)
        self.memory_slots = {item.name: slot for slot, item in enumerate(cone.memory)}
        self._within = {item.name: item.within for item in cone.memory}
        self.static = cone.static
        self.clocks = Clocks(cone, self.static, exact=exact)
        self._steady = {x.key for x in others if x.is_steady}
        self._measured = {x.key for x in others if x.is_measured}
        self._noise = {x.key: x.within for x in others if x.within is not None}
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
        self.measured: set[str] = set()
        """Those of `Move.free` that rest on measurements."""
        self.kind = self.name
        """The name of the first of the machines that are the same as this one."""

    def join(self, first: Walker) -> None:
        """Share the results and the numbers of an equal machine."""
        self.kind = first.name
        self.locals, self._formulas, self.assumed = first.locals, first._formulas, first.assumed
        self._steps, self._possible, self.open = first._steps, first._possible, first.open
        self._periods, self.measured = first._periods, first.measured

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
            init = self._inits[key]
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
            for i in self.cone.memory
        }
        begin = Branch(-1, self.cone.initial_state, ())
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
            yield _failed(local, local.state, broken=broken)
        free = self._free(branches, known, local.state) if len(branches) > 1 else ()
        free += (f"how long `{local.state}` has lasted",) if several else ()
        for branch in branches:
            if branch.fails:
                yield _failed(local, local.state, free)
                continue
            kept = (self._remembered(part) for part in branch.holds)
            now = local._replace(answers=local.answers.union(*kept))
            yield from self._outcomes(branch, known, now, buffers, free)

    def branches(self, state: str, known: Known) -> Iterator[Branch]:
        """The branches: staying, and each row that known values do not exclude."""
        before: list[m.Expr] = []
        for end in self.cone.state[state].endings:
            ended = known.fill_in(end.when)
            if ended == m.FALSE:
                continue
            if fails(ended):
                yield Branch(-1, state, tuple(before), fails=True)
                return
            self._doubt(ended, known)
            for row in end.rows:
                enabled = known.fill_in(row.when)
                # The first of several is evaluated in any case.
                if fails(enabled) and row == end.rows[0] and len(end.rows) > 1:
                    yield Branch(-1, state, (*before, ended), fails=True)
                    break
                if enabled != m.FALSE:
                    self._doubt(enabled, known)
                    yield Branch(row.index, row.target, (*before, ended, enabled))
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
            self._possible[key] = self.cone.prover.satisfiable(formulas) is not False
        return self._possible[key]

    def _free(self, branches: list[Branch], known: Known, state: str) -> tuple[str, ...]:
        """The conditions that could have turned out otherwise."""
        found: dict[str, None] = {}
        taken = {b.row for b in branches}
        for end in self.cone.state[state].endings:
            conditions = [(end.condition, end.when)]
            conditions += [(row.condition, row.when) for row in end.rows if row.index in taken]
            for name, when in conditions:
                asked = known.fill_in(when)
                if not isinstance(asked, m.Truth):
                    found[f"`{name}`"] = None
                    if self.cone.is_measured(asked):
                        self.measured.add(f"`{name}`")
        self.open.setdefault(state, {}).update(found)
        return tuple(found)

    def _assumptions(self, known: Known) -> tuple[int, ...]:
        broken = []
        for index, axiom in enumerate(self.cone.axioms):
            said = filled(axiom, known)
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
        if any(fails(filled(value, known)) for value in self.cone.state[branch.target].failing):
            yield _failed(before, before.state or branch.target, free)
            return
        written = dict[InputName, tuple[int, ...]]()
        for key, value in self.written(branch.target, known):
            target = self._target(key)
            output = self._outputs[key] if key[0] else None
            written[key] = self.values.options(target, value, known, sent=output)
            if not key[0]:
                answers = self._without(answers, key[1])
            if len(written[key]) > 1:
                free += (f"what `{key[1]}` is",)
                if self.cone.is_measured(value):
                    self.measured.add(free[-1])
        if len(answers) > MOST_REMEMBERED:
            answers = frozenset()
        lost = tuple(self._lost(buffers, known, before.state, branch.target))
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
        for (peer, name), assigned in self.cone.state[state].assignments:
            value = filled(assigned, known)
            if peer or not (isinstance(value, m.MemoryRef) and value.name == name):
                yield (peer, name), value

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

    def _lost(
        self, buffers: tuple[int, ...], known: Known, source: str, target: str
    ) -> Iterator[tuple[InputName, str]]:
        """Fresh inputs that a step does not look at, or react to.

        Measurements that are events are assumed fresh in every period but the first.
        """
        new = [key for key, slot in self.slots.items() if buffers[slot] % 2]
        new += sorted(self.events & self._measured) if source else []
        return self.attention.lost(new, known.inputs, source, target)

    def may_be_absent(self, key: InputName) -> bool:
        """Whether a measurement that is assumed fresh may be absent."""
        return key in self._measured and key not in self._steady

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
        return (self._within[memory] or value) if value in (None, SOME) else value

    # Answers about unknown values.

    def _rests(self, formula: int) -> Dependence:
        return self.cone.rests.of(self._formulas.things[formula])

    def _remembered(self, expr: m.Expr) -> Iterator[int]:
        """The formulas that stay true until an input or memory is renewed, by number."""
        for part in conjuncts(expr):
            rests = self.cone.rests.of(part)
            changes = rests.has_clock or rests.has_lag
            if part != m.TRUE and not changes and rests.inputs <= self.slots.keys():
                yield self._formulas.of(part)


def _name(leaf: m.Input | m.MemoryRef) -> str:
    return leaf.name if isinstance(leaf, m.MemoryRef) else f"x.{leaf.peer}.{leaf.element}"


def _failed(
    local: Local, state: str, free: tuple[str, ...] = (), broken: tuple[int, ...] = ()
) -> tuple[Local, Move]:
    """A machine whose step failed, and that step."""
    return local._replace(state=state, clock=OVER), Move(state, state, -1, (), free, (), broken)
