"""The methods of a generated class: step, first period, one for each state and each behaviour."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable

from specc.lower.cycle import CycleWriter
from specc.lower.flow import Activity, Enter, Flow, Flows, Proofs
from specc.lower.module import Module
from specc.lower.plan import MethodPlan
from specc.lower.render import Seen
from specc.lower.sharing import Walk, parameters
from specc.lower.terms import NONE, Term, Terms, TermTable
from specc.lower.text import docstring
from specc.model.system import Subsystem


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
