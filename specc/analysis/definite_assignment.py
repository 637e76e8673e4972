"""What must hold where an expression is evaluated: its inputs have arrived, its values are present.

As a Java compiler follows definite assignment: a state knows what every path into it implies, and
the tests inside an expression add to that.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property

from specc.analysis.graph import FactsByState, RowEdge, must_hold
from specc.analysis.path_conditions import (
    Evaluation,
    Guards,
    ImpliedFacts,
    Tests,
    as_conditions,
    has_value,
)
from specc.analysis.reads import Dependences, nodes, texts
from specc.model.expr import (
    TRUE,
    Builtin,
    Compare,
    Expr,
    Fresh,
    Input,
    IsNone,
    Lag,
    Logic,
    MemoryRef,
    Present,
    Quantifier,
    Unary,
    Unknown,
    Unwrap,
    conjuncts,
    has_free_variable,
    has_unknown,
    negation,
)
from specc.model.fsm import Axiom, Condition, Function, State, Transition
from specc.model.system import Let, Memory, Subsystem
from specc.model.types import ListOf, OptionalOf, Type
from specc.model.wires import Wire, Wires
from specc.proof import EvaluationPoint, InputName, InputNames, Prover
from specc.reachable import grouped, reachable, shortest

# Inputs that surely have a value. A value that has come stays, so the sets only grow along a way.


_NONE: InputNames = frozenset()


@dataclass(frozen=True, slots=True)
class InputRead:
    """An input that is read, in the text of `let` or, without one, of the expression itself."""

    input: Input
    let: Let | None


class DefiniteAssignment:
    """Inputs of a subsystem that surely have a value, by state.

    In a state that is never entered all inputs have a value, and so they have in every state if the
    initial state is unknown.
    """

    def __init__(
        self, subsystem: Subsystem, steps: Sequence[RowEdge], arrivals: Availability
    ) -> None:
        self._subsystem = subsystem
        # What had a value when a state was left has one when a mode is resumed there.
        self._entering = [step for step in steps if not step.row.is_return]
        self._arrivals = arrivals
        self._close = cache(arrivals.close)
        self._after = cache(self._present_after)
        self._everything = frozenset(subsystem.inputs)
        self._implied = ImpliedFacts(subsystem.lets, self._implied_by).of
        self._guards = Guards(subsystem.lets, self.after_test, frozenset.intersection)
        self.in_first_period = self._close(arrivals.always)
        """In the first period of all."""
        self.in_later_periods = self._close(arrivals.always | arrivals.later)
        """In every period after the first, in any state: when conditions are asked."""
        self.in_functions = self._fixpoint()
        """In the functions of a state, from its first period on."""

    def in_conditions(self, state: str) -> InputNames:
        """The inputs that surely have a value when the conditions of a state are evaluated."""
        return self._close(self.in_functions[state] | self._arrivals.later)

    def at(self, use: Evaluation) -> InputNames:
        """The inputs that surely have a value where an expression is evaluated."""
        match use.owner:
            case Memory():
                return self.in_first_period
            case Axiom():
                return self.in_later_periods
        assert use.state is not None  # functions and conditions are those of a state
        if isinstance(use.owner, Function):
            return self.in_functions[use.state.name]
        present = self.in_conditions(use.state.name)
        for test, holds in use.tests:
            present = self.after_test(present, test, holds)
        return present

    def after_test(self, present: InputNames, test: Expr, holds: bool) -> InputNames:
        """What is present after a test that held, or did not."""
        return self._close(present | self._implied(test, holds))

    @cached_property
    def is_sure(self) -> bool:
        """Whether all that is read has a value from the first period on, or is tested for one."""
        if self.in_first_period == self._everything:
            return True
        # The texts of lets are among them, so that none needs to be followed from its users.
        guards = Guards((), self.after_test, frozenset.intersection)
        first, every = self.in_first_period, texts(self._subsystem)
        parts = (part for text in every for part in guards.parts(text.expr, first))
        return all(read.key in part.known for part in parts if (read := _read(part.expr)))

    def unguarded(self, expr: Expr, present: InputNames) -> Iterator[InputRead]:
        """What `expr` may read without a value where only `present` is sure; tests in it count."""
        for part, known, let in self._guards.parts(expr, present):
            read = _read(part)
            if read and read.key not in known:
                yield InputRead(read, let)

    def after_row(self, step: RowEdge) -> InputNames:
        """The inputs that surely have a value after a row was taken."""
        return self._after(self.in_functions[step.row.source], step.ensures)

    def _present_after(self, in_functions: InputNames, ensures: InputNames) -> InputNames:
        return self._close(self._close(in_functions | self._arrivals.later) | ensures)

    def path_without(self, state: str, element: InputName) -> list[str]:
        """States on a shortest way to `state` on which the element may be missing."""
        without = (step.row for step in self._entering if element not in self.after_row(step))
        leaving = grouped((row.source, row.target) for row in without)
        return shortest(self._subsystem.initial_state, state, lambda here: leaving.get(here, ()))

    def _implied_by(self, expr: Expr, holds: bool) -> InputNames:
        """Inputs that have a value where a condition holds; an unknown may imply any input."""
        match expr:
            case Unknown():
                return self._everything
            case Fresh(input=element) | Present(input=element) if holds:
                return frozenset((element.key,))
        return _NONE

    def _fixpoint(self) -> FactsByState[InputName]:
        most = {state.name: self._everything for state in self._subsystem.states}
        if not self._subsystem.has_initial_state:
            return most
        most[self._subsystem.initial_state] = self.in_first_period
        if self.in_first_period == self._everything:
            return most
        ways = grouped((s.row.source, (s.row.target, s.ensures)) for s in self._entering)
        return must_hold(
            most, ways, lambda names, _, known, ensures: names & self._after(known, ensures)
        )


def _read(part: Expr) -> Input | None:
    """The input that has to have a value where an expression is evaluated, if any."""
    if isinstance(part, Lag):
        return part.input
    return part if isinstance(part, Input) else None


# Optional values that are not None, and lists that are not empty.
#
# A transition is taken in the period in which its conditions held, so what they say is true of the
# functions of the next state. After that it stays true of memory that the behaviour does not write.


KnownFacts = frozenset[Expr]
Premises = tuple[Expr, ...]
"""Conditions that hold in one period."""
MOST_PATHS = 16
"""To one let with different tests before it; of more ways counts what all have in common."""


@dataclass(frozen=True, slots=True)
class Need:
    """A value that has to be there, in the text of `let` or, without one, of the expression itself.

    On each of the `paths` to it, the tests of that path hold.
    """

    sure: Unwrap
    paths: tuple[Premises, ...]
    let: Let | None

    @property
    def fact(self) -> Expr:
        """The condition that it is there."""
        return has_value(self.sure.value)


class PresentValues:
    """What is known of optional values and of lists in the states of a machine without unknowns."""

    def __init__(
        self,
        subsystem: Subsystem,
        rows: Sequence[Transition],
        prover: Prover,
        dependences: Dependences,
    ) -> None:
        """`rows` are those that can be taken."""
        self._subsystem = subsystem
        self._rows = rows
        self._prover = prover
        self._dependences = dependences
        self._guards = Guards(subsystem.lets, _add_test, _merge_paths, _without_variables)
        self._lacking: dict[tuple[int, KnownFacts, Tests, EvaluationPoint], Sequence[Need]] = {}

    @cached_property
    def needed(self) -> bool:
        """Whether any expression needs a value to be there."""
        return any(isinstance(node, Unwrap) for node in nodes(self._subsystem))

    def needs(self, expr: Expr) -> Iterator[Need]:
        """What an evaluation of `expr` may need."""
        for part in self._guards.parts(expr, ((),)):
            if isinstance(part.expr, Unwrap):
                yield Need(part.expr, part.known, part.let)

    def lacking(self, use: Evaluation) -> Sequence[Need]:
        """The values that may be missing where an expression is evaluated.

        The same expression under the same facts is decided once, in however many states.
        """
        known = self._known_at(use)
        key = id(use.text.expr), known, use.tests, self._moment(use)
        if key not in self._lacking:
            context = (*self._in_order(known), *as_conditions(use.tests))
            needs = self.needs(use.text.expr)
            self._lacking[key] = [n for n in needs if self._lacks(n, context, key[-1])]
        return self._lacking[key]

    def _known_at(self, use: Evaluation) -> KnownFacts:
        """The facts that hold where an expression is evaluated, apart from the tests before it."""
        if use.state is None:
            return frozenset()
        facts = self._facts_by_state[use.state.name]
        return facts if isinstance(use.owner, Function) else self._in_conditions(use.state, facts)

    def _lacks(self, need: Need, known: Premises, moment: EvaluationPoint) -> bool:
        legible = (way for way in need.paths if not any(map(has_unknown, way)))
        contexts = ((*known, *way) for way in legible)
        return any(
            need.fact not in context
            and not self._prover.implies(_with_items(context), need.fact, moment)
            for context in contexts
        )

    def entry_tests_suffice(self, fact: Expr, use: Evaluation) -> bool:
        """Whether tests on the rows into a state could guarantee a value that is used there."""
        state = use.state
        if state is None or state.name == self._subsystem.initial_state:
            return False
        once = isinstance(use.owner, Function) and state.behaviour.terminal.when == TRUE
        return self._is_invariant(fact, state) or once

    def _moment(self, use: Evaluation) -> EvaluationPoint:
        if isinstance(use.owner, Condition):
            return "conditions"
        later = use.state is not None and use.state.name != self._subsystem.initial_state
        return "functions" if later else "start"

    @cached_property
    def _facts(self) -> Premises:
        """All needed facts, in an order that does not depend on the run.

        Facts about the clock are left out, as it starts anew with every state.
        """
        needs = (need for text in texts(self._subsystem) for need in self.needs(text.expr))
        facts = (f for f in {n.fact for n in needs} if not self._dependences.of(f).has_clock)
        return tuple(sorted(facts, key=repr))

    def _in_order(self, known: KnownFacts) -> Premises:
        return tuple([fact for fact in self._facts if fact in known])

    @cached_property
    def _facts_by_state(self) -> FactsByState[Expr]:
        """What holds in every period in which the functions of a state are executed."""
        most = {state.name: frozenset(self._facts) for state in self._subsystem.states}
        if self._subsystem.initial_state in most:
            initial = {item.name: item.init.type for item in self._subsystem.memory}
            most[self._subsystem.initial_state] = _present_by_type(self._facts, initial)
        return must_hold(most, self._edges(), self._transfer)

    def _edges(self) -> dict[str, list[tuple[str, Premises]]]:
        """State -> its successors, itself included, each with the conditions that hold then."""
        found: dict[str, list[tuple[str, Premises]]] = {}
        for state in self._subsystem.states:
            ends = (negation(condition.when) for _, condition in state.behaviour.endings[::-1])
            found[state.name] = [(state.name, self._timeless(ends))]
        for row in self._rows:
            before = as_conditions(
                self._subsystem.state(row.source).behaviour.facts_after(row.cause)
            )
            at_return = self._facts_at_return(row) if row.is_return else ()
            premises = *self._timeless([*before, row.condition.when]), *at_return
            found[row.source].append((row.target, premises))
        return found

    def _facts_at_return(self, row: Transition) -> Premises:
        """Facts of the target that still hold where a mode is resumed there.

        They held when the target was left, and no state that the machine can have been in since
        then writes their memory.
        """
        inside = self._subsystem.mode(row.resumes).states
        outside = grouped((r.source, r.target) for r in self._rows if r.target not in inside)
        left = [target for state in inside for target in outside.get(state, ())]
        between = reachable(left, lambda state: outside.get(state, ()))
        written = {name for state in between for name in _written(self._subsystem.state(state))}
        at_exit = self._in_conditions(self._subsystem.state(row.target), frozenset(self._facts))
        return tuple(
            fact
            for fact in self._in_order(at_exit)
            if not self._dependences.of(fact).memory & written
        )

    def _timeless(self, conditions: Iterable[Expr]) -> Premises:
        """The conjuncts that do not depend on the clock, which starts anew with the next state."""
        parts = (part for condition in conditions for part in conjuncts(condition))
        return tuple(part for part in parts if not self._dependences.of(part).has_clock)

    def _transfer(
        self, facts: KnownFacts, state: str, at_entry: KnownFacts, conditions: Premises
    ) -> KnownFacts:
        known = self._in_conditions(self._subsystem.state(state), at_entry)
        context = _with_items((*conditions, *self._in_order(known)))
        return frozenset(f for f in facts if f in known or self._prover.implies(context, f))

    def _in_conditions(self, state: State, facts: KnownFacts) -> KnownFacts:
        """Facts that hold when the conditions that end a state are asked."""
        invariant = (fact for fact in facts if self._is_invariant(fact, state))
        return frozenset(invariant) | _present_by_type(self._facts, _written(state))

    def _is_invariant(self, fact: Expr, state: State) -> bool:
        """Whether a fact that holds when a state is entered holds in all its periods."""
        on = self._dependences.of(fact)
        return on.is_stable and not on.memory & _written(state).keys()


def _add_test(ways: tuple[Premises, ...], test: Expr, holds: bool) -> tuple[Premises, ...]:
    condition = test if holds else negation(test)
    return tuple((*way, condition) for way in ways)


def _merge_paths(one: tuple[Premises, ...], other: tuple[Premises, ...]) -> tuple[Premises, ...]:
    """The paths of both that add something: one with more tests than another adds nothing."""
    found: list[tuple[Premises, frozenset[Expr]]] = []
    for way in (*one, *other):
        tests = frozenset(way)
        if not any(fewer <= tests for _, fewer in found):
            found.append((way, tests))
    if len(found) > MOST_PATHS:
        common = frozenset.intersection(*(tests for _, tests in found))
        return (tuple(test for test in found[0][0] if test in common),)
    return tuple(way for way, _ in found)


def _without_variables(ways: tuple[Premises, ...]) -> tuple[Premises, ...]:
    return tuple(tuple(test for test in way if not has_free_variable(test)) for way in ways)


def _with_items(conditions: Iterable[Expr]) -> list[Expr]:
    """Conditions, and what they imply of lists: one with an item that passes a test has an item."""
    found: list[Expr] = []
    for condition in conditions:
        found.append(condition)
        match condition:
            case Logic(op="and", operands=operands):
                found += _with_items(operands)
            case (
                Quantifier(kind="any", over=over) | Unary(operand=Quantifier(kind="all", over=over))
            ) if isinstance(over.type, ListOf):
                found.append(has_value(over))
    return found


def _written(state: State) -> dict[str, Type]:
    """Memory that a behaviour writes -> the type of what it assigns."""
    return {a.name: a.value.type for a in state.behaviour.assignments if not a.peer}


def _present_by_type(facts: Iterable[Expr], memory: Mapping[str, Type]) -> KnownFacts:
    """Facts that follow from the types of values assigned to memory: never None, never empty."""
    return frozenset(
        fact
        for fact in facts
        if (name := _memory_of(fact)) in memory and _is_present(fact, memory[name])
    )


def _memory_of(fact: Expr) -> str:
    """The memory element that a fact is about; "" if it is about something else."""
    match fact:
        case Unary(operand=IsNone(value=MemoryRef(name=name))):
            return name
        case Compare(left=Builtin(args=(MemoryRef(name=name),))):
            return name
    return ""


def _is_present(fact: Expr, type_: Type) -> bool:
    """Whether a value of that type is never None, or a list of that type never empty."""
    if isinstance(fact, Unary):
        return not isinstance(type_, OptionalOf)
    return isinstance(type_, ListOf) and type_.nonempty


@dataclass(frozen=True, slots=True)
class Availability:
    """When the elements of the input buffers of a subsystem have a value, and a new one.

    Attributes:
        always: in every period: those that are `declared`, and those whose sender is not known well
            enough.
        later: in every period after the first: the sender's first period sends them in time.
        together: element -> elements of which the sender sends one whenever it sends that one.
        declared: measurements of devices, and elements with an initial value.
        fresh: new in every period after the first, whatever state the sender is in.
    """

    always: frozenset[InputName]
    later: frozenset[InputName]
    together: dict[InputName, frozenset[InputName]] = field(default_factory=dict)
    declared: frozenset[InputName] = frozenset()
    fresh: frozenset[InputName] = frozenset()

    def close(self, present: frozenset[InputName]) -> frozenset[InputName]:
        """`present` with everything that was sent together with it."""
        new = [others for name, others in self.together.items() if name in present]
        return present.union(*new) if new else present


def always_present(subsystem: Subsystem, wires: Wires) -> frozenset[InputName]:
    """Inputs that have a value from the first period on."""
    return frozenset(
        (wire.port.peer, element.name)
        for wire in wires.wires_of(subsystem)
        if wire.port.direction == "x"
        for element in wire.port.elements
        if element.init is not None or wire.peer_device
    )


def availability_of(
    subsystem: Subsystem, wires: Wires, broken: Collection[str], *, timed: bool = True
) -> Availability:
    """When the inputs of a subsystem have values; a broken sender may send at any time.

    So may any other sender whose sending times are not known, and all senders if rates are not
    `timed` well.
    """
    declared = always_present(subsystem, wires)
    always, later, fresh = set(declared), set[InputName](), set[InputName]()
    together: dict[InputName, frozenset[InputName]] = {}
    for wire in wires.wires_of(subsystem):
        if wire.port.direction != "x" or wire.peer_device:
            continue
        sender, end, port = wire.peer_subsystem, wire.peer_port, wire.port
        if sender is None or end is None or wire.peer_name in broken:
            always |= {(port.peer, element.name) for element in port.elements}
            continue
        # What the sender's end lacks would be sent if that were mended.
        always |= {(port.peer, e.name) for e in port.elements if not end.element(e.name)}
        behaviours = {state.behaviour.name: state.behaviour for state in sender.states}.values()
        sent = [wire.inputs_sent_by(behaviour) for behaviour in behaviours if behaviour.is_complete]
        # A behaviour that is not known may well send nothing of this, or all of it.
        unsure = not behaviours or len(sent) < len(behaviours)
        rated = timed and sender.has_rate and subsystem.has_rate
        if not rated or sender.rate_hz >= subsystem.rate_hz:
            # What the first period of a sender sends, and all that it may if that is not known.
            first = (
                sender.state(sender.initial_state).behaviour if sender.has_initial_state else None
            )
            later |= (
                _everything(wire)
                if first is None or not first.is_complete
                else wire.inputs_sent_by(first)
            )
            if rated and not unsure:
                fresh |= frozenset.intersection(*sent) & subsystem.inputs.keys()
        together |= _sent_together(wire, sent, unsure)
    return Availability(frozenset(always), frozenset(later), together, declared, frozenset(fresh))


def _everything(wire: Wire) -> frozenset[InputName]:
    return frozenset((wire.port.peer, element.name) for element in wire.elements)


def _sent_together(
    wire: Wire, sent: Sequence[frozenset[InputName]], unsure: bool
) -> dict[InputName, frozenset[InputName]]:
    """Element -> the elements that are sent whenever it is."""
    found = {}
    for element in wire.port.elements:
        name = wire.port.peer, element.name
        with_it = [names for names in sent if name in names]
        # What has an initial value is present also before anything was sent.
        if element.init is None and (with_it or unsure):
            others = _everything(wire).intersection(*with_it) - {name}
            if others:
                found[name] = others
    return found
