"""Methods of a subsystem, line by line: values, initial memory, behaviours, monitors."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager

from specc.lang.builtins import FUNCTIONS
from specc.lower.flow import Activity, Computation, must_evaluate
from specc.lower.module import Module
from specc.lower.names import comment, with_trace
from specc.lower.nodes import PRIMARY, Emitted, Emitter
from specc.lower.table import TermTable
from specc.lower.terms import Term, TermSet, by_order, unevaluated
from specc.model import expr as e
from specc.model.fsm import Behaviour
from specc.model.system import Memory
from specc.model.types import Pose

# Simultaneous assignment in sequence: in which order memory may change within a period.


def memory_order(
    works: Iterable[Computation], known: Collection[Term]
) -> tuple[list[Computation], list[Computation]]:
    """Memory elements to compute beforehand, and the rest in an order in which they may change.

    An assignment that needs an old value comes before the one that changes it. Only where elements
    need each other's old values, one of them must be computed beforehand. The terms `known` have a
    local already.
    """
    reads = {work: _reads(work.value, known) for work in works if not work.assignment.peer}
    before: list[Computation] = []
    ordered: list[Computation] = []
    while reads:
        free = (work for work in reads if not _is_still_read(work, reads))
        work = next(free, None)
        if work is not None:
            ordered.append(work)
        else:
            work = next(iter(reads))
            before.append(work)
        del reads[work]
    return before, ordered


def _is_still_read(work: Computation, reads: dict[Computation, frozenset[str]]) -> bool:
    name = work.assignment.name
    return any(name in reads for other, reads in reads.items() if other is not work)


def _reads(term: Term, known: Collection[Term]) -> frozenset[str]:
    """Memory elements that a value still reads when the terms `known` have a local."""
    leaves = (part for part in unevaluated((term,), known) if not part.args)
    return frozenset[str]().union(*(leaf.memory for leaf in leaves))


# Which values get a local.


def reused_terms(terms: Iterable[Term]) -> TermSet:
    """Terms that call operators, or cost as much, and stand in several places of a method."""
    places = Counter(terms)
    for term in reversed(by_order(unevaluated(places, ()))):
        times = 1 if term.is_worth_local else places[term]
        for place, arg in enumerate(term.args):
            in_loop = isinstance(term.node, e.Quantifier) and place
            places[arg] += 2 if in_loop else min(times, 2)
    again = (term for term in places if term.is_worth_local and places[term] > 1)
    return frozenset(term for term in again if any(part.is_costly for part in term.maybe_evaluated))


# Methods of a subsystem, line by line: values, initial memory, behaviours, monitors.


INDENT = "    "
WIDTH = 88
"""Room for a statement and its comment in a method of a class."""


class Writer:
    """Writes the body of one method, which evaluates the terms `asked`.

    A value that is needed again has a local: it is assigned where it is evaluated in any case;
    behind a guard a function computes it when it is first asked for.
    """

    def __init__(self, module: Module, table: TermTable, terms: Iterable[Term] = ()) -> None:
        self.module = module
        self.nodes = Emitter(module, table)
        self.reused = reused_terms(terms)
        self._lines: list[str] = []
        self._depth = 0
        self._locals: dict[str, dict[Term, str]] = {"": {}, "get_": {}}

    def body(self) -> tuple[str, ...]:
        """What was written, after the buffers that it needs."""
        touched = [name for name in ("x", "y", "memory") if name in self.nodes.used_buffers]
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
                prefix + (term.let.name if term.let else _local_hint(term))
            )
        return names[term]

    def emit(self, term: Term) -> str:
        """A value in the statement that comes next; what it may need again stands before it."""
        for part in by_order(unevaluated((term,), self.nodes.known)):
            if part in self.reused and part is not term:
                self.defer(part)
        return self.nodes.emit(term).text

    def defer(self, term: Term) -> None:
        """A function for a term whose value may be needed."""
        if term not in self.nodes.known:
            name = self.local(term, "get_")
            keep = self.module.imports.runtime_name("cache")
            self.write(
                _with_let_trace(f"{name} = {keep}(lambda: {self.nodes.emit(term).text})", term)
            )
            self.nodes.known[term] = Emitted(f"{name}()", PRIMARY)

    def assign(self, terms: Iterable[Term]) -> None:
        """Locals for terms whose evaluation is due here, with those they are made of."""
        due = set(terms)
        wanted = due | self._shared_parts(due)
        hint = self.nodes.name_hint
        for term in by_order(wanted - self.nodes.known.keys()):
            name = self.nodes.name_hint = self.local(term)
            self.write(_with_let_trace(f"{name} = {self.emit(term)}", term))
            self.nodes.known[term] = Emitted(name)
        self.nodes.name_hint = hint

    def _shared_parts(self, terms: Iterable[Term]) -> set[Term]:
        """What an evaluation of `terms` needs in any case and gets a local for."""
        parts = must_evaluate(terms, self.nodes.known)
        return {part for part in parts if part.let or part in self.reused}

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
        self.nodes.name_hint = f"initial_{item.name}"
        self.assign(self._shared_parts((term,)))
        value = self.emit(term)
        self.nodes.used_buffers.add("memory")
        self.write(with_trace(f"memory.{self.module.memory[item.name]} = {value}", item.trace))

    def monitors(self, violated: list[Term]) -> None:
        """Report axioms that do not hold, from the first period on that evaluates conditions."""
        self.nodes.periods = "(self._periods + 1)"
        if not violated:
            return
        with self.block("if self.state:"):
            for index, term in enumerate(violated):
                self.nodes.name_hint = f"axiom_{index}"
                with self.block(f"if {self.emit(term)}:"):
                    self.write(f"self.violated({index})")

    def activity(self, activity: Activity, taken: tuple[Term, ...]) -> tuple[str, ...]:
        """Outputs, then memory: all values are computed before the first memory changes."""
        parameters = tuple(self._parameter(term, activity) for term in taken)
        self.assign(self._shared_parts(work.value for work in activity.computations))
        values = [term for term, spelled in self.nodes.known.items() if spelled.rank != PRIMARY]
        before, after = memory_order(activity.computations, values)
        names = {work: self.nodes.names.new(f"next_{work.assignment.name}") for work in before}
        outputs = [work for work in activity.computations if work.assignment.peer]
        for work in (*outputs, *before, *after):
            self.nodes.name_hint = f"{work.function.name}_{work.assignment.name}"
            value = self.emit(work.value)
            trace = work.assignment.trace or work.function.trace
            self.write(with_trace(f"{names.get(work) or self.target(work)} = {value}", trace))
        for work, name in names.items():
            self.write(f"{self.target(work)} = {name}")
        return parameters

    def _parameter(self, term: Term, activity: Activity) -> str:
        annotation = self.module.annotations.of(term.type)
        if term in activity.must_evaluate:
            self.nodes.known[term] = Emitted(self.local(term))
            return f"{self.local(term)}: {annotation}"
        name = self.local(term, "get_")
        self.nodes.known[term] = Emitted(f"{name}()", PRIMARY)
        return f"{name}: Callable[[], {annotation}]"

    def target(self, work: Computation) -> str:
        """What a value is assigned to."""
        assignment = work.assignment
        if assignment.peer:
            self.nodes.used_buffers.add("y")
            return f"y.{self.module.outputs[assignment.peer, assignment.name]}"
        self.nodes.used_buffers.add("memory")
        return f"memory.{self.module.memory[assignment.name]}"


def _with_let_trace(line: str, term: Term) -> str:
    """`line` with the source of the let it computes, and with its title if there is room."""
    if term.let is None:
        return line
    full = with_trace(line, term.let.trace, term.let.title)
    return full if len(full) <= WIDTH else with_trace(line, term.let.trace)


def _local_hint(term: Term) -> str:
    match term.node:
        case e.Call(operator=operator):
            return e.source_name(operator).lower()
        case e.Builtin(name=name) if FUNCTIONS[name].rule is None:
            return _local_hint(term.args[0])
        case e.Builtin(name=name):
            return f"{name}_value"
        case e.Binary() | e.Unary():
            return "pose_value" if isinstance(term.type, Pose) else "value"
        case e.Logic() | e.Quantifier():
            return "holds"
    return "value"
