"""What a run watches: the requirements of a system, and how old values may be."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from specc.analysis.dataflow import Ages, InputNode
from specc.analysis.reads import live_names, nodes
from specc.lang import show
from specc.lower.module import Module, PythonTypes, buffer_names, live_slots, memory_names
from specc.lower.names import (
    AttributePlan,
    FilePlan,
    Imports,
    MethodPlan,
    Namespace,
    call,
    comment,
    docstring,
    keyword_arguments,
    literal,
)
from specc.lower.nodes import OR, Emitter
from specc.lower.terms import TermTable, term_table
from specc.model import expr as e
from specc.model.bindings import PLANT
from specc.model.expr import Lag
from specc.model.fsm import Trace
from specc.model.requirement import (
    Reading,
    Requirement,
    Stays,
    Temporal,
    TemporalFormula,
    TickCondition,
    antecedent,
    expressions_in,
)
from specc.model.system import Constant, Device, Element, Subsystem, System
from specc.model.types import Int, Real
from specc.reachable import grouped, reachable
from specc.source import Place

REQUIREMENTS, TRIGGERS = "SystemRequirements", "SystemTriggers"


_REQUIREMENTS = {
    "class_name": REQUIREMENTS,
    "what": "what is required of every run",
    "about": "What every run is watched for",
    "readers": "the requirements",
}
_TRIGGERS = {
    "class_name": TRIGGERS,
    "what": "what disturbances wait for",
    "about": "What disturbances wait for",
    "readers": "the conditions",
}


@dataclass(frozen=True, slots=True)
class RequirementPlan:
    """One requirement: Python texts of what is said of it and of its formula."""

    that: str
    because: str
    formula: str
    reads: str
    holds_always: bool
    name: str
    trigger: str
    """Of when it asks something of a run; empty where it does at every tick."""
    contract: str
    """What it is called as the contract of a device."""


def requirements_plan(
    system: System, types: PythonTypes, tick_s: Fraction, *, triggers: bool
) -> FilePlan:
    """What the module of the requirements, or of the triggers, of a system contains."""
    required = system.triggers if triggers else system.run_requirements
    readings = {r.name: r for item in required for r in item.readings}
    # To expressions, what requirements read is as the memory of a device that reports all of it.
    elements = tuple(Element(r.name, r.type, None, "", Trace(), r.place) for r in readings.values())
    device = Device("", "", "real_receptor", "", (), elements, Trace(), Place(""))
    module = Module(system, device, types)
    names = Namespace()
    module.memory = {name: names.new(name.replace("(", ".").rstrip(")")) for name in readings}
    shown = dict(_shown_constants(system, required, names))
    module.live = {name: f"memory.{each.attribute}" for name, each in shown.items()}
    writer = _FormulaWriter(module, term_table(system, device, module.computed), tick_s)
    plans = tuple(writer.plan(item) for item in required)
    values = tuple(_value(module, reading) for reading in readings.values())
    values += tuple(
        AttributePlan(
            each.attribute,
            module.annotations.of(each.constant.value.type),
            comment(f"{name}: {each.constant.value.type}"),
        )
        for name, each in shown.items()
    )
    module.imports.runtime_name("Reading")
    module.imports.runtime_name("Requirement")
    module.imports.runtime_name("Requirements")
    parts = {
        **(_TRIGGERS if triggers else _REQUIREMENTS),
        "values": values,
        "slots": literal(tuple(item.name for item in values)),
        "readings": (
            *(_reading(system, module, reading) for reading in readings.values()),
            *(each.reading for each in shown.values()),
        ),
        "requirements": plans,
        "atoms": writer.atoms,
        "methods": writer.methods,
        **module.plan_parts(),
    }
    return FilePlan("requirements.py.j2", parts)


@dataclass(frozen=True, slots=True)
class _ShownConstant:
    """A constant that may change, as formulas read it, and the reading."""

    constant: Constant
    attribute: str
    reading: str


def _shown_constants(
    system: System, required: Iterable[Requirement], names: Namespace
) -> Iterator[tuple[str, _ShownConstant]]:
    """The constants that may change in formulas: each as its fastest reader reads it."""
    parts = (part for item in required for part in expressions_in(item.formula))
    shared = {constant.name: constant.value for constant in system.constants}
    named = live_names((node for part in parts for node in e.walk(part)), shared)
    fastest = sorted(system.subsystems, key=lambda subsystem: -subsystem.rate_hz)
    slots = [(subsystem, live_slots(system, subsystem)) for subsystem in fastest if named]
    for name in sorted(named):
        subsystem, slot = next((s, known[name]) for s, known in slots if name in known)
        attribute = names.new(slot.attribute)
        words = attribute, subsystem.qualified_name, "reported", slot.attribute
        reading = f"Reading({', '.join(map(literal, words))})"
        yield name, _ShownConstant(slot.constant, attribute, reading)


def _value(module: Module, reading: Reading) -> AttributePlan:
    annotation = "str" if reading.kind == "state" else module.annotations.of(reading.type)
    text = reading.name if reading.kind == "state" else f"{reading.name}: {reading.type}"
    return AttributePlan(module.memory[reading.name], annotation, comment(text))


def _reading(system: System, module: Module, reading: Reading) -> str:
    """A call of `Reading`."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    words = [module.memory[reading.name], reading.subsystem or PLANT, reading.kind]
    if reading.kind == "observed":
        words.append(f"{PLANT}.{reading.element[0]}")
    elif reading.kind == "memory":
        words.append(memory_names(subsystems[reading.subsystem])[reading.element[0]])
    elif reading.kind != "state":
        owner = subsystems[reading.subsystem]
        ends = owner.outputs if reading.kind == "sent" else owner.inputs
        peer, element = reading.element
        words.append(buffer_names(ends)[peer, element])
    arguments = [literal(text) for text in words]
    if reading.initial:
        reader, peer, element = reading.initial
        attribute = buffer_names(subsystems[reader].inputs)[peer, element]
        arguments.append(f"initial={literal((reader, attribute))}")
    if reading.asks_presence:
        arguments.append("asks_presence=True")
    return f"Reading({', '.join(arguments)})"


@dataclass(eq=False, slots=True)
class _FormulaWriter:
    """Writes formulas, with a method for each of their atoms."""

    module: Module
    table: TermTable
    tick_s: Fraction
    methods: list[MethodPlan] = field(default_factory=list)
    atoms: list[tuple[str, str, str]] = field(default_factory=list)
    """Attribute of each atom, its class, and the arguments that make it."""
    _atoms: dict[e.Expr, str] = field(default_factory=dict)
    """Of the conditions in one requirement, each once."""
    _watched: dict[e.Expr, str] = field(default_factory=dict)
    """Of the values in one requirement of which changes are asked, each once."""

    def plan(self, item: Requirement) -> RequirementPlan:
        """One requirement."""
        pairs = [f"{literal(r.name)}: {literal(self.module.memory[r.name])}" for r in item.readings]
        parts = (node for part in expressions_in(item.formula) for node in e.walk(part))
        pairs += [f"{literal(name)}: {literal(self._slot(name))}" for name in self._live(parts)]
        self._atoms, self._watched = {}, {}
        formula = self._formula(item.formula)
        premise = antecedent(item.formula)
        return RequirementPlan(
            literal(item.that),
            literal(item.because),
            formula,
            f"{{{', '.join(pairs)}}}",
            item.holds_always,
            literal(item.name) if item.name and not item.device else "",
            "" if premise is None else self._formula(premise),
            literal(item.name) if item.device else "",
        )

    def _formula(self, formula: TemporalFormula) -> str:
        if isinstance(formula, TickCondition):
            if formula.that not in self._atoms:
                self._atoms[formula.that] = f"self.{self._atom(formula.that)}"
            return self._atoms[formula.that]
        if isinstance(formula, Stays):
            stays = self.module.imports.runtime_name("Stays")
            if formula.value not in self._watched:
                self._watched[formula.value] = f"self.{self._value(formula.value)}"
            return f"{stays}({formula.span_s // self.tick_s}, {self._watched[formula.value]})"
        name = self.module.imports.runtime_name(formula.op.capitalize())
        operands = [self._formula(operand) for operand in formula.operands]
        if isinstance(formula, Temporal) and formula.op != "since":
            operands.insert(0, str(formula.span_s // self.tick_s))
        return f"{name}({', '.join(operands)})"

    def _atom(self, that: e.Expr) -> str:
        """Write a method that judges a condition; returns the attribute with its atom."""
        judge = self.module.imports.runtime_name("judged")
        self.module.imports.runtime_name("Judgement")
        atom = self.module.imports.runtime_name("Atom")
        nodes, name = self._emitter("atom")
        texts = [nodes.emit(self.table.of(that)).text]
        if _compares(that):
            lazily = "" if isinstance(that, e.Compare) else "lambda: "
            texts.append(lazily + self._margin(nodes, that))
        value = f"{judge}({', '.join(texts)})"
        self.atoms.append((name, atom, self._method(nodes, name, that, value, "Judgement")))
        return name

    def _value(self, value: e.Expr) -> str:
        """Write a method that computes a value; returns the attribute that watches it."""
        watched = self.module.imports.runtime_name("Watched")
        nodes, name = self._emitter("value")
        text, result = nodes.emit(self.table.of(value)).text, self.module.annotations.of(value.type)
        self.atoms.append((name, watched, self._method(nodes, name, value, text, result)))
        return name

    def _emitter(self, what: str) -> tuple[Emitter, str]:
        name = f"{what}_{len(self.methods) + 1}"
        nodes = Emitter(self.module, self.table)
        nodes.name_hint = name
        nodes.may_hoist = False  # there is no first period that would put arrays together
        return nodes, name

    def _method(self, nodes: Emitter, name: str, expr: e.Expr, text: str, result: str) -> str:
        """Write a method; returns it and the attributes that it reads, as arguments."""
        lines = ["memory = self.values"] if "memory" in nodes.used_buffers else []
        lines.append(f"return {text}")
        self.methods.append(MethodPlan(f"_{name}", (), result, docstring(show(expr)), tuple(lines)))
        read = (n.name for n in e.walk(expr) if isinstance(n, e.MemoryRef))
        names = [literal(self.module.memory[name]) for name in dict.fromkeys(read)]
        names += [literal(self._slot(name)) for name in self._live(e.walk(expr))]
        return ", ".join([f"self._{name}", *names])

    def _live(self, nodes: Iterable[e.Expr]) -> list[str]:
        """The constants that may change among nodes of expressions."""
        constants = {constant.name: constant.value for constant in self.module.declared.values()}
        return sorted(live_names(nodes, constants))

    def _slot(self, constant: str) -> str:
        return self.module.live[constant].removeprefix("memory.")

    def _margin(self, nodes: Emitter, that: e.Expr) -> str:
        """Python for how far a condition is from failing; infinity where it compares no numbers."""
        match that if _compares(that) else None:
            case e.Compare(op, left, right):
                sides = (right, left) if op in ("<", "<=") else (left, right)
                return nodes.emit(self.table.of(e.Binary("-", *sides, type=left.type))).text
            case e.Unary(operand=operand):
                return f"-({self._margin(nodes, operand)})"
            case e.Logic(op, operands):
                parts = (self._margin(nodes, operand) for operand in operands)
                return f"{_PICKS[op]}({', '.join(parts)})"
            case e.Quantifier(kind, _, over, body) as node:
                each = nodes.generator(
                    node, self.table.of(over), lambda _: self._margin(nodes, body)
                )
                of_none = ("-" if kind == "any" else "") + self.module.imports.runtime_name("inf")
                return f"{_PICKS[kind]}(({each}), default={of_none})"
        inf = self.module.imports.runtime_name("inf")
        return f"{inf} if {nodes.emit(self.table.of(that)).bracketed(OR)} else -{inf}"


_PICKS = {"and": "min", "all": "min", "or": "max", "any": "max"}
"""A margin is the least of those that all have to hold, the largest of those of which one has."""


def _compares(that: e.Expr) -> bool:
    """Whether a condition is about how two numbers compare, one at least."""
    match that:
        case e.Compare("<" | "<=" | ">" | ">=", left):
            return isinstance(left.type, Real | Int)
        case e.Unary("not", operand) | e.Quantifier("all" | "any", _, _, operand):
            return _compares(operand)
        case e.Logic(_, operands):
            return any(map(_compares, operands))
    return False


def ages_plan(system: System, ages: Ages, imports: Imports) -> dict[str, tuple[str, ...]]:
    """The calls of `Behind`, `MaxAge` and `MaxCommandAge`; empty if no age is limited."""
    limits = list(_limits(system, ages, imports))
    commands = list(_commands(system, ages, imports))
    inputs = {
        InputNode(subsystem.qualified_name, part.input.peer, part.input.element)
        for subsystem in system.subsystems
        for part in nodes(subsystem)
        if isinstance(part, Lag) and part.name == "age"
    }
    inputs.update(node for node, _ in (*limits, *commands))
    found = {
        "behind": tuple(_age_sources(system, ages, inputs, imports)),
        "limits": tuple(text for _, text in limits),
        "commands": tuple(text for _, text in commands),
    }
    if not any(found.values()):
        return {}
    imports.runtime_name("AgeRules")
    return found


def _limits(system: System, ages: Ages, imports: Imports) -> Iterator[tuple[InputNode, str]]:
    """The inputs whose age is limited, and whose source is known."""
    for subsystem in system.subsystems:
        for (peer, name), element in subsystem.inputs.items():
            node = InputNode(subsystem.qualified_name, peer, name)
            if element.max_age_s is not None and ages.oldest(node) is not None:
                arguments = tuple(_limit(subsystem, node, element, ages))
                if arguments:
                    yield node, call(imports.runtime_name("MaxAge"), arguments)


def _limit(subsystem: Subsystem, node: InputNode, element: Element, ages: Ages) -> Iterator[str]:
    """Arguments of `MaxAge`; nothing for an input that is not read."""
    reads = ages.sources.reads_of(node.reader)
    states = reads.reachable_states if reads else []
    name = node.peer, node.element
    in_conditions = tuple(
        s.name for s in states if reads and name in {r.input for r in reads.read_by_conditions(s)}
    )
    in_functions = tuple(
        s.name for s in states if reads and name in {r.input for r in reads.read_by_functions(s)}
    )
    if not in_conditions and not in_functions:
        return
    assert element.max_age_s is not None  # callers looked
    yield literal(node.reader)
    yield literal(buffer_names(subsystem.inputs)[name])
    yield literal(f"x.{node.peer}.{node.element}")
    yield literal(float(element.max_age_s))
    fresh, computed = ages.sources.only_on_arrival(node), not ages.is_measured(node)
    yield from keyword_arguments(
        {"asked": in_conditions, "used": in_functions, "fresh": fresh, "computed": computed}
    )


def _commands(system: System, ages: Ages, imports: Imports) -> Iterator[tuple[InputNode, str]]:
    """The commands whose age a device limits."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    for device in system.devices:
        for element in device.x:
            node = InputNode(device.qualified_name, "", element.name)
            sent = ages.sources.sender(node)
            if element.max_age_s is None or sent is None or ages.oldest(node) is None:
                continue
            command = literal(sent[0]), literal(buffer_names(subsystems[sent[0]].outputs)[sent[1]])
            limit = literal(float(element.max_age_s)), literal(node.short)
            computed = keyword_arguments({"computed": not ages.is_measured(node)})
            yield node, call(imports.runtime_name("MaxCommandAge"), (*command, *limit, *computed))


def _age_sources(
    system: System, ages: Ages, inputs: Iterable[InputNode], imports: Imports
) -> Iterator[str]:
    """What outputs are computed from that values with an age come from, directly or not."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    known = {node: ages.reads_by_state(node) for node in inputs}

    def sources(node: InputNode) -> Iterator[InputNode]:
        known.setdefault(node, ages.reads_by_state(node))
        return (one for each in known[node].values() for one, _ in each)

    found: list[tuple[str, str, str]] = []
    for node in reachable(sorted(known), sources):
        sent = ages.sources.sender(node)
        if not known[node] or sent is None:
            continue
        sender = subsystems[sent[0]]
        output = buffer_names(sender.outputs)[sent[1]]
        names = buffer_names(sender.inputs)
        # States in which the same is read come together.
        groups = grouped((tuple(edges), state) for state, edges in known[node].items() if edges)
        for edges, states in groups.items():
            arguments = [literal(sender.qualified_name), literal(output), literal(tuple(states))]
            retained, fresh = (
                tuple(names[n.peer, n.element] for n, is_fresh in edges if is_fresh is wanted)
                for wanted in (False, True)
            )
            computed = not ages.is_measured(node)
            arguments += keyword_arguments({"held": retained, "fresh": fresh, "computed": computed})
            behind = call(imports.runtime_name("Behind"), arguments)
            found.append((sender.qualified_name, output, behind))
    yield from (text for _, _, text in sorted(found))
