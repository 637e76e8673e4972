"""States, behaviours, functions, rows and assumptions; safe outputs of devices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from specc.diagnostics import Related
from specc.lang import Scope
from specc.model.expr import (
    FALSE,
    TRUE,
    Compare,
    Expr,
    IsOneOf,
    Member,
    junction,
    negation,
)
from specc.model.fsm import (
    NEVER_LEFT,
    OTHERWISE,
    Assignment,
    Axiom,
    Behaviour,
    Condition,
    ConditionKind,
    Function,
    Generic,
    Mode,
    State,
    Trace,
    Transition,
)
from specc.model.system import Element, Let, Memory, Port
from specc.model.types import Bool
from specc.reachable import grouped
from specc.resolve.calls import Generics, with_parameters
from specc.resolve.context import Findings, YamlNode, trace_of, unknown_at
from specc.resolve.definitions import inlined
from specc.resolve.expansion import targets_of
from specc.resolve.expressions import Expressions
from specc.resolve.modes import FlatTable, ModeMemory, ModeTree
from specc.resolve.uses import note_element, note_target
from specc.schema.keys import Traced
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
from specc.source import Place

_Written = tuple[str, str, Element | Memory]
"""Peer and name of an output, or "" and the name of memory; and what it is."""
NamedErrors = tuple[tuple[str, Condition], ...]
"""Error conditions by name, highest priority first."""
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
    lets: tuple[Let, ...]
    rate_hz: Fraction
    expressions: Expressions
    _findings: Findings = field(init=False)
    _targets: dict[str, _Written] = field(init=False)
    """What can be assigned, as it is written: memory before outputs."""
    _outputs: dict[str, _Exchanged] = field(init=False)
    _events: dict[str, _Exchanged] = field(init=False)
    _conditions: dict[tuple[str, str], Condition] = field(default_factory=dict)
    _functions: dict[str, Function] = field(default_factory=dict)
    _behaviours: dict[str, Behaviour] = field(default_factory=dict)
    _generics: Generics = field(init=False)
    tree: ModeTree = field(init=False)

    @property
    def initial_state(self) -> str:
        """The state of the first period; "" if it is not known."""
        name = self.definition.initial_state or ""
        name = self.tree.initial(name) if name in self.tree.members else name
        return name if name in self.definition.states else ""

    def __post_init__(self) -> None:
        self._findings = self.expressions.findings
        self._generics = Generics(self.definition, self.where, self.scope, self.expressions)
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
        self.tree = ModeTree(self.definition, self.where, self._findings)
        self.tree.check_initials()
        kinds: tuple[ConditionKind, ...] = ("initial", "terminal", "error")
        for kind in kinds:
            for name, item in getattr(self.definition.conditions, kind).items():
                at = self.where["conditions"][kind][name]
                self._conditions[kind, name] = self._declared(kind, name, item, at, self.scope)
        for name, function in self.definition.functions.items():
            at = self.where["functions"][name]
            if function.signature is None:
                self._functions[name] = self._function(name, function, at, self.scope)
            elif parameters := self._generics.parameters("function", name, function.signature, at):
                part = self._function(name, function, at, with_parameters(self.scope, parameters))
                self._generics.known["function", name] = Generic(part, parameters)
        for name, behaviour in self.definition.behaviours.items():
            at = self.where["behaviours"][name]
            if behaviour.signature is None:
                self._behaviours[name] = self._behaviour(name, behaviour, at, self.scope)
                self._add_parts(self._behaviours[name])
            elif parameters := self._generics.parameters(
                "behaviour", name, behaviour.signature, at
            ):
                scope = with_parameters(self.scope, parameters)
                whole = self._behaviour(name, behaviour, at, scope)
                self._generics.known["behaviour", name] = Generic(whole, parameters)
        errors = {name: self._mode_errors(name) for name in self.definition.modes}
        states = self._states(errors)
        table = FlatTable(self.tree, {state.name: _names(state.behaviour) for state in states})
        functions = self._functions.values()
        exprs = [item.value for function in functions for item in function.assignments]
        exprs += [condition.when for condition in self._conditions.values()]
        memory = ModeMemory.of(table, [*exprs, *(let.value for let in self.lets)])
        return {
            "conditions": tuple(self._conditions.values()),
            "functions": tuple(self._functions.values()),
            "behaviours": tuple(self._behaviours.values()),
            "generics": tuple(filter(None, self._generics.known.values())),
            "states": tuple([_in_modes(state, memory) for state in states]),
            "modes": self._modes(errors),
            "lets": (*memory.lets(self.rate_hz), *self.lets),
            "memory": (*self.memory, *memory.elements(self.initial_state)),
            "transitions": self._transitions(memory),
            "idle_rows": tuple(self.where["transitions"][index].place for index in table.idle),
            "axioms": self._axioms(),
        }

    def _add_parts(self, behaviour: Behaviour) -> None:
        """Add what is a part of the subsystem as part of this behaviour: what stands in place."""
        for function in behaviour.functions:
            self._functions.setdefault(function.name, function)
        errors = [error for _, error in behaviour.errors]
        self._add_conditions(behaviour.name, [behaviour.terminal, *errors])

    def _add_conditions(self, owner: str, conditions: Sequence[Condition]) -> None:
        """Add the conditions that stand in place in a behaviour or mode."""
        for condition in conditions:
            if condition.name.startswith(f"{owner}."):
                self._conditions[condition.kind, condition.name] = condition

    def _mode_errors(self, mode: str) -> NamedErrors:
        item, at = self.definition.modes[mode].error, self.where["modes"][mode]["error"]
        if item is None:
            return ()
        name = item.condition or ""
        if item.when is not None or (name and not name.isidentifier()):
            message = f"an error condition of mode `{mode}` has no name"
            help = "give it one: `error: {name: condition}`"
            self._findings.report("E0604", message, at.place, help=help)
            return ()
        self._check_name(name, at["condition"].place)
        errors = self._errors(mode, item, at, self.scope)
        self._add_conditions(mode, [error for _, error in errors])
        return errors

    def _errors(self, owner: str, given: ErrorDef, at: YamlNode, scope: Scope) -> NamedErrors:
        """The error conditions of a behaviour or mode, in order; "" names one without a name."""
        found: list[tuple[str, Condition]] = []
        for key in sorted(given.given_keys & _OF_ONE) if given.named else ():
            message = f"`{key}` is of one error condition, and there are several here"
            help = "write it in the condition that it is about: `error: {name: {when: ...}}`"
            self._findings.report("E0104", message, at[key].key, help=help)
        if given.condition is not None or not given.named:
            # A declared condition may have a name that has another meaning as a cause.
            name = "" if given.condition in _CAUSES else given.condition or ""
            found.append((name, self._ending("error", owner, given, at, scope)))
        for name, item in given.named.items():
            self._check_name(name, at[name].key)
            found.append((name, self._declared("error", f"{owner}.{name}", item, at[name], scope)))
        return tuple(found)

    def _check_name(self, name: str, place: Place) -> None:
        """Report an error condition whose name has a meaning in rows."""
        if name in _CAUSES:
            message = f"an error condition cannot be called `{name}`"
            meaning = "any error condition" if name == "error" else "the terminal condition"
            help = f"in rows `{name}` is {meaning}: choose another name"
            self._findings.report("E0221", message, place, help=help)

    def _modes(self, errors: Mapping[str, NamedErrors]) -> tuple[Mode, ...]:
        """The modes, each before those inside it."""
        tree = self.tree
        return tuple(
            Mode(
                name,
                tree.states(name),
                tree.parent.get(name, ""),
                tree.initial(name),
                errors[name],
                item.title,
                trace_of(item),
                self.where["modes"][name].key,
            )
            for name, item in sorted(
                self.definition.modes.items(), key=lambda item: len(tree.path(item[0]))
            )
        )

    def _declared(
        self, kind: ConditionKind, name: str, item: ConditionDef, at: YamlNode, scope: Scope
    ) -> Condition:
        text = item.when or ""
        declared = {name for kind in _FIXED for name in getattr(self.definition.conditions, kind)}
        if text in {*declared, *_ENDS} and not scope.has(text):
            message, when = f"`{text}` is a condition, and not a value", None
            help = "write its expression here, or give that a name under `let:` for both"
            help = help if text in declared else f"write `{text == 'always'}`"
            self._findings.report("E0201", message, at["when"].place, help=help)
        elif item.when is not None:
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
        if "(" in target:
            self._report_call(target, at)
            return None
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

    def _report_call(self, target: str, at: YamlNode) -> None:
        """Report brackets in a target: YAML reads a call with named arguments as a mapping."""
        message, help = f"`{target}` is not a target", "name memory, or an output `y.peer.element`"
        if ")" not in target:
            name = target.partition("(")[0]
            help = f'put a call with named arguments in quotes: `"{name}(parameter: value)"`'
        self._findings.report("E0104", message, at.key, help=help)

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
        errors = self._errors(name, item.error or _NO_ERROR, at["error"], scope)
        is_complete = len(functions) == len(used) and all(f.is_complete for f in functions)
        trace = trace_of(item)
        return Behaviour(name, functions, end, errors, item.title, trace, at.key, is_complete)

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
            call = self._generics.called("function", where, used.function, scope)
            # Calls with equal arguments are one function.
            return self._functions.get(call.name, call) if isinstance(call, Function) else None
        self._generics.report_bare("function", used.function, where)
        self._findings.use(found.place if found else None, at, "function")
        return found

    def _ending(
        self,
        kind: ConditionKind,
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

    def _states(self, mode_errors: Mapping[str, NamedErrors]) -> list[State]:
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
            modes = self.tree.path(name)
            around = [error for mode in modes for error in mode_errors[mode]]
            own = [e for e in behaviour.errors if not around or e[1].when != FALSE]
            behaviour = replace(behaviour, errors=(*around, *own))
            states.append(State(name, behaviour, item.title, trace, at.key, events, outputs, modes))
        self._check_names(states)
        return states

    def _check_names(self, states: Sequence[State]) -> None:
        """Report error conditions of one name in one state, each of them once."""
        reported: set[Condition] = set()
        for state in states:
            first: dict[str, Condition] = {}
            for name, condition in state.behaviour.errors:
                other = first.get(name)
                if other is None:
                    first[name] = condition
                elif name and condition.when != FALSE and condition not in reported:
                    reported.add(condition)
                    self._report_name(state, name, other, condition)

    def _report_name(self, state: State, name: str, other: Condition, condition: Condition) -> None:
        message = f"state `{state.name}` has two error conditions called `{name}`"
        place, related = condition.place, (Related(other.place, "the other one"),)
        help = "rows name them: rename one of them"
        if condition == other:
            message = f"state `{state.name}` has the error condition `{name}` twice"
            place, related = state.place, (Related(condition.place, "the error condition"),)
            help = "leave it to the outermost mode that has it"
        self._findings.report("E0205", message, place, related=related, help=help)

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
        found = self._generics.called("behaviour", at["behaviour"], text, self.scope)
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
            self._generics.report_bare("behaviour", name, at["behaviour"])
        return _lost_behaviour(name or state, at)

    def _transitions(self, memory: ModeMemory) -> tuple[Transition, ...]:
        table, conditions = self.where["transitions"], dict[int, tuple[Condition, bool]]()
        for index, item in enumerate(self.definition.transitions):
            at, when = table[index], item.when
            condition = self._conditions.get(("initial", when))
            is_remainder = when == OTHERWISE and condition is None
            if condition is None:
                condition = self._undeclared("initial", when, at["when"])
            else:
                self._findings.use(condition.place, at["when"])
            conditions[index] = condition, is_remainder
        rows = []
        for row in memory.table.rows:
            condition, is_remainder = conditions[row.index]
            trace = trace_of(self.definition.transitions[row.index])
            place = table[row.index].place
            is_return = bool(row.remembered) and NEVER_LEFT not in row.remembered
            rows.append(
                Transition(
                    row.source,
                    row.cause,
                    condition,
                    row.target,
                    trace,
                    place,
                    is_otherwise=is_remainder,
                    resumes=row.resumes,
                    is_return=is_return,
                    sets=memory.sets(row),
                    source_mode=row.source_mode,
                    target_mode=row.target_mode,
                )
            )
        remembered = [row.remembered for row in memory.table.rows]
        complete = zip(_with_remainders(rows), remembered, strict=True)
        return tuple([_where_left(row, states, memory) for row, states in complete])

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


def _where_left(row: Transition, states: frozenset[str], memory: ModeMemory) -> Transition:
    """A row that resumes a mode, where `left(mode)` is one of some states."""
    if not row.resumes:
        return row
    last = memory.last_state(row.resumes)
    test: Expr = IsOneOf(last, states, type=Bool())
    if len(states) == 1:
        test = Compare("==", last, Member(*states, type=last.type), type=Bool())
    when = junction("and", [row.condition.when, test])
    return replace(row, condition=replace(row.condition, when=when))


def _names(behaviour: Behaviour) -> dict[str, Place]:
    """The error conditions of a state by their names, "" for one without."""
    return {name: error.place for name, error in behaviour.errors if error.when != FALSE}


def _in_modes(state: State, memory: ModeMemory) -> State:
    """A state with the causes by which rows know its errors, and what it does for its modes."""
    behaviour, table = state.behaviour, memory.table
    causes = ((table.cause(state.name, name), error) for name, error in behaviour.errors)
    own = memory.function(state.name, state.place)
    functions = (*behaviour.functions, own) if own else behaviour.functions
    behaviour = replace(behaviour, errors=tuple(causes), functions=functions)
    return replace(state, behaviour=behaviour, for_modes=own)


def none_of(conditions: Sequence[Expr]) -> Expr:
    """The condition that none of these conditions holds."""
    return negation(junction("or", conditions))


_NO_PASSING = (
    "add elements to its device, or to both sides of its own, by the same names; a control "
    "subsystem has one side only, so write targets there"
)
_CAUSES = ("terminal", "error")
_OF_ONE = frozenset(("when", *Traced.keys))
"""Keys of an error condition that has no name."""
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
    errors = (("", _unknown_condition(name, "error", at["error"], at)),)
    return Behaviour(name, (), terminal, errors, "", Trace(), at.place, is_complete=False)


def _unknown_condition(name: str, kind: ConditionKind, where: YamlNode, at: YamlNode) -> Condition:
    """A condition, missing at `where`, of which nothing is known but its name."""
    return Condition(name, kind, unknown_at(where, Bool()), "", Trace(), at.place)
