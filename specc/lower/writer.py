"""Methods of a subsystem, line by line: values, initial memory, behaviours, monitors."""

from __future__ import annotations

from collections.abc import Iterable

from specc.lower.flow import Activity, Certain, Work
from specc.lower.module import Module
from specc.lower.names import comment, traced
from specc.lower.render import Renderer, Seen
from specc.lower.terms import NONE, Term, Terms, TermTable, in_order
from specc.model.expr import Truth
from specc.model.fsm import Behaviour
from specc.model.system import Memory

# Simultaneous assignment in sequence: in which order memory may change within a period.


def memory_order(works: Iterable[Work], known: Terms) -> tuple[list[Work], list[Work]]:
    """Memory elements to compute beforehand, and the rest in an order in which they may change.

    Who needs an old value comes before who changes it. Only where elements need each other's old
    values, one of them must be computed beforehand. The terms `known` have a local already.
    """
    left = {work: _reads(work.value, known) for work in works if not work.assignment.peer}
    before: list[Work] = []
    ordered: list[Work] = []
    while left:
        free = (work for work in left if not _is_read(work, left))
        work = next(free, None)
        if work is not None:
            ordered.append(work)
        else:
            work = next(iter(left))
            before.append(work)
        del left[work]
    return before, ordered


def _is_read(work: Work, left: dict[Work, frozenset[str]]) -> bool:
    name = work.assignment.name
    return any(name in reads for other, reads in left.items() if other is not work)


def _reads(term: Term, known: Terms) -> frozenset[str]:
    """Memory elements that a value still reads when the terms `known` have a local."""
    found: set[str] = set()
    seen = set(known)
    pending = [term]
    while pending:
        item = pending.pop()
        if item in seen or not item.memory:
            continue
        seen.add(item)
        pending.extend(item.args)
        if not item.args:
            found |= item.memory
    return frozenset(found)


# Methods of a subsystem, line by line: values, initial memory, behaviours, monitors.


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
    ) -> None:
        super().__init__(module, table, again, partial)
        self._lines: list[str] = []
        self._depth = 0
        self._given: Terms = NONE

    def body(self) -> tuple[str, ...]:
        """What was written, with the locals that it starts from."""
        buffers = [
            f"{name} = self.{name}" for name in ("x", "y", "memory") if name in self.nodes.touched
        ]
        declared = [
            f"{self.local(t)}: {self.module.annotations.of(t.type)} | None = None"
            for t in in_order(self.partial)
            if t in self.locals and t not in self._given
        ]
        return (*buffers, *declared, *self._lines)

    def write(self, line: str) -> None:
        """One more line."""
        self._lines.append(INDENT * self._depth + line)

    def assign(self, terms: Iterable[Term], seen: Seen) -> Seen:
        """Locals for terms whose evaluation is due here, with those they are made of."""
        due = set(terms)
        parts = Certain(seen.always).of(*due)
        wanted = due | {part for part in parts if self._is_named(part)}
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

    def _prepared(self, values: Iterable[Term], seen: Seen) -> Seen:
        """Locals for what an evaluation of `values` needs in any case."""
        parts = Certain(seen.always).of(*values)
        return self.assign([part for part in parts if self._is_named(part)], seen)

    def _is_named(self, term: Term) -> bool:
        return term.let is not None or term in self.again

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
        seen = self._prepared((term,), seen)
        spelled, seen = self.value(term, seen)
        self.nodes.touched.add("memory")
        line = f"memory.{self.module.memory[item.name]} = {spelled.text}"
        self.write(traced(line, item.trace))
        return seen

    def monitors(self, violated: list[Term]) -> None:
        """Report axioms that do not hold, from the first period on that evaluates conditions."""
        self.nodes.periods = "(self._periods + 1)"
        if not violated:
            return
        self.write("if self.state:")
        self._depth += 1
        for index, term in enumerate(violated):
            self.nodes.hint = f"axiom_{index}"
            spelled, _ = self.value(term, Seen())
            self.write(f"if {spelled.text}:")
            self.write(f"{INDENT}self.violated({index})")
        self._depth -= 1

    def activity(self, activity: Activity, taken: tuple[Term, ...], seen: Seen) -> tuple[str, ...]:
        """Outputs, then memory: all values are computed before the first memory changes."""
        for term in taken:
            is_sure = term in activity.surely and not term.reads_clock
            seen = seen.plus(term, always=is_sure)
            if not is_sure:
                self.partial.add(term)
        self._given = frozenset(taken)
        seen = self._prepared((work.value for work in activity.works), seen)
        before, after = memory_order(activity.works, seen.always)
        names = {work: self.names.new(f"next_{work.assignment.name}") for work in before}
        outputs = [work for work in activity.works if work.assignment.peer]
        for work in (*outputs, *before, *after):
            self.nodes.hint = f"{work.function.name}_{work.assignment.name}"
            spelled, seen = self.value(work.value, seen)
            trace = work.assignment.trace or work.function.trace
            target = names.get(work) or self.target(work)
            self.write(traced(f"{target} = {spelled.text}", trace))
        for work, name in names.items():
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


def _noted(line: str, term: Term) -> str:
    """`line` with the source of the let it computes, and with its title if there is room."""
    if term.let is None:
        return line
    full = traced(line, term.let.trace, term.let.title)
    return full if len(full) <= WIDTH else traced(line, term.let.trace)
