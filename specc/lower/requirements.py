"""The requirements of a system to the plan of their module."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from specc.lang import show
from specc.lower.annotations import PythonTypes
from specc.lower.module import Module, buffer_names, memory_names
from specc.lower.names import (
    AttributePlan,
    FilePlan,
    MethodPlan,
    Namespace,
    comment,
    docstring,
    literal,
)
from specc.lower.nodes import OR, Emitter
from specc.lower.table import TermTable, term_table
from specc.model import expr as e
from specc.model.binding import PLANT
from specc.model.requirement import (
    Reading,
    Requirement,
    Temporal,
    TemporalFormula,
    TickCondition,
    antecedent,
)
from specc.model.system import Device, Element, System
from specc.model.trace import Trace
from specc.model.types import Int, Real
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


def requirements_plan(
    system: System, types: PythonTypes, tick_s: Fraction, *, triggers: bool
) -> FilePlan:
    """What the module of the requirements, or of the triggers, of a system contains."""
    required = system.triggers if triggers else system.requirements
    readings = {r.name: r for item in required for r in item.readings}
    # To expressions, what requirements read is as the memory of a device that reports all of it.
    elements = tuple(Element(r.name, r.type, None, "", Trace(), r.place) for r in readings.values())
    device = Device("", "", "real_receptor", "", (), elements, Trace(), Place(""))
    module = Module(system, device, types)
    module.memory = _attributes(readings)
    writer = _FormulaWriter(module, term_table(system, device, module.computed), tick_s)
    plans = tuple(writer.plan(item) for item in required)
    values = tuple(_value(module, reading) for reading in readings.values())
    module.imports.runtime_name("Reading")
    module.imports.runtime_name("Requirement")
    module.imports.runtime_name("Requirements")
    parts = {
        **(_TRIGGERS if triggers else _REQUIREMENTS),
        "values": values,
        "slots": literal(tuple(item.name for item in values)),
        "readings": tuple(_reading(system, module, reading) for reading in readings.values()),
        "requirements": plans,
        "atoms": writer.atoms,
        "methods": writer.methods,
        **module.plan_parts(),
    }
    return FilePlan("requirements.py.j2", parts)


def _attributes(readings: dict[str, Reading]) -> dict[str, str]:
    names = Namespace()
    return {name: names.new(name.replace("(", ".").rstrip(")")) for name in readings}


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
    atoms: list[tuple[str, str]] = field(default_factory=list)
    """Attribute of each atom, and the arguments that make it."""
    _atoms: dict[e.Expr, str] = field(default_factory=dict)
    """Of the conditions in one requirement, each once."""

    def plan(self, item: Requirement) -> RequirementPlan:
        """One requirement."""
        pairs = (f"{literal(r.name)}: {literal(self.module.memory[r.name])}" for r in item.readings)
        self._atoms = {}
        formula = self._formula(item.formula)
        premise = antecedent(item.formula)
        return RequirementPlan(
            literal(item.that),
            literal(item.because),
            formula,
            f"{{{', '.join(pairs)}}}",
            item.holds_always,
            literal(item.name) if item.name else "",
            "" if premise is None else self._formula(premise),
        )

    def _formula(self, formula: TemporalFormula) -> str:
        if isinstance(formula, TickCondition):
            if formula.that not in self._atoms:
                self._atoms[formula.that] = f"self.{self._atom(formula.that)}"
            return self._atoms[formula.that]
        name = self.module.imports.runtime_name(formula.op.capitalize())
        operands = [self._formula(operand) for operand in formula.operands]
        if isinstance(formula, Temporal) and formula.op != "since":
            operands.insert(0, str(formula.span_s // self.tick_s))
        return f"{name}({', '.join(operands)})"

    def _atom(self, that: e.Expr) -> str:
        """A method that judges a condition; returns the attribute with its atom."""
        number = len(self.methods) + 1
        judge = self.module.imports.runtime_name("judged")
        self.module.imports.runtime_name("Judgement")
        self.module.imports.runtime_name("Atom")
        nodes = Emitter(self.module, self.table)
        nodes.name_hint = f"atom_{number}"
        nodes.may_hoist = False  # there is no first period that would put arrays together
        texts = [nodes.emit(self.table.of(that)).text]
        if _compares(that):
            lazily = "" if isinstance(that, e.Compare) else "lambda: "
            texts.append(lazily + self._margin(nodes, that))
        lines = ["memory = self.values"] if "memory" in nodes.used_buffers else []
        lines.append(f"return {judge}({', '.join(texts)})")
        doc = docstring(show(that))
        self.methods.append(MethodPlan(f"_atom_{number}", (), "Judgement", doc, tuple(lines)))
        read = (n.name for n in e.walk(that) if isinstance(n, e.MemoryRef))
        names = [literal(self.module.memory[name]) for name in dict.fromkeys(read)]
        self.atoms.append((f"atom_{number}", ", ".join([f"self._atom_{number}", *names])))
        return f"atom_{number}"

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
