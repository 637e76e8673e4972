"""Methods of a subsystem, line by line: values, initial memory, behaviours, monitors."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager

from specc.lang.builtins import FUNCTIONS
from specc.lower.flow import Activity, Work, surely
from specc.lower.module import Module
from specc.lower.names import comment, traced
from specc.lower.nodes import PRIMARY, Nodes, Spelled
from specc.lower.table import TermTable
from specc.lower.terms import Term, TermSet, in_order, unknown
from specc.model import expr as e
from specc.model.fsm import Behaviour
from specc.model.system import Memory
from specc.model.types import Pose

# Simultaneous assignment in sequence: in which order memory may change within a period.


def memory_order(works: Iterable[Work], known: Collection[Term]) -> tuple[list[Work], list[Work]]:
    """Memory elements to compute beforehand, and the rest in an order in which they may change.

    An assignment that needs an old value comes before the one that changes it. Only where elements
    need each other's old values, one of them must be computed beforehand. The terms `known` have a
    local already.
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


def _reads(term: Term, known: Collection[Term]) -> frozenset[str]:
    """Memory elements that a value still reads when the terms `known` have a local."""
    leaves = (part for part in unknown((term,), known) if not part.args)
    return frozenset[str]().union(*(leaf.memory for leaf in leaves))


# Which values get a local.


def needed_again(asked: Iterable[Term]) -> TermSet:
    """Terms that call operators, or cost as much, and stand in several places of a method."""
    places = Counter(asked)
    for term in reversed(in_order(unknown(places, ()))):
        times = 1 if term.is_kept else places[term]
        for place, arg in enumerate(term.args):
            in_loop = isinstance(term.node, e.Quantifier) and place
            places[arg] += 2 if in_loop else min(times, 2)
    again = (term for term in places if term.is_kept and places[term] > 1)
    return frozenset(term for term in again if any(part.is_costly for part in term.perhaps))


# Methods of a subsystem, line by line: values, initial memory, behaviours, monitors.


INDENT = "    "
WIDTH = 88
"""Room for a statement and its comment in a method of a class."""


class Writer:
    """Writes the body of one method, which evaluates the terms `asked`.

    A value that is needed again has a local: it is assigned where it is evaluated in any case;
    behind a guard a function computes it when it is first asked for.
    """

    def __init__(self, module: Module, table: TermTable, asked: Iterable[Term] = ()) -> None:
        self.module = module
        self.nodes = Nodes(module, table)
        self.again = needed_again(asked)
        self._lines: list[str] = []
        self._depth = 0
        self._locals: dict[str, dict[Term, str]] = {"": {}, "get_": {}}

    def body(self) -> tuple[str, ...]:
        """What was written, after the buffers that it needs."""
        touched = [name for name in ("x", "y", "memory") if name in self.nodes.touched]
        return (*(f"{name} = self.{name}" for name in touched), *self._lines)

    def write(self, line: str) -> None:
        """One more line."""
        self._lines.append(INDENT * self._depth + line)

    @contextmanager
    def block(self, line: str) -> Iterator[None]:
        """Lines under `line`; locals that get their value there have none behind it."""
        self.write(line)
        known = self.nodes.known
        self.nodes.known = dict(known)
        self._depth += 1
        yield
        self._depth -= 1
        self.nodes.known = known

    def local(self, term: Term, prefix: str = "") -> str:
        """The local of a term: its let's name, else its operator's in small letters."""
        names = self._locals[prefix]
        if term not in names:
            names[term] = self.nodes.names.new(
                prefix + (term.let.name if term.let else _wanted(term))
            )
        return names[term]

    def emit(self, term: Term) -> str:
        """A value in the statement that comes next; what it may need again stands before it."""
        for part in in_order(unknown((term,), self.nodes.known)):
            if part in self.again and part is not term:
                self.defer(part)
        return self.nodes.value(term).text

    def defer(self, term: Term) -> None:
        """A function for a term whose value may be needed."""
        if term not in self.nodes.known:
            name = self.local(term, "get_")
            keep = self.module.imports.own("cache")
            self.write(_noted(f"{name} = {keep}(lambda: {self.nodes.value(term).text})", term))
            self.nodes.known[term] = Spelled(f"{name}()", PRIMARY)

    def assign(self, terms: Iterable[Term]) -> None:
        """Locals for terms whose evaluation is due here, with those they are made of."""
        due = set(terms)
        wanted = due | self._named_parts(due)
        hint = self.nodes.hint
        for term in in_order(wanted - self.nodes.known.keys()):
            name = self.nodes.hint = self.local(term)
            self.write(_noted(f"{name} = {self.emit(term)}", term))
            self.nodes.known[term] = Spelled(name)
        self.nodes.hint = hint

    def _named_parts(self, terms: Iterable[Term]) -> set[Term]:
        """What an evaluation of `terms` needs in any case and gets a local for."""
        parts = surely(terms, self.nodes.known)
        return {part for part in parts if part.let or part in self.again}

    def constant_conditions(self, behaviour: Behaviour) -> None:
        """Say where conditions come from that need no test."""
        for cause, condition in behaviour.endings:
            test = self.nodes.table.of(condition.when).node
            if isinstance(test, e.Truth) and condition.trace:
                outcome = "always" if test.value else "never"
                self.write(
                    f"# {comment(f'{cause} {outcome}: {condition.name}', str(condition.trace))}"
                )

    def initial(self, item: Memory, term: Term) -> None:
        """The initial value of a memory element."""
        self.nodes.hint = f"initial_{item.name}"
        self.assign(self._named_parts((term,)))
        value = self.emit(term)
        self.nodes.touched.add("memory")
        self.write(traced(f"memory.{self.module.memory[item.name]} = {value}", item.trace))

    def monitors(self, violated: list[Term]) -> None:
        """Report axioms that do not hold, from the first period on that evaluates conditions."""
        self.nodes.periods = "(self._periods + 1)"
        if not violated:
            return
        with self.block("if self.state:"):
            for index, term in enumerate(violated):
                self.nodes.hint = f"axiom_{index}"
                with self.block(f"if {self.emit(term)}:"):
                    self.write(f"self.violated({index})")

    def activity(self, activity: Activity, taken: tuple[Term, ...]) -> tuple[str, ...]:
        """Outputs, then memory: all values are computed before the first memory changes."""
        parameters = tuple(self._parameter(term, activity) for term in taken)
        self.assign(self._named_parts(work.value for work in activity.works))
        values = [term for term, spelled in self.nodes.known.items() if spelled.rank != PRIMARY]
        before, after = memory_order(activity.works, values)
        names = {work: self.nodes.names.new(f"next_{work.assignment.name}") for work in before}
        outputs = [work for work in activity.works if work.assignment.peer]
        for work in (*outputs, *before, *after):
            self.nodes.hint = f"{work.function.name}_{work.assignment.name}"
            value = self.emit(work.value)
            trace = work.assignment.trace or work.function.trace
            self.write(traced(f"{names.get(work) or self.target(work)} = {value}", trace))
        for work, name in names.items():
            self.write(f"{self.target(work)} = {name}")
        return parameters

    def _parameter(self, term: Term, activity: Activity) -> str:
        annotation = self.module.annotations.of(term.type)
        if term in activity.surely:
            self.nodes.known[term] = Spelled(self.local(term))
            return f"{self.local(term)}: {annotation}"
        name = self.local(term, "get_")
        self.nodes.known[term] = Spelled(f"{name}()", PRIMARY)
        return f"{name}: Callable[[], {annotation}]"

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


def _wanted(term: Term) -> str:
    match term.node:
        case e.Call(operator=operator):
            return e.written(operator).lower()
        case e.Builtin(name=name) if FUNCTIONS[name].rule is None:
            return _wanted(term.args[0])
        case e.Builtin(name=name):
            return f"{name}_value"
        case e.Binary() | e.Unary():
            return "pose_value" if isinstance(term.type, Pose) else "value"
        case e.Logic() | e.Quantifier():
            return "holds"
    return "value"
