"""The methods of a generated class: step, first period, one for each state and behaviour."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import chain

from specc.lower.flow import (
    Activity,
    Check,
    Enter,
    Flow,
    FlowRow,
    Flows,
    Proofs,
    Rows,
    must_evaluate,
)
from specc.lower.module import Module
from specc.lower.names import FINALISE, MethodPlan, docstring, literal, with_trace
from specc.lower.table import TermTable
from specc.lower.terms import NONE, Term, TermSet, by_order
from specc.lower.writer import Writer
from specc.model.fsm import Condition
from specc.model.system import Memory, Subsystem
from specc.model.trace import Trace
from specc.reachable import reachable

# The work cycle of a state, line by line: conditions, rows, and the call of a behaviour.


NO_TRACE = Trace()


class CycleWriter(Writer):
    """Writes methods that end with the behaviour of some state."""

    clocked: frozenset[str] = frozenset()
    """States whose behaviour or conditions ask for the time since their start."""

    def flow(self, flow: Flow) -> None:
        """Conditions, rows and behaviour from here to the end of the period."""
        match flow:
            case Enter():
                self.enter(flow)
            case Check():
                self._check(flow)
            case Rows(is_proved=True):
                self._proved_rows(flow)
            case Rows():
                self._tested_rows(flow)

    def _test(self, test: Term, due: TermSet) -> str:
        """A test, after locals for those of the terms `due` that it needs."""
        needed = test.maybe_evaluated & self.reused | {
            t for t in test.maybe_evaluated - {test} if t.let
        }
        self.assign(due & needed)
        return self.emit(test)

    def _check(self, check: Check) -> None:
        self.nodes.name_hint = check.condition.name
        test = self._test(check.test, check.must_evaluate(self.nodes.known))
        with self.block(_condition(f"if {test}:", check.condition)):
            self.flow(check.rows)
        self.flow(check.otherwise)

    def _proved_rows(self, flow: Rows) -> None:
        tested, last, keyword = flow.tested, flow.rows[-1], "if"
        for row in tested:
            self.nodes.name_hint = row.transition.condition.name
            written = len(self._lines)
            test = self._test(row.test, must_evaluate((row.test,), self.nodes.known))
            keyword = keyword if written == len(self._lines) else "if"
            self._row(f"{keyword} {test}:", row)
            keyword = "elif"
        if last in tested:
            self.write(f"raise self.undecided({literal(flow.cause)}, [])")
        elif keyword == "elif":
            self._row("else:", last)
        else:
            self.enter(last.enter)

    def _row(self, line: str, row: FlowRow) -> None:
        condition = row.transition.condition
        with self.block(_condition(line, condition, row.transition.trace)):
            self.enter(row.enter)

    def _tested_rows(self, flow: Rows) -> None:
        """All rows are tested; the first whose test holds is taken once it is the only one."""
        cause = literal(flow.cause)
        if not flow.rows:
            self.write(f"raise self.undecided({cause}, [])")
            return
        names: list[str] = []
        for row in flow.rows:
            self.nodes.name_hint = row.transition.condition.name
            test = self._test(row.test, must_evaluate((row.test,), self.nodes.known))
            names.append(self.nodes.names.new(row.transition.condition.name))
            trace = row.transition.condition.trace or row.transition.trace
            self.write(with_trace(f"{names[-1]} = {test}", trace))
        self._take_only_row(flow, names)

    def _take_only_row(self, flow: Rows, names: list[str]) -> None:
        *tested, last = flow.rows
        one, enabled = f"not {names[0]}", "[]"
        if tested:
            by_row = (f"{r.enter.row}: {name}" for r, name in zip(flow.rows, names, strict=True))
            self.write(f"holds = {{{', '.join(by_row)}}}")
            one, enabled = "sum(holds.values()) != 1", "[row for row in holds if holds[row]]"
        with self.block(f"if {one}:"):
            self.write(f"raise self.undecided({literal(flow.cause)}, {enabled})")
        for row, name in zip(tested, names, strict=False):
            with self.block(f"if {name}:"):
                self.enter(row.enter)
        self.enter(last.enter)

    def first_period(self, items: list[tuple[Memory, Term]], enter: Enter) -> None:
        """The first period: initial memory, what depends on nothing else, the first behaviour."""
        self.nodes.may_hoist = False
        for item, term in items:
            self.initial(item, term)
        self.nodes.may_hoist = True
        place = len(self._lines)
        self.enter(enter)
        if self.module.hoisted:
            self._lines.insert(place, f"self.{FINALISE}()")

    def finalise(self) -> None:
        """What depends on nothing but the initial memory."""
        self._lines += self.nodes.hoisted_assignments()

    def enter(self, enter: Enter) -> None:
        """One run of a behaviour, at the end of a period."""
        self.run(enter)
        self.write(f"return {enter.row}")

    def run(self, enter: Enter) -> None:
        """The state is entered, if it is not the present one, and its behaviour called."""
        if enter.is_entry:
            known = self.nodes.known.items()
            self.nodes.known = {t: spelled for t, spelled in known if not t.reads_clock}
            if not enter.is_same_state:
                method = self.module.state_methods[enter.target]
                state = literal(enter.target)
                self.write(f"self.state, self._work = {state}, self.{method}")
            if enter.target in self.clocked:
                self.write("self._periods = 0")
        if enter.activity.computations:
            self.assign(enter.needed)
            arguments = [self._argument(term, enter) for term in enter.arguments]
            method = self.module.behaviour_methods[enter.activity.behaviour.name]
            self.write(f"self.{method}({', '.join(arguments)})")

    def _argument(self, term: Term, enter: Enter) -> str:
        if term in enter.needed:
            return self.nodes.known[term].text
        self.defer(term)
        text = self.nodes.known[term].text
        return text.removesuffix("()") if text.endswith("()") else f"lambda: {text}"


def _condition(line: str, condition: Condition, trace: Trace = NO_TRACE) -> str:
    return with_trace(line, condition.trace or trace, condition.name)


# The methods of a generated class: step, first period, one for each state and each behaviour.


class Methods:
    """Writes all methods of one subsystem."""

    def __init__(
        self, subsystem: Subsystem, module: Module, table: TermTable, proofs: Proofs
    ) -> None:
        self._subsystem = subsystem
        self._module = module
        self._table = table
        flows = Flows(subsystem, table, proofs)
        self._activities = flows.activities
        self._first = flows.first_period()
        self._flows = {state.name: flows.state_flow(state.name) for state in subsystem.states}
        self.clocked = frozenset(s.name for s in subsystem.states if self._reads_clock(s.name))
        """States whose behaviour or conditions ask for the time since their start."""
        self._enters = [(self._first, NONE), *chain(*(f.entries() for f in self._flows.values()))]
        self._arguments = self._parameters()
        for enter, _ in self._enters:
            enter.arguments = self._arguments[enter.activity.behaviour.name]

    def plans(self) -> tuple[MethodPlan, ...]:
        """The methods in the order in which a reader needs them."""
        states = [self._state(state.name) for state in self._subsystem.states]
        behaviours = [self._behaviour(a) for a in self._activities.values() if a.computations]
        # What the others ask for is known last.
        start = self._start()
        return (self._step(), start, *self._finalise(), *states, *behaviours)

    def _reads_clock(self, state: str) -> bool:
        behaviour = self._subsystem.state(state).behaviour
        terms = [work.value for work in self._activities[behaviour.name].computations]
        terms += [self._table.of(condition.when) for _, condition in behaviour.endings]
        rows = (*self._subsystem.rows(state, "terminal"), *self._subsystem.rows(state, "error"))
        terms += [self._table.of(row.condition.when) for _, row in rows]
        terms += [self._table.of(axiom.that) for axiom in self._subsystem.axioms]
        return any(term.reads_clock for term in terms)

    def _parameters(self) -> dict[str, tuple[Term, ...]]:
        """For every behaviour, what conditions that lead to it may have computed already."""
        offered: dict[str, TermSet] = defaultdict(lambda: NONE)
        for enter, before in self._enters:
            fixed = (t for t in before if not (enter.is_entry and t.reads_clock))
            offered[enter.activity.behaviour.name] |= frozenset(fixed)
        return {
            name: parameters(activity, offered[name]) for name, activity in self._activities.items()
        }

    def _writer(self, *terms: Term) -> CycleWriter:
        return CycleWriter(self._module, self._table, terms)

    def _state(self, state: str) -> MethodPlan:
        flow, declared = self._flows[state], self._subsystem.state(state)
        writer = self._writer(*flow.evaluated_terms)
        writer.clocked = self.clocked
        if state in self.clocked:
            writer.write("self._periods += 1")
        writer.constant_conditions(declared.behaviour)
        writer.flow(flow)
        doc = docstring(declared.title or f"State {state}", str(declared.trace))
        return MethodPlan(self._module.state_methods[state], (), "int", doc, writer.body())

    def _behaviour(self, activity: Activity) -> MethodPlan:
        behaviour = activity.behaviour
        writer = self._writer(*(work.value for work in activity.computations))
        parameters = writer.activity(activity, self._arguments[behaviour.name])
        title = behaviour.title or behaviour.name.replace("_", " ").capitalize()
        name = self._module.behaviour_methods[behaviour.name]
        doc = docstring(title, str(behaviour.trace))
        return MethodPlan(name, parameters, "None", doc, writer.body())

    def _start(self) -> MethodPlan:
        items = [(item, self._table.of(item.init, item.type)) for item in self._subsystem.memory]
        writer = self._writer(*(term for _, term in items), *self._first.arguments)
        writer.clocked = self.clocked
        writer.first_period(items, self._first)
        doc = "First period: initial memory and the behaviour of the initial state."
        return MethodPlan("_start", (), "int", doc, writer.body())

    def _finalise(self) -> Iterator[MethodPlan]:
        if self._module.hoisted:
            writer = self._writer()
            writer.finalise()
            doc = "Put together once what no behaviour changes any more."
            yield MethodPlan(FINALISE, (), "None", doc, writer.body())

    def _step(self) -> MethodPlan:
        writer = self._writer()
        tests = [self._table.negation(self._table.of(a.that)) for a in self._subsystem.axioms]
        writer.monitors(tests)
        writer.write("return self._work()")
        doc = "One period of the work cycle; the row of the transition taken, or -1."
        return MethodPlan("step", (), "int", doc, writer.body())


def parameters(activity: Activity, offered: TermSet) -> tuple[Term, ...]:
    """The terms that a behaviour takes from its callers: the largest of those they offer."""

    def is_passed(term: Term) -> bool:
        return term in offered and term.is_costly

    found = reachable(
        (work.value for work in activity.computations), lambda t: () if is_passed(t) else t.args
    )
    return tuple(by_order(filter(is_passed, found)))
