"""Methods of a subsystem, line by line: state methods, behaviours, the first period, monitors."""

from __future__ import annotations

from collections.abc import Iterable

from specc.lower.flow import Activity, Check, Enter, Flow, Row, Rows, Stay, Work
from specc.lower.module import Module
from specc.lower.render import Renderer, Seen
from specc.lower.terms import NONE, Term, Terms, TermTable, in_order, surely_before
from specc.lower.text import comment, literal, traced
from specc.model.expr import Truth
from specc.model.fsm import Behaviour, Condition
from specc.model.system import Memory
from specc.model.trace import Trace

NO_TRACE = Trace()
INDENT = "    "
WIDTH = 88
"""Room for a statement and its comment in a method of a class."""


class Writer(Renderer):
    """Writes the body of one method."""

    def __init__(
        self,
        module: Module,
        table: TermTable,
        again: Terms,
        partial: Terms,
        clocked: frozenset[str],
    ) -> None:
        """`clocked`: states whose behaviour or conditions ask for the time since their start."""
        super().__init__(module, table, again, partial)
        self._clocked = clocked
        self._lines: list[str] = []
        self._depth = 0

    def body(self) -> tuple[str, ...]:
        """What was written, with the locals that it starts from."""
        buffers = [
            f"{name} = self.{name}" for name in ("x", "y", "memory") if name in self.nodes.touched
        ]
        declared = [
            f"{self.local(t)}: {self.module.annotations.of(t.type)} | None = None"
            for t in in_order(self.partial)
            if t in self.locals and t not in self.given
        ]
        return (*buffers, *declared, *self._lines)

    given: Terms = NONE
    """Terms that the method has as parameters."""

    def write(self, line: str) -> None:
        """One more line."""
        self._lines.append(INDENT * self._depth + line)

    # Values ------------------------------------------------------------------------------------

    def assign(self, terms: Iterable[Term], seen: Seen) -> Seen:
        """Locals for terms whose evaluation is due here, with those they are made of."""
        due = set(terms)
        wanted = due | {part for term in due for part in term.surely if self._is_named(part)}
        hint = self.nodes.hint
        for term in in_order(wanted - seen.always):
            name = self.nodes.hint = self.local(term)
            is_partial = term in seen.perhaps
            if is_partial:
                self.partial.add(term)
                self.write(f"if {name} is None:")
            spelled, if_true, if_false = self._evaluated(term, seen)
            line = f"{INDENT if is_partial else ''}{name} = {spelled.text}"
            self.write(_noted(line, term))
            seen = if_true.join(if_false).plus(term)
        self.nodes.hint = hint
        return seen

    def _is_named(self, term: Term) -> bool:
        return term.let is not None or term in self.again

    # Work cycles -------------------------------------------------------------------------------

    def flow(self, flow: Flow, seen: Seen) -> None:
        """Conditions, rows and behaviour from here to the end of the period."""
        match flow:
            case Stay(enter=enter):
                self.enter(enter, seen)
            case Check():
                self._check(flow, seen)
            case Rows(is_proved=True):
                self._proved(flow.rows, seen)
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
        seen = self.assign(self._due(check.surely, check.test, check.enters), seen)
        test, if_true, if_false = self.test(check.test, seen)
        self.write(_condition(f"if {test.text}:", check.condition))
        self._depth += 1
        self.flow(check.rows, if_true)
        self._depth -= 1
        self.flow(check.otherwise, if_false)

    def _proved(self, rows: tuple[Row, ...], seen: Seen) -> None:
        *tested, last = rows
        surely = _surely_from(rows)
        keyword = "if"
        for index, row in enumerate(tested):
            self.nodes.hint = row.transition.condition.name
            enters = (r.enter for r in rows[index:])
            due = [t for t in self._due(surely[index], row.test, enters) if t not in seen.always]
            if due:
                seen, keyword = self.assign(due, seen), "if"
            test, if_true, seen = self.test(row.test, seen)
            self._row(f"{keyword} {test.text}:", row, if_true)
            keyword = "elif"
        if keyword == "elif":
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
            seen = self.assign(self._due(row.test.surely, row.test, ()), seen)
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
        common = last.enter.surely.intersection(*(row.enter.surely for row in tested))
        seen = self.assign(common, seen)
        for row, name in zip(tested, held, strict=False):
            self.write(f"if {name}:")
            self._depth += 1
            self.enter(row.enter, seen)
            self._depth -= 1
        self.enter(last.enter, seen)

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
            if enter.target in self._clocked:
                self.write("self._periods = 0")
        if not enter.activity.works:
            return
        seen = self.assign((t for t in enter.taken if t in enter.surely), seen)
        arguments = (self._argument(term, seen) for term in enter.taken)
        method = self.module.behaviour_methods[enter.activity.behaviour.name]
        self.write(f"self.{method}({', '.join(arguments)})")

    def _argument(self, term: Term, seen: Seen) -> str:
        return self.local(term) if term in seen.perhaps else "None"

    def constant_conditions(self, behaviour: Behaviour) -> None:
        """Say where conditions come from that need no test."""
        for cause, condition in (("error", behaviour.error), ("terminal", behaviour.terminal)):
            test = self.nodes.table.of(condition.when).node
            if isinstance(test, Truth) and condition.trace:
                outcome = "always" if test.value else "never"
                self.write(
                    f"# {comment(f'{cause} {outcome}: {condition.name}', str(condition.trace))}"
                )

    def initial(self, item: Memory, term: Term, seen: Seen) -> Seen:
        """The initial value of a memory element."""
        self.nodes.hint = f"initial_{item.name}"
        seen = self.assign([t for t in term.surely if self._is_named(t)], seen)
        spelled, seen = self.value(term, seen)
        self.nodes.touched.add("memory")
        line = f"memory.{self.module.memory[item.name]} = {spelled.text}"
        self.write(traced(line, item.trace))
        return seen

    def monitor(self, index: int, violated: Term) -> None:
        """Report an axiom when it does not hold."""
        self.nodes.hint = f"axiom_{index}"
        spelled, _ = self.value(violated, Seen())
        self.write(f"if {spelled.text}:")
        self.write(f"{INDENT}self.violated({index})")

    # Behaviours --------------------------------------------------------------------------------

    def activity(self, activity: Activity, taken: tuple[Term, ...], seen: Seen) -> tuple[str, ...]:
        """Outputs, then memory: all values are computed before the first memory changes."""
        for term in taken:
            is_sure = term in activity.surely and not term.reads_clock
            seen = seen.plus(term, always=is_sure)
            if not is_sure:
                self.partial.add(term)
        self.given = frozenset(taken)
        seen = self.assign([t for t in activity.surely if self._is_named(t)], seen)
        direct, kept = _by_hazard(activity.works, seen.always)
        names: list[tuple[Work, str]] = []
        for work in (*direct[0], *kept, *direct[1]):
            self.nodes.hint = f"{work.function.name}_{work.assignment.name}"
            spelled, seen = self.value(work.value, seen)
            target = self.target(work)
            if work in kept:
                names.append((work, self.names.new(f"next_{work.assignment.name}")))
                target = names[-1][1]
            trace = work.assignment.trace or work.function.trace
            self.write(traced(f"{target} = {spelled.text}", trace))
        for work, name in names:
            self.write(f"{self.target(work)} = {name}")
        return tuple(self._parameter(term, activity) for term in taken)

    def _parameter(self, term: Term, activity: Activity) -> str:
        optional = "" if term in activity.surely and not term.reads_clock else " | None"
        return f"{self.local(term)}: {self.module.annotations.of(term.type)}{optional}"

    def target(self, work: Work) -> str:
        """What a value is assigned to."""
        assignment = work.assignment
        if assignment.peer:
            self.nodes.touched.add("y")
            return f"y.{self.module.outputs[assignment.peer, assignment.name]}"
        self.nodes.touched.add("memory")
        return f"memory.{self.module.memory[assignment.name]}"


def _by_hazard(
    works: tuple[Work, ...], known: Terms
) -> tuple[tuple[list[Work], list[Work]], list[Work]]:
    """Outputs and memory to assign at once; memory whose old value is still needed afterwards."""
    outputs = [work for work in works if work.assignment.peer]
    memory = [work for work in works if not work.assignment.peer]
    reads = [_reads(work.value, known) for work in memory]
    kept = [
        work
        for index, work in enumerate(memory)
        if any(work.assignment.name in later for later in reads[index + 1 :])
    ]
    return (outputs, [work for work in memory if work not in kept]), kept


def _reads(term: Term, known: Terms) -> frozenset[str]:
    """Memory elements that a value still reads when the terms `known` have a local."""
    if term in known or not term.memory:
        return frozenset()
    if not term.args:
        return term.memory
    return frozenset[str]().union(*(_reads(arg, known) for arg in term.args))


def _surely_from(rows: tuple[Row, ...]) -> list[Terms]:
    """For every row, what is evaluated in any case once it is its turn."""
    after = rows[-1].enter.surely
    found = [after]
    for row in reversed(rows[:-1]):
        after = surely_before(row.test, row.enter.surely, after)
        found.append(after)
    return found[::-1]


def _condition(line: str, condition: Condition, trace: Trace = NO_TRACE) -> str:
    return traced(line, condition.trace or trace, condition.name)


def _noted(line: str, term: Term) -> str:
    """`line` with the source of the let it computes, and with its title if there is room."""
    if term.let is None:
        return line
    full = traced(line, term.let.trace, term.let.title)
    return full if len(full) <= WIDTH else traced(line, term.let.trace)
