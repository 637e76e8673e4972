"""The methods of a generated class, line by line: step, first period, states and behaviours."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from itertools import chain

from specc.lang.builtins import FUNCTIONS
from specc.lower.flow import (
    Activity,
    BehaviourRun,
    Check,
    Computation,
    Flow,
    FlowRow,
    Flows,
    Proofs,
    Rows,
    must_evaluate,
)
from specc.lower.module import Module
from specc.lower.names import FINALISE, MethodPlan, comment, docstring, literal, with_trace
from specc.lower.nodes import PRIMARY, Emitted, Emitter
from specc.lower.terms import NONE, Term, TermSet, TermTable, by_order, unevaluated
from specc.model import expr as e
from specc.model.fsm import Behaviour, Condition, Trace
from specc.model.system import Memory, Subsystem
from specc.model.types import Pose
from specc.reachable import reachable

# Simultaneous assignment in sequence: in which order memory may change within a period.


def memory_order(
    works: Iterable[Computation], known: Collection[Term]
) -> tuple[list[Computation], list[Computation]]:
    """Memory elements to compute beforehand, and the rest in an order in which they may change.

    An assignment that needs an old value comes before the one that changes it. Only where elements
    need each other's old values, one of them must be computed beforehand. The terms `known` have a
    local already.
    """

    def still_reads(term: Term) -> frozenset[str]:
        leaves = (part for part in unevaluated((term,), known) if not part.args)
        return frozenset[str]().union(*(leaf.memory for leaf in leaves))

    reads = {work: still_reads(work.value) for work in works if not work.assignment.peer}
    before: list[Computation] = []
    ordered: list[Computation] = []
    while reads:
        free = (
            work
            for work in reads
            if not any(
                work.assignment.name in read for other, read in reads.items() if other is not work
            )
        )
        work = next(free, None)
        if work is not None:
            ordered.append(work)
        else:
            work = next(iter(reads))
            before.append(work)
        del reads[work]
    return before, ordered


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
    """Writes the body of one method, which evaluates `terms`.

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
        """Write one more line."""
        self._lines.append(INDENT * self._depth + line)

    @contextmanager
    def block(self, line: str) -> Iterator[None]:
        """Write lines under `line`; locals that get their value there are not known after it."""
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
                prefix + (term.let.name.rstrip(")") if term.let else _local_hint(term))
            )
        return names[term]

    def emit(self, term: Term) -> str:
        """Emit a term for the next statement; what may be needed again is written before it."""
        for part in by_order(unevaluated((term,), self.nodes.known)):
            if part in self.reused and part is not term:
                self.defer(part)
        return self.nodes.emit(term).text

    def defer(self, term: Term) -> None:
        """Write a cached function that computes a term on first use."""
        if term not in self.nodes.known:
            name = self.local(term, "get_")
            keep = self.module.imports.runtime_name("cache")
            self.write(
                _with_let_trace(f"{name} = {keep}(lambda: {self.nodes.emit(term).text})", term)
            )
            self.nodes.known[term] = Emitted(f"{name}()", PRIMARY)

    def assign(self, terms: Iterable[Term]) -> None:
        """Write locals for terms and the shared parts they need."""
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
        """Write comments on the conditions that need no test."""
        for cause, condition in behaviour.endings:
            test = self.nodes.table.of(condition.when).node
            if isinstance(test, e.Truth) and condition.trace:
                outcome = "always" if test.value else "never"
                self.write(
                    f"# {comment(f'{cause} {outcome}: {condition.name}', str(condition.trace))}"
                )

    def initial(self, item: Memory, term: Term) -> None:
        """Write the initial value of a memory element."""
        self.nodes.name_hint = f"initial_{item.name}"
        self.assign(self._shared_parts((term,)))
        value = self.emit(term)
        self.nodes.used_buffers.add("memory")
        self.write(with_trace(f"memory.{self.module.memory[item.name]} = {value}", item.trace))

    def monitors(self, violated: list[Term]) -> None:
        """Write reports of violated axioms, from the first period on that evaluates conditions."""
        self.nodes.periods = "(self._periods + 1)"
        if not violated:
            return
        with self.block("if self.state:"):
            for index, term in enumerate(violated):
                self.nodes.name_hint = f"axiom_{index}"
                with self.block(f"if {self.emit(term)}:"):
                    self.write(f"self.violated({index})")

    def write_activity(
        self, activity: Activity, parameter_terms: tuple[Term, ...]
    ) -> tuple[str, ...]:
        """Write the assignments of a behaviour and return its parameters.

        Outputs come before memory, so that no assignment reads a new value.
        """
        terms = *activity.parameters, *parameter_terms
        parameters = tuple(self._parameter(term, activity) for term in terms)
        self.assign(self._shared_parts(work.value for work in activity.computations))
        values = [term for term, code in self.nodes.known.items() if code.rank != PRIMARY]
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
        is_value = term in activity.parameters and term not in activity.deferred
        if is_value or term in activity.must_evaluate:
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
        case e.ParameterRef(name=name):
            return name
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


# The work cycle of a state, line by line: conditions, rows, and the call of a behaviour.


NO_TRACE = Trace()


class CycleWriter(Writer):
    """Writes methods that end with the behaviour of some state."""

    clocked: frozenset[str] = frozenset()
    """States whose behaviour or conditions ask for the time since their start."""

    def flow(self, flow: Flow) -> None:
        """Write conditions, rows and behaviour from here to the end of the period."""
        match flow:
            case BehaviourRun():
                self.enter(flow)
            case Check():
                self._check(flow)
            case Rows(is_proved=True):
                self._proved_rows(flow)
            case Rows():
                self._tested_rows(flow)

    def _test(self, test: Term, due: TermSet) -> str:
        """Write a test, after locals for those of the terms `due` that it needs."""
        needed = test.maybe_evaluated & self.reused | {
            t for t in test.maybe_evaluated - {test} if t.let
        }
        self.assign(due & needed)
        return self.emit(test)

    def _check(self, check: Check) -> None:
        self.nodes.name_hint = check.condition.name
        method = self.module.condition_methods.get(check.condition.name)
        if method and not any(term.is_costly for term in check.test.maybe_evaluated):
            test = f"self.{method}()"
        else:
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
        """Write tests of all rows; the first whose test holds is taken once it is the only one."""
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

    def first_period(self, items: list[tuple[Memory, Term]], run: BehaviourRun) -> None:
        """Write the first period: initial memory, hoisted values and the first behaviour."""
        self.nodes.may_hoist = False
        for item, term in items:
            self.initial(item, term)
        self.nodes.may_hoist = True
        place = len(self._lines)
        self.enter(run)
        if self.module.hoisted:
            self._lines.insert(place, f"self.{FINALISE}()")

    def write_hoisted(self) -> None:
        """Write the attributes that depend on nothing but the initial memory."""
        self._lines += self.nodes.hoisted_assignments()

    def enter(self, run: BehaviourRun) -> None:
        """Write one run of a behaviour, at the end of a period."""
        self.write_entry(run)
        self.write(f"return {run.row}")

    def write_entry(self, run: BehaviourRun) -> None:
        """Write the entry into a state, if it changes, and the call of its behaviour."""
        if run.is_entry:
            known = self.nodes.known.items()
            self.nodes.known = {t: code for t, code in known if not t.reads_clock}
            if not run.is_same_state:
                method = self.module.state_methods[run.target]
                state = literal(run.target)
                self.write(f"self.state, self._work = {state}, self.{method}")
            if run.target in self.clocked:
                self.write("self._periods = 0")
            self._set_modes(run.sets)
        if run.activity.computations:
            self.assign(run.always_needed)
            arguments = self._given(run)
            for term in run.arguments:
                if term not in run.always_needed:
                    self.defer(term)
                text = self.nodes.known[term].text
                if term not in run.always_needed:
                    text = text.removesuffix("()") if text.endswith("()") else f"lambda: {text}"
                arguments.append(text)
            method = self.module.behaviour_methods[run.activity.behaviour.name]
            self.write(f"self.{method}({', '.join(arguments)})")
        for update in run.updates:
            self.write(f"{self.target(update)} = {self.emit(update.value)}")

    def _set_modes(self, sets: Iterable[tuple[str, Term]]) -> None:
        """Write what a row sets; what was computed from the old values is not known any more."""
        names = {name for name, _ in sets}
        known = self.nodes.known.items()
        self.nodes.known = {t: code for t, code in known if not t.memory & names}
        for name, value in sets:
            self.nodes.used_buffers.add("memory")
            self.write(f"memory.{self.module.memory[name]} = {self.emit(value)}")

    def _given(self, run: BehaviourRun) -> list[str]:
        """The arguments for the parameters that a behaviour declares."""
        activity, texts = run.activity, []
        pairs = list(zip(activity.parameters, run.given, strict=True))
        values = [given for parameter, given in pairs if parameter not in activity.deferred]
        self.assign(self._shared_parts(values))
        for parameter, given in pairs:
            self.nodes.name_hint = f"{activity.behaviour.name}_{_local_hint(parameter)}"
            is_costly = any(
                term.is_costly and term not in self.nodes.known for term in given.maybe_evaluated
            )
            text = self.emit(given)
            if parameter in activity.deferred:
                text = f"lambda: {text}"
                if is_costly:  # and the behaviour may ask for it more than once
                    text = f"{self.module.imports.runtime_name('cache')}({text})"
            texts.append(text)
        return texts


def _condition(line: str, condition: Condition, trace: Trace = NO_TRACE) -> str:
    """A line with the name of a condition; that of one in a call goes without the arguments."""
    called, _, arguments = condition.name.partition("(")
    name = called + arguments.rpartition(")")[2]
    return with_trace(line, condition.trace or trace, name)


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
        self._calls = flows.activities
        self._activities = {a.behaviour.name: a for a in flows.activities.values()}
        self._first = flows.first_period()
        self._flows = {state.name: flows.state_flow(state.name) for state in subsystem.states}
        self.clocked = frozenset(s.name for s in subsystem.states if self._reads_clock(s.name))
        """States whose behaviour or conditions ask for the time since their start."""
        entries = [(self._first, NONE), *chain(*(f.entries() for f in self._flows.values()))]
        # What conditions that lead to a behaviour may have computed already.
        offered: dict[str, TermSet] = defaultdict(lambda: NONE)
        for enter, before in entries:
            names = {name for name, _ in enter.sets}
            fixed = (
                t for t in before if not (enter.is_entry and t.reads_clock) and not t.memory & names
            )
            offered[enter.activity.behaviour.name] |= frozenset(fixed)
        self._arguments = {
            name: behaviour_parameters(activity, offered[name])
            for name, activity in self._activities.items()
        }
        for enter, _ in entries:
            enter.arguments = self._arguments[enter.activity.behaviour.name]

    def plans(self) -> tuple[MethodPlan, ...]:
        """The methods in the order in which a reader needs them."""
        states = [self._state_method(state.name) for state in self._subsystem.states]
        behaviours = [
            self._behaviour_method(a) for a in self._activities.values() if a.computations
        ]
        # What the others ask for is known last.
        start = self._start_method()
        shared = self._condition_methods()
        first = self._step_method(), start, *self._finalise_methods()
        return (*first, *states, *shared, *behaviours)

    def _condition_methods(self) -> Iterator[MethodPlan]:
        """The error conditions that states of a mode share."""
        for mode in self._subsystem.modes:
            for cause, error in mode.errors:
                method = self._module.condition_methods.get(error.name)
                test = self._table.of(error.when)
                is_costly = any(term.is_costly for term in test.maybe_evaluated)
                if method and not is_costly and not isinstance(test.node, e.Truth):
                    writer = self._writer(test)
                    writer.write(f"return {writer.emit(test)}")
                    title = error.title or f"Error condition {cause} of mode {mode.name}"
                    doc = docstring(title, str(error.trace))
                    yield MethodPlan(method, (), "bool", doc, writer.body())

    def _reads_clock(self, state: str) -> bool:
        behaviour = self._subsystem.state(state).behaviour
        terms = [work.value for work in self._calls[behaviour.name].computations]
        terms += [self._table.of(argument) for argument in behaviour.arguments]
        terms += [self._table.of(condition.when) for _, condition in behaviour.endings]
        rows = [r for cause in behaviour.causes for r in self._subsystem.rows(state, cause)]
        terms += [self._table.of(row.condition.when) for _, row in rows]
        terms += [self._table.of(axiom.that) for axiom in self._subsystem.axioms]
        return any(term.reads_clock for term in terms)

    def _writer(self, *terms: Term) -> CycleWriter:
        return CycleWriter(self._module, self._table, terms)

    def _state_method(self, state: str) -> MethodPlan:
        flow, declared = self._flows[state], self._subsystem.state(state)
        writer = self._writer(*flow.evaluated_terms)
        writer.clocked = self.clocked
        if state in self.clocked:
            writer.write("self._periods += 1")
        writer.constant_conditions(declared.behaviour)
        writer.flow(flow)
        around = f", in {' in '.join(reversed(declared.modes))}" if declared.modes else ""
        doc = docstring((declared.title or f"State {state}") + around, str(declared.trace))
        return MethodPlan(self._module.state_methods[state], (), "int", doc, writer.body())

    def _behaviour_method(self, activity: Activity) -> MethodPlan:
        behaviour = activity.behaviour
        writer = self._writer(*(work.value for work in activity.computations))
        parameters = writer.write_activity(activity, self._arguments[behaviour.name])
        title = behaviour.title or behaviour.name.replace("_", " ").capitalize()
        name = self._module.behaviour_methods[behaviour.name]
        doc = docstring(title, str(behaviour.trace))
        return MethodPlan(name, parameters, "None", doc, writer.body())

    def _start_method(self) -> MethodPlan:
        items = [(item, self._table.of(item.init, item.type)) for item in self._subsystem.memory]
        writer = self._writer(*(term for _, term in items), *self._first.arguments)
        writer.clocked = self.clocked
        writer.first_period(items, self._first)
        doc = "First period: initial memory and the behaviour of the initial state."
        return MethodPlan("_start", (), "int", doc, writer.body())

    def _finalise_methods(self) -> Iterator[MethodPlan]:
        if self._module.hoisted:
            writer = self._writer()
            writer.write_hoisted()
            doc = "Put together once what no behaviour changes any more."
            yield MethodPlan(FINALISE, (), "None", doc, writer.body())

    def _step_method(self) -> MethodPlan:
        writer = self._writer()
        tests = [self._table.negation(self._table.of(a.that)) for a in self._subsystem.axioms]
        writer.monitors(tests)
        writer.write("return self._work()")
        doc = "One period of the work cycle; the row of the transition taken, or -1."
        return MethodPlan("step", (), "int", doc, writer.body())


def behaviour_parameters(activity: Activity, offered: TermSet) -> tuple[Term, ...]:
    """The outermost costly terms that callers offer: a behaviour takes them as parameters."""

    def is_passed(term: Term) -> bool:
        return term in offered and term.is_costly

    found = reachable(
        (work.value for work in activity.computations), lambda t: () if is_passed(t) else t.args
    )
    return tuple(by_order(filter(is_passed, found)))
