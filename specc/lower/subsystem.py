"""The module of one subsystem, with equations traced, and of one device with safe outputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.lang import show
from specc.lower.cycle import Methods
from specc.lower.families import Family
from specc.lower.flow import Proofs
from specc.lower.module import Module, PythonTypes, live_slots
from specc.lower.names import (
    AttributePlan,
    ConstantPlan,
    FilePlan,
    MethodPlan,
    comment,
    docstring,
    in_docstring,
    literal,
)
from specc.lower.nodes import Emitter, number
from specc.lower.terms import TermTable, TooLarge, term_table
from specc.model import expr as e
from specc.model.fsm import Behaviour, Condition, State, Trace, Transition, mode_name
from specc.model.system import Device, Element, Memory, Subsystem, System
from specc.model.types import Type

# Equation numbers of what a step can execute, found once, for the report of a run.
#
# A number counts for the thing that carries it and for all that refers to that thing: through lets,
# memory, elements of buffers, types and operators.


EquationNumbers = frozenset[int]
NONE: EquationNumbers = frozenset()


class Equations:
    """Looks equation numbers up in one subsystem."""

    def __init__(self, system: System, subsystem: Subsystem) -> None:
        self._subsystem = subsystem
        self._operators = {o.name: _numbers_of(o.trace) for o in system.operators}
        self._declared = {named.name: _numbers_of(named.trace) for named in system.types}
        self._types: dict[Type, EquationNumbers] = {}
        self._inputs = {key: _numbers_of(item.trace) for key, item in subsystem.inputs.items()}
        self._outputs = {key: self._of_place(item) for key, item in subsystem.outputs.items()}
        self._memory = {item.name: self._of_place(item) for item in subsystem.memory}
        self._lets: dict[str, EquationNumbers] = {}
        for let in subsystem.lets:
            self._lets[let.name] = _numbers_of(let.trace) | self._of_expr(let.value)

    def tables(self) -> dict[str, object] | None:
        """The tables that a generated class carries; none if nothing has a number."""
        states = self._subsystem.states
        behaviours = [(s, self.of_state(s)) for s in states]
        checks = []
        for state in states:
            endings = ((cause, self.of_condition(c)) for cause, c in state.behaviour.endings)
            several = len(state.behaviour.errors) > 1  # their order matters
            shown = [(c, n) for c, n in endings if n or (several and c != "terminal")]
            if any(numbers for _, numbers in shown):
                checks.append((state, [f"{literal(c)}: {_tuple(n)}" for c, n in shown]))
        rows = [self.of_row(row) for row in self._subsystem.transitions]
        if not checks and not any(numbers for _, numbers in behaviours) and not any(rows):
            return None
        return {
            "behaviours": tuple((literal(s.name), _tuple(n)) for s, n in behaviours if n),
            "checks": tuple((literal(s.name), f"{{{', '.join(n)}}}") for s, n in checks),
            "rows": tuple(map(_tuple, rows)),
        }

    def of_state(self, state: State) -> EquationNumbers:
        """What a step executes that enters a state or stays in it."""
        return _numbers_of(state.trace) | self._of_behaviour(state.behaviour)

    def of_condition(self, condition: Condition) -> EquationNumbers:
        """What a step executes that asks a condition."""
        return _numbers_of(condition.trace) | self._of_expr(condition.when)

    def of_row(self, row: Transition) -> EquationNumbers:
        """What a step executes that tests a row."""
        return _numbers_of(row.trace) | self.of_condition(row.condition)

    def _of_behaviour(self, behaviour: Behaviour) -> EquationNumbers:
        numbers = _numbers_of(behaviour.trace).union(
            *(_numbers_of(f.trace) for f in behaviour.functions)
        )
        for item in behaviour.assignments:
            key = item.peer, item.name
            target = self._outputs.get(key) if item.peer else self._memory.get(item.name)
            numbers |= _numbers_of(item.trace) | self._of_expr(item.value) | (target or NONE)
        return numbers

    def _of_place(self, item: Element | Memory) -> EquationNumbers:
        return _numbers_of(item.trace) | self._of_type(item.type)

    def _of_expr(self, expr: e.Expr) -> EquationNumbers:
        found = set[int]()
        for node in e.walk(expr):
            found |= self._of_type(node.type)
            match node:
                case e.LetRef(name=name):
                    found |= self._lets[name]
                case e.Call(operator=operator):
                    found |= self._operators[operator]
                case e.MemoryRef(name=name):
                    found |= self._memory.get(name, NONE)
                case e.Input(key=key):
                    found |= self._inputs.get(key, NONE)
        return frozenset(found)

    def _of_type(self, type_: Type) -> EquationNumbers:
        if type_ not in self._types:
            numbers = self._declared.get(getattr(type_, "name", None) or "", NONE)
            self._types[type_] = numbers.union(*map(self._of_type, type_.parts))
        return self._types[type_]


def _numbers_of(trace: Trace) -> EquationNumbers:
    return frozenset(trace.eq)


def _tuple(numbers: EquationNumbers) -> str:
    return literal(tuple(sorted(numbers)))


# One subsystem to the plan of its module.


def subsystem_plan(
    system: System,
    subsystem: Subsystem,
    family: Family,
    types: PythonTypes,
    class_name: str,
    proofs: Proofs,
    *,
    stand_ins: bool = False,
) -> FilePlan:
    """What the module of a family contains, whose first member is the subsystem.

    Raises `TooLarge`.
    """
    try:
        module = Module(system, subsystem, types, stand_ins=stand_ins, parameters=family.parameters)
        parts = _parts(system, subsystem, proofs, module) | _family_parts(subsystem, family, module)
    except (TooLarge, RecursionError):
        raise TooLarge(subsystem.qualified_name) from None
    return FilePlan("subsystem.py.j2", {"class_name": class_name, **parts})


def _family_parts(part: Subsystem | Device, family: Family, module: Module) -> dict[str, object]:
    """Name and arguments of a class, and for whom it is."""
    types = {constant.name: constant.value.type for constant in part.constants}
    trace = f" ({part.trace})" if part.trace else ""
    return {
        "about": in_docstring(_part_phrase(part, family) + trace),
        "name": "" if family.is_shared else literal(part.qualified_name),
        "arguments": tuple(
            f"{argument}: {module.annotations.of(types[name])}"
            for name, argument in module.parameters.items()
        ),
    }


def _parts(
    system: System, subsystem: Subsystem, proofs: Proofs, module: Module
) -> dict[str, object]:
    table = term_table(system, subsystem, module.computed)
    methods = Methods(subsystem, module, table, proofs)
    written = methods.plans()
    initial_inputs = tuple(_initial_inputs(subsystem, module, table))
    inputs = tuple(_attribute(module, module.inputs[k], e) for k, e in subsystem.inputs.items())
    outputs = tuple(_attribute(module, module.outputs[k], e) for k, e in subsystem.outputs.items())
    memory = tuple(_attribute(module, module.memory[m.name], m) for m in subsystem.memory)
    flags, lags = (
        tuple(_property_attributes(module, kinds)) for kinds in (("fresh", "present"), e.LAGS)
    )
    changing = tuple(_live_attributes(system, subsystem, module))
    return {
        "title": in_docstring(subsystem.title or subsystem.name),
        "inputs": inputs,
        "inputs_slots": literal(
            tuple(item.name for part in (inputs, flags, lags, changing) for item in part)
        ),
        "flags": flags,
        "lags": lags,
        "live": changing,
        "outputs": outputs,
        "outputs_slots": _slots(outputs),
        "memory": memory,
        "memory_slots": _slots(memory),
        "doc": docstring(subsystem.title or subsystem.name, str(subsystem.trace)),
        "period_s": literal(float(1 / subsystem.rate_hz)),
        "rate": f"{subsystem.rate_hz} Hz",
        "initial_state": literal(subsystem.initial_state),
        "transitions": tuple(
            (", ".join(map(literal, _written_row(t))), comment(str(t.trace)))
            for t in subsystem.transitions
        ),
        "sends": tuple(_sent_elements(subsystem, module)),
        "equations": Equations(system, subsystem).tables(),
        "modes": tuple(
            (literal(s.name), literal(s.modes[::-1])) for s in subsystem.states if s.modes
        ),
        "timers": tuple(_timers(subsystem, module)),
        "axioms": tuple(literal(show(axiom.that)) for axiom in subsystem.axioms),
        "uses_clock": bool(methods.clocked),
        "initial_inputs": initial_inputs,
        "methods": written,
        **module.plan_parts(),
    }


_MOST_NAMED = 3


def _part_phrase(part: Subsystem | Device, family: Family) -> str:
    kind = "control subsystem" if part.kind == "control" else part.kind.replace("_", " ")
    if not family.is_shared:
        return f"{kind} {part.name} of agent {part.agent}"
    names = [member.qualified_name for member in family.instances]
    rest = len(names) - _MOST_NAMED
    return f"{kind} {', '.join(names[:_MOST_NAMED])}" + (f" and {rest} more" if rest > 0 else "")


def _attribute(module: Module, name: str, item: Element | Memory) -> AttributePlan:
    text = comment(str(item.type), item.title, str(item.trace))
    return AttributePlan(name, module.annotations.of(item.type), text)


_PROPERTIES = {
    "fresh": ("bool", ""),
    "present": ("bool", ""),
    "age": ("float", "s"),
    "late": ("int", "periods"),
}
"""Annotation and comment of what can be asked of an input beside its value."""


def _property_attributes(module: Module, kinds: Iterable[str]) -> Iterator[AttributePlan]:
    """Attributes for what is asked of inputs, in order of the buffer's elements."""
    for kind in kinds:
        for (peer, element), name in module.inputs.items():
            if (kind, peer, element) in module.input_properties:
                yield AttributePlan(f"{kind}_{name}", *_PROPERTIES[kind])


def _live_attributes(
    system: System, subsystem: Subsystem, module: Module
) -> Iterator[ConstantPlan]:
    """Attributes for constants that may change, with their values at the start."""
    for slot in live_slots(system, subsystem).values():
        constant = slot.constant
        assert constant.initial is not None  # it may change
        text = comment(str(constant.value.type), constant.title)
        annotation = module.annotations.of(constant.value.type)
        value = number(constant.initial.value, constant.initial.type).text
        yield ConstantPlan(slot.attribute, annotation, value, text, is_computed=False)


def _initial_inputs(subsystem: Subsystem, module: Module, table: TermTable) -> Iterator[str]:
    """Statements that give elements with an initial value that value."""
    for (peer, _), element in subsystem.inputs.items():
        if element.init is not None:
            nodes = Emitter(module, table)
            nodes.name_hint = f"initial_{element.name}"
            value = nodes.emit(table.of(element.init, element.type))
            name = module.inputs[peer, element.name]
            yield f"self.x.{name} = {value.text}"
            if ("present", peer, element.name) in module.input_properties:
                yield f"self.x.present_{name} = True"


def _sent_elements(subsystem: Subsystem, module: Module) -> Iterable[tuple[str, str]]:
    """State and the elements that its behaviour writes, in order of the buffer."""
    for state in subsystem.states:
        written = {(a.peer, a.name) for a in state.behaviour.assignments if a.peer}
        names = tuple(name for pair, name in module.outputs.items() if pair in written)
        yield literal(state.name), literal(names)


def _written_row(row: Transition) -> tuple[str, ...]:
    resumes = (row.resumes,) if row.resumes else ()
    return (row.source, row.cause, row.condition.name, row.target, *resumes)


def _timers(subsystem: Subsystem, module: Module) -> Iterable[tuple[str, str]]:
    """State and the memory elements that count the periods of its modes."""
    for state in subsystem.states:
        names = (mode_name("periods", mode) for mode in state.modes)
        counters = tuple(module.memory[name] for name in names if name in module.memory)
        if counters:
            yield literal(state.name), literal(counters)


def _slots(attributes: Iterable[AttributePlan]) -> str:
    return literal(tuple(item.name for item in attributes))


# The safe outputs of one device to the plan of their module.


def device_plan(
    system: System,
    device: Device,
    family: Family,
    types: PythonTypes,
    class_name: str,
    *,
    stand_ins: bool,
) -> FilePlan:
    """What the module of a family of devices with safe outputs contains."""
    module = Module(system, device, types, stand_ins=stand_ins, parameters=family.parameters)
    table = term_table(system, device, module.computed)
    methods = []
    for element, safe in device.safe:
        doc = docstring(f"What `{element.name}` gets when a run ends")
        methods.append(
            _safe_method(module, table, f"safe_{element.name}", element, safe.value, doc)
        )
        if safe.otherwise is not None:
            doc = docstring("The same if that fails")
            name = f"otherwise_{element.name}"
            methods.append(_safe_method(module, table, name, element, safe.otherwise, doc))
    samples = tuple(
        AttributePlan(module.memory[e.name], module.annotations.of(e.type), comment(str(e.type)))
        for e in device.y
    )
    parts = {
        "title": in_docstring(device.title or device.name),
        "class_name": class_name,
        "samples": samples,
        "samples_slots": _slots(samples),
        "elements": literal(tuple(element.name for element, _ in device.safe)),
        "silence": literal(float(device.silence_s)) if device.silence_s else "",
        "reports": tuple((literal(e.name), literal(module.memory[e.name])) for e in device.y),
        "methods": methods,
        **_family_parts(device, family, module),
        **module.plan_parts(),
    }
    return FilePlan("device.py.j2", parts)


def _safe_method(
    module: Module, table: TermTable, name: str, element: Element, value: e.Expr, doc: str
) -> MethodPlan:
    nodes = Emitter(module, table)
    nodes.name_hint = name
    annotation = module.annotations.of(element.type)
    returned = f"return {nodes.emit(table.of(value)).text}"
    lines = ("memory = self.memory", returned) if "memory" in nodes.used_buffers else (returned,)
    return MethodPlan(name, (), annotation, doc, lines)
