"""The methods of a generated class: step, first period, one for each state and behaviour."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable

from specc.lower.flow import Activity, Certain, Check, Enter, Flow, Flows, Proofs, Row, Rows, Stay
from specc.lower.module import Module
from specc.lower.names import docstring, literal, traced
from specc.lower.plan import MethodPlan
from specc.lower.render import Seen
from specc.lower.sharing import Walk, parameters
from specc.lower.terms import NONE, Term, Terms, TermTable
from specc.lower.writer import INDENT, Writer
from specc.model.fsm import Condition
from specc.model.system import Memory, Subsystem
from specc.model.trace import Trace

# The work cycle of a state, line by line: conditions, rows, and the call of a behaviour.


NO_TRACE = Trace()


class CycleWriter(Writer):
    """Writes methods that end with the behaviour of some state."""

    clocked: frozenset[str] = frozenset()
    """States whose behaviour or conditions ask for the time since their start."""

    def flow(self, flow: Flow, seen: Seen) -> None:
        """Conditions, rows and behaviour from here to the end of the period."""
        match flow:
            case Stay(enter=enter):
                self.enter(enter, seen)
            case Check():
                self._check(flow, seen)
            case Rows(is_proved=True):
                self._proved(flow, seen)
            case Rows():
                self._undecided(flow, seen)

    def _due(self, surely: Terms, test: Term | None, enters: Iterable[Enter]) -> list[Term]:
        """Terms to assign before a test: it needs them, or all behaviours behind it take them."""
        tested = test.perhaps - {test} if test else NONE
        enters = tuple(enters)
        return [
            term
            for term in surely
            if (term in tested and self._is_named(term))
            or (enters and all(term in enter.taken for enter in enters))
        ]

    def _check(self, check: Check, seen: Seen) -> None:
        self.nodes.hint = check.condition.name
        surely = check.surely(Certain(seen.always))
        seen = self.assign(self._due(surely, check.test, check.enters), seen)
        test, if_true, if_false = self.test(check.test, seen)
        self.write(_condition(f"if {test.text}:", check.condition))
        self._depth += 1
        self.flow(check.rows, if_true)
        self._depth -= 1
        self.flow(check.otherwise, if_false)

    def _proved(self, flow: Rows, seen: Seen) -> None:
        tested, last, keyword = flow.tested, flow.rows[-1], "if"
        known, surely = seen.always, flow.surely_from(Certain(seen.always))
        for index, row in enumerate(tested):
            self.nodes.hint = row.transition.condition.name
            enters = (r.enter for r in flow.rows[index:])
            if known != seen.always:
                known, surely = seen.always, flow.surely_from(Certain(seen.always))
            due = self._due(surely[index], row.test, enters)
            if due:
                seen, keyword = self.assign(due, seen), "if"
            test, if_true, seen = self.test(row.test, seen)
            self._row(f"{keyword} {test.text}:", row, if_true)
            keyword = "elif"
        if last in tested:
            self.write(f"raise self.undecided({literal(flow.cause)}, [])")
        elif keyword == "elif":
            self._row("else:", last, seen)
        else:
            self.enter(last.enter, seen)

    def _row(self, line: str, row: Row, seen: Seen) -> None:
        condition = row.transition.condition
        self.write(_condition(line, condition, row.transition.trace))
        self._depth += 1
        self.enter(row.enter, seen)
        self._depth -= 1

    def _undecided(self, flow: Rows, seen: Seen) -> None:
        """All rows are tested; the first whose test holds is taken once it is the only one."""
        cause = literal(flow.cause)
        if not flow.rows:
            self.write(f"raise self.undecided({cause}, [])")
            return
        held: list[str] = []
        for row in flow.rows:
            self.nodes.hint = row.transition.condition.name
            surely = Certain(seen.always).of(row.test)
            seen = self.assign(self._due(surely, row.test, ()), seen)
            spelled, seen = self.value(row.test, seen)
            held.append(self.names.new(row.transition.condition.name))
            line = f"{held[-1]} = {spelled.text}"
            self.write(traced(line, row.transition.condition.trace or row.transition.trace))
        if len(held) == 1:
            self.write(f"if not {held[0]}:")
            self.write(f"{INDENT}raise self.undecided({cause}, [])")
        else:
            by_row = (f"{r.enter.row}: {name}" for r, name in zip(flow.rows, held, strict=True))
            self.write(f"holds = {{{', '.join(by_row)}}}")
            self.write("if sum(holds.values()) != 1:")
            enabled = "[row for row in holds if holds[row]]"
            self.write(f"{INDENT}raise self.undecided({cause}, {enabled})")
        self._decided(flow.rows, held, seen)

    def _decided(self, rows: tuple[Row, ...], held: list[str], seen: Seen) -> None:
        *tested, last = rows
        common = frozenset(last.enter.needed).intersection(*(row.enter.needed for row in tested))
        seen = self.assign(common, seen)
        for row, name in zip(tested, held, strict=False):
            self.write(f"if {name}:")
            self._depth += 1
            self.enter(row.enter, seen)
            self._depth -= 1
        self.enter(last.enter, seen)

    def first(self, items: list[tuple[Memory, Term]], enter: Enter) -> None:
        """The first period: initial memory, what depends on nothing else, the first behaviour."""
        seen = Seen()
        self.nodes.is_settled = False
        for item, term in items:
            seen = self.initial(item, term, seen)
        self.nodes.is_settled = True
        place = len(self._lines)
        self.enter(enter, seen)
        self._lines[place:place] = self.nodes.settling()

    def enter(self, enter: Enter, seen: Seen) -> None:
        """One run of a behaviour, at the end of a period."""
        self.run(enter, seen)
        self.write(f"return {enter.row}")

    def run(self, enter: Enter, seen: Seen) -> None:
        """The state is entered, if it is not the present one, and its behaviour called."""
        if enter.is_entry:
            seen = seen.without_clock()
            if not enter.is_same_state:
                method = self.module.state_methods[enter.target]
                state = literal(enter.target)
                self.write(f"self.state, self._work = {state}, self.{method}")
            if enter.target in self.clocked:
                self.write("self._periods = 0")
        if not enter.activity.works:
            return
        seen = self.assign(enter.needed, seen)
        arguments = (self._argument(term, seen) for term in enter.taken)
        method = self.module.behaviour_methods[enter.activity.behaviour.name]
        self.write(f"self.{method}({', '.join(arguments)})")

    def _argument(self, term: Term, seen: Seen) -> str:
        if term not in seen.perhaps:
            return "None"
        if term not in seen.always:
            self.partial.add(term)
        return self.local(term)


def _condition(line: str, condition: Condition, trace: Trace = NO_TRACE) -> str:
    return traced(line, condition.trace or trace, condition.name)


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
        self._first = flows.first()
        self._flows = {state.name: flows.of_state(state.name) for state in subsystem.states}
        self.clocked = frozenset(s.name for s in subsystem.states if self._asks_clock(s.name))
        """States whose behaviour or conditions ask for the time since their start."""
        self._taken = self._parameters()
        for enter in self._enters():
            enter.taken = self._taken[enter.activity.behaviour.name]

    def plans(self) -> tuple[MethodPlan, ...]:
        """The methods in the order in which a reader needs them."""
        states = [self._state(state.name) for state in self._subsystem.states]
        behaviours = [self._behaviour(a) for a in self._activities.values() if a.works]
        step = self._step()  # the first period comes last: it prepares what the others ask for
        return (step, self._start(), *states, *behaviours)

    def _enters(self) -> Iterable[Enter]:
        yield self._first
        for flow in self._flows.values():
            yield from flow.enters

    def _asks_clock(self, state: str) -> bool:
        behaviour = self._subsystem.state(state).behaviour
        asked = [work.value for work in self._activities[behaviour.name].works]
        asked += [self._table.of(c.when) for c in (behaviour.error, behaviour.terminal)]
        rows = (*self._subsystem.rows(state, "terminal"), *self._subsystem.rows(state, "error"))
        asked += [self._table.of(row.condition.when) for _, row in rows]
        asked += [self._table.of(axiom.that) for axiom in self._subsystem.axioms]
        return any(term.reads_clock for term in asked)

    def _parameters(self) -> dict[str, tuple[Term, ...]]:
        """For every behaviour, what conditions that lead to it may have computed already."""
        offered: dict[str, Terms] = defaultdict(lambda: NONE)
        for walk in map(self._walked, self._flows.values()):
            for enter, terms in walk.offers:
                offered[enter.activity.behaviour.name] |= terms
        return {
            name: parameters(activity, offered[name]) for name, activity in self._activities.items()
        }

    @staticmethod
    def _walked(flow: Flow) -> Walk:
        walk = Walk()
        walk.flow(flow)
        return walk

    def _written(self, again: Terms, write: Callable[[CycleWriter], None]) -> tuple[str, ...]:
        """Lines of a method; written again until all partly evaluated terms are known."""
        partial = NONE
        while True:
            writer = CycleWriter(self._module, self._table, again, partial)
            writer.clocked = self.clocked
            write(writer)
            if writer.partial <= partial:
                return writer.body()
            partial = frozenset(writer.partial)

    def _state(self, state: str) -> MethodPlan:
        flow = self._flows[state]

        def write(writer: CycleWriter) -> None:
            if state in self.clocked:
                writer.write("self._periods += 1")
            writer.constant_conditions(self._subsystem.state(state).behaviour)
            writer.flow(flow, Seen())

        declared = self._subsystem.state(state)
        again = frozenset(self._walked(flow).again)
        doc = docstring(declared.title or f"State {state}", str(declared.trace))
        lines = self._written(again, write)
        return MethodPlan(self._module.state_methods[state], (), "int", doc, lines)

    def _behaviour(self, activity: Activity) -> MethodPlan:
        behaviour = activity.behaviour
        taken = self._taken[behaviour.name]
        walk = Walk()
        sure = frozenset(taken)
        walk.values((work.value for work in activity.works), sure)
        parts: list[str] = []

        def write(writer: CycleWriter) -> None:
            parts[:] = writer.activity(activity, taken, Seen())

        lines = self._written(frozenset(walk.again), write)
        title = behaviour.title or behaviour.name.replace("_", " ").capitalize()
        name = self._module.behaviour_methods[behaviour.name]
        doc = docstring(title, str(behaviour.trace))
        return MethodPlan(name, tuple(parts), "None", doc, lines)

    def _start(self) -> MethodPlan:
        items = [(item, self._table.of(item.init, item.type)) for item in self._subsystem.memory]
        walk = Walk()
        before = walk.values(term for _, term in items)
        walk.enter(self._first, before)

        def write(writer: CycleWriter) -> None:
            writer.first(items, self._first)

        doc = "First period: initial memory and the behaviour of the initial state."
        lines = self._written(frozenset(walk.again), write)
        return MethodPlan("_start", (), "int", doc, lines)

    def _step(self) -> MethodPlan:
        tests = [self._table.negation(self._table.of(a.that)) for a in self._subsystem.axioms]

        def write(writer: CycleWriter) -> None:
            writer.monitors(tests)
            writer.write("return self._work()")

        doc = "One period of the work cycle; the row of the transition taken, or -1."
        return MethodPlan("step", (), "int", doc, self._written(NONE, write))
