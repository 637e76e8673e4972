"""States, behaviours, functions, rows and assumptions; safe outputs of devices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from specc.lang import ExprError, Scope
from specc.model.expr import FALSE, TRUE, Expr, junction, negation
from specc.model.fsm import (
    OTHERWISE,
    Assignment,
    Axiom,
    Behaviour,
    Cause,
    Condition,
    ConditionKind,
    Function,
    Generic,
    Parameter,
    State,
    Trace,
    Transition,
)
from specc.model.system import Element, Memory, Port
from specc.model.types import Bool
from specc.reachable import grouped
from specc.resolve.calls import (
    arguments_at,
    called_at,
    parameters_at,
    report_no_arguments,
    with_arguments,
    with_parameters,
)
from specc.resolve.context import Findings, YamlNode, trace_of, unknown_at
from specc.resolve.definitions import inlined
from specc.resolve.expansion import targets_of
from specc.resolve.expressions import Expressions
from specc.resolve.uses import note_element, note_row, note_target
from specc.schema.subsystem import (
    AssignmentDef,
    BehaviourDef,
    ConditionDef,
    ErrorDef,
    FunctionDef,
    SubsystemDef,
    TerminalDef,
    UsedFunctionDef,
)

PartKind = Literal["behaviour", "function"]
"""What may have parameters."""
_Written = tuple[str, str, Element | Memory]
"""Peer and name of an output, or "" and the name of memory; and what it is."""
_Exchanged = tuple[str, str, Element]
"""Peer and name of an element of a buffer, and the element."""

# The machine of a subsystem: conditions, functions, behaviours, states and transitions.


@dataclass(eq=False, slots=True)
class MachineResolver:
    """Resolves one subsystem's machine in the scope that its buffers make."""

    definition: SubsystemDef
    where: YamlNode
    scope: Scope
    ports: tuple[Port, ...]
    memory: tuple[Memory, ...]
    expressions: Expressions
    _findings: Findings = field(init=False)
    _targets: dict[str, _Written] = field(init=False)
    """What can be assigned, as it is written: memory before outputs."""
    _outputs: dict[str, _Exchanged] = field(init=False)
    _events: dict[str, _Exchanged] = field(init=False)
    _conditions: dict[tuple[str, str], Condition] = field(default_factory=dict)
    _functions: dict[str, Function] = field(default_factory=dict)
    _behaviours: dict[str, Behaviour] = field(default_factory=dict)
    _generics: dict[tuple[str, str], Generic | None] = field(default_factory=dict)
    """Behaviours and functions with a signature, by kind and name; None if that has an error."""

    def __post_init__(self) -> None:
        self._findings = self.expressions.findings
        outputs = [(p.peer, e) for p in self.ports if p.direction == "y" for e in p.elements]
        self._targets = {item.name: ("", item.name, item) for item in self.memory}
        self._outputs = {f"y.{peer}.{e.name}": (peer, e.name, e) for peer, e in outputs}
        self._targets |= self._outputs
        inputs = [(p.peer, e) for p in self.ports if p.direction == "x" for e in p.elements]
        self._events = {f"x.{peer}.{e.name}": (peer, e.name, e) for peer, e in inputs if e.event}

    def resolve(self) -> dict[str, Any]:
        """Resolve the parts of a subsystem's machine; returns them by their names in the model.

        What has errors is unknown in it or left out, after reporting.
        """
        kinds: tuple[ConditionKind, ...] = ("initial", "terminal", "error")
        for kind in kinds:
            for name, item in getattr(self.definition.conditions, kind).items():
                at = self.where["conditions"][kind][name]
                self._conditions[kind, name] = self._declared(kind, name, item, at, self.scope)
        for name, function in self.definition.functions.items():
            at = self.where["functions"][name]
            if function.signature is None:
                self._functions[name] = self._function(name, function, at, self.scope)
            elif parameters := self._parameters("function", name, function.signature, at):
                part = self._function(name, function, at, with_parameters(self.scope, parameters))
                self._generics["function", name] = Generic(part, parameters)
        for name, behaviour in self.definition.behaviours.items():
            at = self.where["behaviours"][name]
            if behaviour.signature is None:
                self._behaviours[name] = self._behaviour(name, behaviour, at, self.scope)
                self._add_parts(self._behaviours[name])
            elif parameters := self._parameters("behaviour", name, behaviour.signature, at):
                scope = with_parameters(self.scope, parameters)
                whole = self._behaviour(name, behaviour, at, scope)
                self._generics["behaviour", name] = Generic(whole, parameters)
        states = self._states()
        return {
            "conditions": tuple(self._conditions.values()),
            "functions": tuple(self._functions.values()),
            "behaviours": tuple(self._behaviours.values()),
            "states": states,
            "generics": tuple(filter(None, self._generics.values())),
            "transitions": self._transitions(),
            "axioms": self._axioms(),
        }

    def _parameters(
        self, kind: PartKind, name: str, signature: str, at: YamlNode
    ) -> tuple[Parameter, ...] | None:
        """The parameters of a behaviour or function; None after reporting."""
        self._generics[kind, name] = None
        found = parameters_at(at["signature"], signature, self.scope, self.expressions)
        if found == ():
            message, help = "a signature without parameters says nothing", "delete it"
            self._findings.report("E0104", message, at["signature"].place, help=help)
        return found or None

    def _add_parts(self, behaviour: Behaviour) -> None:
        """Add what is a part of the subsystem as part of this behaviour: what stands in place."""
        for function in behaviour.functions:
            self._functions.setdefault(function.name, function)
        for condition in (behaviour.terminal, behaviour.error):
            if condition.name.startswith(f"{behaviour.name}."):
                self._conditions[condition.kind, condition.name] = condition

    def _called(
        self, kind: PartKind, where: YamlNode, text: str, scope: Scope
    ) -> Function | Behaviour | None:
        """The behaviour or function that a call stands for; None after reporting."""
        call = called_at(where, text, self.expressions)
        if call is None:
            return None
        name, place = call.name, where.place.within(*call.span)
        known = getattr(self.definition, f"{kind}s")
        if name not in known:
            if kind == "function" and name in self.definition.behaviours:
                message = f"`{name}` is a behaviour, which only a state runs"
                self._findings.report("E0201", message, place, help="name functions here")
            else:
                self._findings.unknown("E0201", kind, name, known, place)
            return None
        start, end = call.span
        self._findings.use(self.where[f"{kind}s"][name].key, where, start=start, end=end)
        if (kind, name) not in self._generics:
            message = f"{kind} `{name}` has no parameters"
            help = f"write `{name}`, or say what it takes: `signature: ...`"
            self._findings.report("E0315", message, place, help=help)
            return None
        generic = self._generics[kind, name]
        if generic is None:
            self._findings.suppressed += 1
            return None
        arguments = arguments_at(where, call, generic.parameters, scope, self.expressions)
        try:
            return with_arguments(generic, arguments)
        except ExprError as error:
            self.expressions.report(where, text, error)
            return None

    def _declared(
        self, kind: ConditionKind, name: str, item: ConditionDef, at: YamlNode, scope: Scope
    ) -> Condition:
        if item.when is not None:
            when = self.expressions.condition(at["when"], item.when, scope)
        else:
            when = None
            message = f"nothing says when {kind} condition `{name}` holds"
            self._open("O0202", message, at, "add `when:` with a Boolean expression")
        when = unknown_at(at, Bool()) if when is None else when
        return Condition(name, kind, when, item.title, trace_of(item), at.key)

    def _open(self, code: str, message: str, where: YamlNode, help_text: str) -> None:
        self._findings.report(code, message, where.key, help=help_text)

    def _undeclared(self, kind: ConditionKind, name: str, where: YamlNode) -> Condition:
        """Make a condition of the language, or an unknown one after reporting."""
        fixed = _FIXED[kind]
        if name in fixed:
            return Condition(name, kind, fixed[name], "", Trace(), where.place)
        others = [k for k, n in self._conditions if n == name]
        if others:
            message = f"`{name}` is the name of {_article(others[0])} condition only"
            help_text = f"declare it under `conditions:` as {_article(kind)} condition as well"
            self._findings.report("E0201", message, where.place, help=help_text)
        else:
            names = [n for k, n in self._conditions if k == kind] + list(fixed)
            self._findings.unknown("E0201", f"{kind} condition", name, names, where.place)
        return _unknown_condition(name, kind, where, where)

    def _function(self, name: str, item: FunctionDef, at: YamlNode, scope: Scope) -> Function:
        assignments = [
            self._assignment(target, value, at[named], scope)
            for named, value in item.targets.items()
            for target in targets_of(named, self.expressions.groups)
        ]
        if not assignments:
            message, help_text = (
                f"function `{name}` assigns nothing yet",
                "add a target, e.g. `y.c.T_c: ...`",
            )
            if (through := self.definition.through) and through.rule is not None:
                message, help_text = f"`through: {through.rule}` passes nothing on yet", _NO_PASSING
            self._open("O0202", message, at, help_text)
        found = tuple(filter(None, assignments))
        whole = bool(found) and len(found) == len(assignments)
        return Function(name, found, item.title, trace_of(item), at.key, whole)

    def _assignment(
        self, target: str, item: AssignmentDef, at: YamlNode, scope: Scope
    ) -> Assignment | None:
        found = self._targets.get(target)
        note_target(self._findings, target, at, self.where, found[2] if found else None)
        if found is None:
            self._no_target(target, at)
        indices, scope = self.expressions.indexed(item.each, at, scope)
        if found is None:
            self.expressions.inside(at["is"], item.value, scope)
            return None
        peer, name, declared = found
        value = self.expressions.value(at["is"], item.value, scope, declared.type, declared.place)
        value = inlined(unknown_at(at, declared.type) if value is None else value, indices)
        return Assignment(peer, name, value, trace_of(item), at.key)

    def _no_target(self, target: str, at: YamlNode) -> None:
        match target.split("."):
            case ["y", peer, name]:
                if f"y.{peer}" in self.expressions.unresolved:
                    self._findings.suppressed += 1
                elif name not in self.expressions.broken:
                    lacks = self.expressions.element("y", peer, name)
                    outputs = self._outputs
                    self._findings.unknown("E0201", "output target", target, outputs, at.key, lacks)
            case ["x", _, *_]:
                message = f"`{target}` is an input: it cannot be assigned"
                help = "assign an output, `y.peer.element`, or a memory element"
                self._findings.report("E0201", message, at.key, help=help)
            case _ if target not in self.expressions.broken:
                self._findings.unknown("E0201", "memory target", target, self._targets, at.key)

    def _behaviour(self, name: str, item: BehaviourDef, at: YamlNode, scope: Scope) -> Behaviour:
        each = enumerate(item.functions)
        used = [self._used(name, index, used, at, scope) for index, used in each]
        functions = tuple(function for function in used if function)
        terminal = at["terminal"]
        if item.terminal is not None:
            end = self._ending("terminal", name, item.terminal, terminal, scope)
        else:
            message = f"nothing says when behaviour `{name}` ends"
            self._open(
                "O0606", message, at, "add `terminal:` with a condition, `always` or `never`"
            )
            end = _unknown_condition(name, "terminal", terminal, at)
        error = self._ending("error", name, item.error or _NO_ERROR, at["error"], scope)
        is_complete = len(functions) == len(used) and all(f.is_complete for f in functions)
        trace = trace_of(item)
        return Behaviour(name, functions, end, error, item.title, trace, at.key, is_complete)

    def _used(
        self, behaviour: str, index: int, used: UsedFunctionDef, inside: YamlNode, scope: Scope
    ) -> Function | None:
        """Resolve a function of a behaviour, by name or inline."""
        known = self.definition.functions
        found = self._functions.get(used.function or "")
        if found is not None and used.function in known and not used.targets:
            self._findings.use(found.place, inside, "functions", index, "function")
            return found
        at = inside["functions"][index]
        if used.function is None:
            return self._function(f"{behaviour}.functions[{index}]", used, at, scope)
        if used.targets:
            message = f"`{used.function}` is declared, so it has its targets there"
            hint = "make two items of the list: the name, and the function that stands in place"
            self._findings.report("E0104", message, at.place, help=hint)
        where = at["function"]
        if "(" in used.function:
            call = self._called("function", where, used.function, scope)
            # Calls with equal arguments are one function.
            return self._functions.get(call.name, call) if isinstance(call, Function) else None
        self._report_bare("function", used.function, where)
        self._findings.use(found.place if found else None, at, "function")
        return found

    def _report_bare(self, kind: PartKind, name: str, where: YamlNode) -> None:
        """Report the name of no behaviour or function, or of one that takes arguments."""
        known = getattr(self.definition, f"{kind}s")
        if name not in known:
            self._findings.unknown("E0201", kind, name, known, where.place)
        elif generic := self._generics.get((kind, name)):
            report_no_arguments(name, generic.parameters, where, self.expressions)
            self._findings.use(generic.part.place, where)
        elif (kind, name) in self._generics:
            self._findings.suppressed += 1

    def _ending(
        self,
        kind: Cause,
        behaviour: str,
        given: TerminalDef | ErrorDef,
        at: YamlNode,
        scope: Scope,
    ) -> Condition:
        """Resolve a behaviour's condition, named or inline."""
        name = f"{behaviour}.{kind}" if given.condition is None else given.condition
        if given.condition is None:
            return self._declared(kind, name, given, at, scope)
        if given.when is not None:
            message = f"`{name}` has its expression where it is declared"
            hint = "write the name alone, or leave it out"
            self._findings.report("E0104", message, at.place, help=hint)
        known = self._conditions.get((kind, name))
        if known is None:
            return self._undeclared(kind, name, at["condition"] if at.raw else at)
        self._findings.use(known.place, at["condition"])
        return known

    def _states(self) -> tuple[State, ...]:
        states, where = [], self.where["states"]
        if self.definition.states and not self.definition.behaviours:
            message = "the subsystem has no behaviours yet"
            self._open("O0603", message, where, "add `behaviours:`")
        for name, item in self.definition.states.items():
            at = where[name]
            behaviour = self._behaviours.get(item.behaviour or "")
            if behaviour is None and "(" in (item.behaviour or ""):
                behaviour = self._run(item.behaviour or "", at)
            elif behaviour is None:
                behaviour = self._unknown_behaviour(name, item.behaviour, at)
            elif behaviour.place != at.key:  # it does not stand in the state
                self._findings.use(behaviour.place, at, "behaviour")
            events = self._elements(item.ignores, at["ignores"], self._events, "E0201", "event")
            outputs = self._elements(item.holds, at["holds"], self._outputs, "E0201", "output")
            trace = trace_of(item)
            states.append(State(name, behaviour, item.title, trace, at.key, events, outputs))
        return tuple(states)

    def _elements(
        self, names: list[str], where: YamlNode, known: dict[str, _Exchanged], code: str, what: str
    ) -> tuple[tuple[str, str], ...]:
        """Peer and element of the events or outputs that a state names."""
        found: list[tuple[str, str]] = []
        for at, written in ((where[index], name) for index, name in enumerate(names)):
            for name in targets_of(written, self.expressions.groups):
                if name in known:
                    note_element(self._findings, written, at, self.where, known[name][2].place)
                    found.append(known[name][:2])
                elif name not in self.expressions.unresolved and not self.expressions.broken:
                    self._findings.unknown(code, what, name, known, at.place)
        return tuple(found)

    def _run(self, text: str, at: YamlNode) -> Behaviour:
        """The behaviour that a state calls; states with equal calls have one behaviour."""
        found = self._called("behaviour", at["behaviour"], text, self.scope)
        if not isinstance(found, Behaviour):
            return _lost_behaviour(text, at)
        if found.name not in self._behaviours:
            self._behaviours[found.name] = found
            self._add_parts(found)
        return self._behaviours[found.name]

    def _unknown_behaviour(self, state: str, name: str | None, at: YamlNode) -> Behaviour:
        if name is None:
            message = f"state `{state}` has no behaviour yet"
            self._open("O0607", message, at, "add `behaviour:`, the name of one")
        elif self.definition.behaviours:
            self._report_bare("behaviour", name, at["behaviour"])
        return _lost_behaviour(name or state, at)

    def _transitions(self) -> tuple[Transition, ...]:
        rows, table = [], self.where["transitions"]
        for index, item in enumerate(self.definition.transitions):
            at, when = table[index], item.when
            sources = [n for i, n in enumerate(item.sources) if self._is_state(n, at["from"][i])]
            known = self._is_state(item.target, at["to"])
            note_row(self._findings, item, at, self.where, self._conditions)
            condition = self._conditions.get(("initial", when))
            is_remainder = when == OTHERWISE and condition is None
            if condition is None:
                condition = self._undeclared("initial", when, at["when"])
            rest = condition, item.target, trace_of(item), at.place, is_remainder
            rows += [Transition(source, item.cause, *rest) for source in sources if known]
        return _with_remainders(rows)

    def _is_state(self, name: str, at: YamlNode) -> bool:
        known = self.definition.states
        if known and name not in known:
            self._findings.unknown("E0201", "state", name, known, at.place)
        return name in known

    def _axioms(self) -> tuple[Axiom, ...]:
        axioms = []
        scope = replace(self.scope, allow_clock=False)
        for index, item in enumerate(self.definition.assume):
            at = self.where["assume"][index]
            that = self.expressions.value(at["that"], item.that, scope, Bool())
            if that:
                axioms.append(Axiom(that, item.because, at["that"].place))
        return tuple(axioms)


def _with_remainders(rows: Sequence[Transition]) -> tuple[Transition, ...]:
    """Replace `otherwise` in rows: no other row of the state and cause applies."""
    found = []
    others = grouped(((r.source, r.cause), r.condition) for r in rows if not r.is_otherwise)
    for row in rows:
        if row.is_otherwise:
            around = others.get((row.source, row.cause), [])
            title = " or ".join(f"`{other.name}`" for other in around)
            when = none_of([other.when for other in around])
            condition = replace(row.condition, when=when, title=f"not {title}" if title else "")
            row = replace(row, condition=condition)
        found.append(row)
    return tuple(found)


def none_of(conditions: Sequence[Expr]) -> Expr:
    """The condition that none of these conditions holds."""
    return negation(junction("or", conditions))


_NO_PASSING = (
    "add elements to its device, or to both sides of its own, by the same names; a control "
    "subsystem has one side only, so write targets there"
)
_NO_ERROR = ErrorDef(condition="never")
_ENDS: dict[str, Expr] = {"always": TRUE, "never": FALSE}
# `otherwise` is of the other rows, once they are known.
_FIXED: dict[ConditionKind, dict[str, Expr]] = {
    "initial": {**_ENDS, OTHERWISE: TRUE},
    "terminal": _ENDS,
    "error": _ENDS,
}


def _article(kind: str) -> str:
    return f"{'an' if kind[0] in 'ei' else 'a'} {kind}"


def _lost_behaviour(name: str, at: YamlNode) -> Behaviour:
    """A behaviour of which nothing is known but its name."""
    terminal = _unknown_condition(name, "terminal", at["terminal"], at)
    error = _unknown_condition(name, "error", at["error"], at)
    return Behaviour(name, (), terminal, error, "", Trace(), at.place, is_complete=False)


def _unknown_condition(name: str, kind: ConditionKind, where: YamlNode, at: YamlNode) -> Condition:
    """A condition, missing at `where`, of which nothing is known but its name."""
    return Condition(name, kind, unknown_at(where, Bool()), "", Trace(), at.place)
