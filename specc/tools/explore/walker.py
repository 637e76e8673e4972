"""The abstract successors of one machine, one period at a time.

A condition on unknown values may be true or false, except for combinations that the proofs
exclude. The answer is remembered until one of these values is renewed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from itertools import product

from specc.analysis.reads import Dependence
from specc.model import expr as m
from specc.model.expr import conjuncts, negation
from specc.model.fsm import mode_of
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.tools.explore.cone import Cone, InputUse, renamed
from specc.tools.explore.cuts import target_name
from specc.tools.explore.liveness import live_inputs, live_memory
from specc.tools.explore.partial import SOME, AbstractValue, KnownValues, residual, surely_fails
from specc.tools.explore.ranking import change
from specc.tools.explore.regions import Region, value_leaves
from specc.tools.explore.timing import Clocks, mode_timers
from specc.tools.explore.transitions import (
    FAILED,
    SAME_STATE,
    Branch,
    MachineState,
    Successor,
    Transition,
)
from specc.tools.explore.values import (
    ABSENT,
    UNKNOWN,
    Interner,
    ValueTable,
    limit_combinations,
)

MOST_REMEMBERED = 12
"""The most answers about unknown values; with more, all are forgotten."""


class Walker:
    """Steps one machine. `exact` says whether time is counted or only passes."""

    def __init__(
        self,
        cone: Cone,
        subsystem: Subsystem,
        values: ValueTable,
        *,
        exact: bool,
        observed: Collection[str] = (),
    ) -> None:
        """`subsystem` is only for the names and places in messages.

        Memory that is `observed` is tracked even where the machine does not read it any more.
        """
        self.cone = cone
        self.subsystem = subsystem
        self.name = subsystem.qualified_name
        self.values = values
        tracked = [x.key for x in cone.inputs if x.is_tracked]
        others = [x for x in cone.inputs if not x.is_tracked]
        self.inputs = tuple(tracked)
        self.slots = {key: index for index, key in enumerate(tracked)}
        self.input_use = InputUse(cone)
        self.events = self.input_use.events
        self._inits = {x.key: x.init for x in cone.inputs}
        self._outputs = dict(cone.outputs)
        self.memory_slots = {item.name: slot for slot, item in enumerate(cone.memory)}
        self._live_memory, self._live_inputs = live_memory(cone, observed), live_inputs(cone)
        forgotten_memory = {item.name for item in cone.memory if item.is_forgotten}
        self._tracked_memory = {
            state: names - forgotten_memory for state, names in self._live_memory.items()
        }
        self._memory_bounds = {item.name: item.bounds for item in cone.memory}
        self.static_values = cone.static_values
        self.clocks = Clocks(cone, self.static_values, counts_periods=exact)
        self.mode_timers = mode_timers(cone, self.static_values, counts=exact)
        self._steady = {x.key for x in others if x.is_steady}
        self._measured = {x.key for x in others if x.is_measured}
        self._noise_bounds = {x.key: x.bounds for x in others if x.bounds is not None}
        self.states = Interner()
        self._formulas = Interner()
        self._successor_cache: dict[tuple[int, tuple[int, ...]], tuple[Successor, ...]] = {}
        self._period_cache: dict[
            tuple[MachineState, tuple[int, ...], bool], list[tuple[MachineState, Transition]]
        ] = {}
        """The results of a period: by the machine, with the number of turns in place of its clock,
        its buffers, and whether other clocks are possible."""
        self._possible: dict[frozenset[int], bool] = {}
        self.assumption_truths: dict[int, set[bool | None]] = {}
        """The truth values of assumptions, by index; None where unknown."""
        self.open_conditions: dict[str, dict[str, None]] = {}
        """By state, the conditions that could turn out either way."""
        self.measured_choices: set[str] = set()
        """The `Transition.choices` that rest on measurements."""
        self.kind = self.name
        """The name of the first of the machines that are the same as this one."""

    def share_results(self, first: Walker) -> None:
        """Share the results and the numbers of an equal machine."""
        self.kind = first.name
        self.states, self._formulas, self.assumption_truths = (
            first.states,
            first._formulas,
            first.assumption_truths,
        )
        self._successor_cache, self._possible, self.open_conditions = (
            first._successor_cache,
            first._possible,
            first.open_conditions,
        )
        self._period_cache, self.measured_choices = first._period_cache, first.measured_choices

    def renamed(self, local: int, names: Mapping[InputName, InputName]) -> int:
        """The number of the state in which inputs have other names."""
        now: MachineState = self.states.by_number[local]
        if not now.answers:
            return local
        formulas = (renamed(self._formulas.by_number[a], names) for a in now.answers)
        answers = frozenset(map(self._formulas.number, formulas))
        return self.states.number(now._replace(answers=answers))

    # The first period, and any other.

    def initial_buffers(self) -> tuple[int, ...]:
        """The buffers before the first arrival."""
        found = []
        for key in self.inputs:
            init = self._inits[key]
            value = None if init is None else residual(init, self.static_values)
            target = f"{self.kind}.x.{key[0]}.{key[1]}"
            found.append(
                ABSENT
                if value is None
                else self.values.number_of(target, value, self.static_values)
            )
        return tuple(found)

    def after_reading(self, local: int, buffers: tuple[int, ...]) -> tuple[int, ...]:
        """The buffers after a step to a machine state: nothing is fresh, dead values are gone."""
        live = self._live_inputs[self.states.by_number[local].state]
        return tuple(
            [
                number & ~1 if key in live or number // 2 == ABSENT else 2 * UNKNOWN
                for key, number in zip(self.inputs, buffers, strict=True)
            ]
        )

    def first_step(self, buffers: tuple[int, ...]) -> Successor:
        """The first period: memory gets its values, no condition is evaluated."""
        known = self._known_values(buffers, {}, first=True)
        known.periods = 0
        memory = {
            i.name: self.values.number_of(
                self._target(("", i.name)), residual(i.init, known), known
            )
            for i in self.cone.memory
        }
        branch = Branch(-1, self.cone.initial_state, ())
        known = self._known_values(buffers, memory, first=True)
        first = MachineState("", FAILED, tuple(memory.values()), frozenset())
        ((state, move),) = self._execute(branch, known, first, buffers)
        return Successor(self.states.number(state), move)

    def successors(self, local: int, buffers: tuple[int, ...]) -> tuple[Successor, ...]:
        """All possible results of a period."""
        key = local, buffers
        if key not in self._successor_cache:
            self._successor_cache[key] = tuple(
                dict.fromkeys(self._compute_successors(self.states.by_number[local], buffers))
            )
        return self._successor_cache[key]

    def _compute_successors(
        self, local: MachineState, buffers: tuple[int, ...]
    ) -> Iterator[Successor]:
        new = {key for key, slot in self.slots.items() if buffers[slot] % 2}
        answers = frozenset(a for a in local.answers if not self._dependence(a).inputs & new)
        known = self.known_before(local, buffers)
        clocks = self.clocks.next_clocks(local.state, local.clock, known)
        for clock in clocks:
            turns = self.clocks.turns_passed(local.state, clock, known)
            key = local._replace(clock=turns, answers=answers), buffers, len(clocks) > 1
            if key not in self._period_cache:
                self.clocks.set_time(known, local.state, clock)
                self._period_cache[key] = list(self._period_results(known, *key))
            for after, move in self._period_cache[key]:
                ends = after.clock == FAILED
                after = after._replace(clock=clock) if after.clock == SAME_STATE else after
                yield Successor(self.states.number(after), move, ends)

    def _period_results(
        self, known: KnownValues, local: MachineState, buffers: tuple[int, ...], several: bool
    ) -> Iterator[tuple[MachineState, Transition]]:
        """The machine after a period, which is the same until a condition turns."""
        broken = self._broken_assumptions(known)
        branches = [] if broken else list(self.branches(local.state, known))
        branches = [each for each in branches if self._is_possible(each, local.answers)]
        if not branches:
            yield _failure(local, local.state, broken=broken)
        free = self._open_conditions(branches, known, local.state) if len(branches) > 1 else ()
        free += (f"how long `{local.state}` has lasted",) if several else ()
        for branch in branches:
            if branch.may_fail:
                yield _failure(local, local.state, free)
                continue
            retained_answers = (self._lasting_answers(part) for part in branch.conditions)
            now = local._replace(answers=local.answers.union(*retained_answers))
            yield from self._execute(branch, known, now, buffers, free)

    def branches(self, state: str, known: KnownValues) -> Iterator[Branch]:
        """The branches: staying, and each row that known values do not exclude."""
        before: list[m.Expr] = []
        for end in self.cone.state[state].endings:
            ended = known.cached_residual(end.when)
            if ended == m.FALSE:
                continue
            if surely_fails(ended):
                yield Branch(-1, state, tuple(before), may_fail=True)
                return
            self._note_unclear(ended, known)
            for row in end.rows:
                enabled = known.cached_residual(row.when)
                # The first of several is evaluated in any case.
                if surely_fails(enabled) and row == end.rows[0] and len(end.rows) > 1:
                    yield Branch(-1, state, (*before, ended), may_fail=True)
                    break
                if enabled != m.FALSE:
                    self._note_unclear(enabled, known)
                    yield Branch(row.index, row.target, (*before, ended, enabled))
            before.append(negation(ended))
            if ended == m.TRUE:
                return
        yield Branch(-1, state, tuple(before))

    def _note_unclear(self, condition: m.Expr, known: KnownValues) -> None:
        """Note values whose region is not enough for a decision."""
        if known.reads_region(condition):
            self.values.widened |= {
                f"{self.kind}.{_path_of(leaf)}" for leaf in value_leaves(condition)
            }

    def _is_possible(self, branch: Branch, answers: frozenset[int]) -> bool:
        """Whether the proofs allow a branch and remembered answers to hold together."""
        numbers = {self._formulas.number(e) for e in branch.conditions if e != m.TRUE}
        if not numbers:
            return True
        key = answers | numbers
        if key not in self._possible:
            formulas = [self._formulas.by_number[number] for number in sorted(key)]
            self._possible[key] = self.cone.prover.satisfiable(formulas) is not False
        return self._possible[key]

    def _open_conditions(
        self, branches: list[Branch], known: KnownValues, state: str
    ) -> tuple[str, ...]:
        """The conditions that could have turned out otherwise."""
        found: dict[str, None] = {}
        rows = {b.row for b in branches}
        for end in self.cone.state[state].endings:
            conditions = [(end.condition, end.when)]
            conditions += [(row.condition, row.when) for row in end.rows if row.index in rows]
            for name, when in conditions:
                condition = known.cached_residual(when)
                if not isinstance(condition, m.Truth):
                    found[f"`{name}`"] = None
                    if self.cone.is_measured(condition):
                        self.measured_choices.add(f"`{name}`")
        self.open_conditions.setdefault(state, {}).update(found)
        return tuple(found)

    def _broken_assumptions(self, known: KnownValues) -> tuple[int, ...]:
        broken = []
        for index, axiom in enumerate(self.cone.axioms):
            value = residual(axiom, known)
            answer = value.value if isinstance(value, m.Truth) else None
            self._note_unclear(value, known)
            self.assumption_truths.setdefault(index, set()).add(answer)
            if answer is False:
                broken.append(index)
        return tuple(broken)

    # Executing the behaviour of a state.

    def _execute(
        self,
        branch: Branch,
        known: KnownValues,
        before: MachineState,
        buffers: tuple[int, ...],
        free: tuple[str, ...] = (),
    ) -> Iterator[tuple[MachineState, Transition]]:
        """The machine after a branch; its clock is `SAME_STATE` if no state is entered."""
        answers, is_same_state = before.answers, branch.row < 0 and before.state != ""
        known = known if is_same_state else self.known_at_entry(branch.row, known)
        if any(
            surely_fails(residual(value, known)) for value in self.cone.state[branch.target].failing
        ):
            yield _failure(before, before.state or branch.target, free)
            return
        written, tracked = dict[InputName, tuple[int, ...]](), self._tracked_memory[branch.target]
        changed = dict[str, m.Expr]()
        for key, value in self.assignments(branch.row, branch.target, known):
            target = self._target(key)
            output = self._outputs[key] if key[0] else None
            timer = None if key[0] else self.mode_timers.get(key[1])
            if not key[0] and key[1] not in tracked:
                written[key] = (UNKNOWN,)
            elif timer is not None and isinstance(value, m.Number):
                passed = (replace(value, value=n) for n in timer.numbers(int(value.value)))
                written[key] = tuple(map(self.values.number_of_literal, passed))
            else:
                written[key] = self.values.possible_numbers(
                    target, value, known, sent=output, is_first=before.state == ""
                )
            if not key[0]:
                changed[key[1]] = value
                answers = self._forget_memory(answers, key[1])
            if len(written[key]) > 1:
                mode = mode_of("periods", key[1])
                free += (f"how long `{mode}` has lasted" if timer else f"what `{key[1]}` is",)
                if self.cone.is_measured(value):
                    self.measured_choices.add(free[-1])
        answers = frozenset(a for a in answers if self._concerns_live(a, branch.target))
        if len(answers) > MOST_REMEMBERED:
            answers = frozenset()
        lost = tuple(self._lost_inputs(buffers, known, before.state, branch.target))
        clock = SAME_STATE if is_same_state else self.clocks.initial(branch.target)
        written, memory = limit_combinations(written), self._memory_numbers(before.memory)
        for numbers in product(*written.values()):
            values = dict(zip(written, numbers, strict=True))
            memory_after = tuple(
                values.get(("", name), number) if name in tracked else UNKNOWN
                for name, number in memory.items()
            )
            now = MachineState(branch.target, clock, memory_after, answers)
            sent = tuple(sorted((key, number) for key, number in values.items() if key[0]))
            counts = tuple(self._counts(before.memory, memory_after, changed, known))
            yield (
                now,
                Transition(before.state, branch.target, branch.row, sent, free, lost, (), counts),
            )

    def _counts(
        self,
        before: tuple[int, ...],
        after: tuple[int, ...],
        changed: Mapping[str, m.Expr],
        known: KnownValues,
    ) -> Iterator[tuple[str, float]]:
        """How numbers change of which only regions are known (`Transition.counts`)."""
        for name, value in changed.items() if before else ():
            slot = self.memory_slots[name]
            region = self.values.value(after[slot])
            if isinstance(region, Region):
                low, high = change(value, name, known, region)
                yield name, float(low if low > 0 else min(high, 0))
            elif isinstance(self.values.value(before[slot]), Region):
                yield name, 0.0

    def known_at_entry(self, row: int, known: KnownValues) -> KnownValues:
        """The known values with which the functions of a state that a row enters begin."""
        memory = {**known.memory, **self.cone.row_sets[row]}
        return replace(known, periods=0, memory=memory, _residuals={})

    def assignments(
        self, row: int, state: str, known: KnownValues
    ) -> Iterator[tuple[InputName, m.Expr]]:
        """The values that a row and the functions of a state give to tracked outputs and memory."""
        assigned = dict(self.cone.state[state].assignments)
        for name, value in self.cone.row_sets[row].items():
            if ("", name) not in assigned:
                yield ("", name), value
        for (peer, name), value in assigned.items():
            value = residual(value, known)
            if peer or not (isinstance(value, m.MemoryRef) and value.name == name):
                yield (peer, name), value

    def _target(self, key: InputName) -> str:
        return target_name(self.kind, key)

    def _forget_memory(self, answers: frozenset[int], memory: str) -> frozenset[int]:
        return frozenset(a for a in answers if memory not in self._dependence(a).memory)

    def _lost_inputs(
        self, buffers: tuple[int, ...], known: KnownValues, source: str, target: str
    ) -> Iterator[tuple[InputName, str]]:
        """Fresh inputs that a step does not read or react to.

        Measurements that are events are assumed fresh in every period but the first.
        """
        new = [key for key, slot in self.slots.items() if buffers[slot] % 2]
        new += sorted(self.events & self._measured) if source else []
        return self.input_use.lost_inputs(new, known.inputs, source, target)

    def may_be_absent(self, key: InputName) -> bool:
        """Whether a measurement that is assumed fresh may be absent."""
        return key in self._measured and key not in self._steady

    # Known values at a time stamp.

    def known_before(self, local: MachineState, buffers: tuple[int, ...]) -> KnownValues:
        """The known values before a step."""
        return self._known_values(buffers, self._memory_numbers(local.memory))

    def _memory_numbers(self, memory: tuple[int, ...]) -> dict[str, int]:
        return dict(zip(self.memory_slots, memory, strict=True))

    def _known_values(
        self, buffers: tuple[int, ...], memory: dict[str, int], *, first: bool = False
    ) -> KnownValues:
        base = self.static_values
        known = KnownValues(base.lets, base.constants, base.period_s, turns=base.turns)
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
        known.fresh, known.present, known.inputs = fresh, present, {**self._noise_bounds, **inputs}
        values = ((name, self.memory_value(name, number)) for name, number in memory.items())
        known.memory = {name: value for name, value in values if value is not None}
        return known

    def memory_value(self, memory: str, number: int) -> AbstractValue | None:
        """The abstract value of memory with a number."""
        value = self.values.value(number)
        return (self._memory_bounds[memory] or value) if value in (None, SOME) else value

    # Answers about unknown values.

    def _dependence(self, formula: int) -> Dependence:
        return self.cone.dependences.of(self._formulas.by_number[formula])

    def _concerns_live(self, formula: int, state: str) -> bool:
        """Whether a formula is about a value that may still be read in or after a state."""
        rests = self._dependence(formula)
        return not (
            rests.memory.isdisjoint(self._live_memory[state])
            and rests.inputs.isdisjoint(self._live_inputs[state])
        )

    def _lasting_answers(self, expr: m.Expr) -> Iterator[int]:
        """The formulas that stay true until an input or memory is renewed, by number."""
        for part in conjuncts(expr):
            rests = self.cone.dependences.of(part)
            changes = rests.has_clock or rests.has_lag or rests.has_live
            if part != m.TRUE and not changes and rests.inputs <= self.slots.keys():
                yield self._formulas.number(part)


def _path_of(leaf: m.Input | m.MemoryRef) -> str:
    return leaf.name if isinstance(leaf, m.MemoryRef) else f"x.{leaf.peer}.{leaf.element}"


def _failure(
    local: MachineState, state: str, free: tuple[str, ...] = (), broken: tuple[int, ...] = ()
) -> tuple[MachineState, Transition]:
    """A machine whose step failed, and that step."""
    return local._replace(state=state, clock=FAILED), Transition(
        state, state, -1, (), free, (), broken
    )
