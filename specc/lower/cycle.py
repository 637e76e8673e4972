"""The work cycle of a state, line by line: conditions, rows, and the call of a behaviour."""

from __future__ import annotations

from collections.abc import Iterable

from specc.lower.certain import Certain
from specc.lower.flow import Check, Enter, Flow, Row, Rows, Stay
from specc.lower.render import Seen
from specc.lower.terms import NONE, Term, Terms
from specc.lower.text import literal, traced
from specc.lower.writer import INDENT, Writer
from specc.model.fsm import Condition
from specc.model.system import Memory
from specc.model.trace import Trace

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
