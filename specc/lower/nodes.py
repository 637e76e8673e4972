"""Python for single nodes of expressions over that of their operands; constants of a module."""

from __future__ import annotations

from specc.lower import spelling as s
from specc.lower.constants import shared_name
from specc.lower.finite import is_array
from specc.lower.module import Module
from specc.lower.plan import ConstantPlan
from specc.lower.spelling import Spelled
from specc.lower.terms import Term, TermTable
from specc.lower.text import comment, literal
from specc.model import expr as e
from specc.model.types import OptionalOf, Pose, Real, Spatial, Type, Vector, whole

PYTHON_FUNCTIONS = ("abs", "float", "len", "max", "min")


class Nodes:
    """Spells nodes for one method; `touched` has the buffers that it needs."""

    def __init__(self, module: Module, table: TermTable) -> None:
        self.module = module
        self.table = table
        self.touched: set[str] = set()
        self.hint = ""
        """What a literal array would be called that is a constant of the module."""
        self.periods = "self._periods"
        self.is_settled = True
        """Whether memory that no function changes has its value for good."""
        self.bound: dict[str, str] = {}
        """Variables of quantifiers and what they are called in Python."""

    def spell(self, term: Term, args: list[Spelled]) -> Spelled:
        """Python for a node over its operands."""
        match term.node:
            case e.Quantifier(kind="argmax" | "argmin" as kind, variable=variable):
                spelled = s.pairs(self.bound[variable], args[0], args[1], term.args[0].type)
                return s.call(self.module.builtin(kind), spelled)
            case e.Logic() | e.Choice() | e.Quantifier() | e.Unary():
                return self._condition(term, args)
            case e.Among() | e.Compare() | e.IsNone():
                return self._condition(term, args)
            case e.Call(operator=operator):
                return s.call(self.module.operator(operator), *args)
            case e.Builtin(name=name):
                return self._builtin(name, term, args)
            case e.Binary(op=op):
                return s.binary(op, *args)
            case e.Items() | e.FieldOf() | e.Component() | e.Sure():
                return self._structure(term, args)
        return self._leaf(term.node)

    def constant(self, name: str) -> str:
        """A declared constant; it and those it needs are added to the module or its class."""
        own = self.module.constant_name(name)
        is_computed = name in self.module.computed
        if name not in self.module.constants:
            constant = self.module.declared(name)
            term = self.table.of(constant.value)
            self._define(name, own, term, constant.title, is_computed=is_computed)
        return f"self._{own}" if is_computed else own

    def array(self, term: Term) -> str:
        """A constant for a literal array."""
        shared = shared_name(term.node)
        key = shared or term
        if key not in self.module.constants:
            name = self.module.new(shared or self.hint.upper())
            self._define(key, name, term, "")
        return self.module.constants[key].name

    def settled(self, term: Term) -> str:
        """An attribute for an array that stays as it is once the first period is over."""
        if term not in self.module.settled:
            part = f"_{term.node.name}" if isinstance(term.node, e.Builtin) else ""
            self.module.settled[term] = f"_{self.module.attributes.new(self.hint + part)}"
        return f"self.{self.module.settled[term]}"

    def settling(self) -> list[str]:
        """Statements that give those attributes their value."""
        self.is_settled = False
        reason = ["# Put together once: no behaviour changes what these are made of."]
        return reason * bool(self.module.settled) + [
            f"self.{name}: {self.module.annotations.of(term.type)} = {self.whole(term).text}"
            for term, name in self.module.settled.items()
        ]

    def whole(self, term: Term) -> Spelled:
        """A term with all its operands, none of them kept in a local."""
        if isinstance(term.node, e.Quantifier):
            self.bound[term.node.variable] = self.module.local_names().new(term.node.variable)
        return self.spell(term, [self.whole(arg) for arg in term.args])

    def _condition(self, term: Term, args: list[Spelled]) -> Spelled:
        match term.node:
            case e.Logic(op=op):
                return s.logic(op, args)
            case e.Choice():
                return s.choice(*args)
            case e.Unary(op=op):
                return s.sign(args[0]) if op == "-" else s.negation(args[0])
            case e.Compare(op=op):
                return s.compare(op, *args)
            case e.IsNone():
                return s.compare("is", args[0], Spelled("None"))
            case e.Among(members=members):
                return s.among(args[0], members, term.args[0].type, negated=False)
            case e.Quantifier(kind=kind, variable=variable):
                over = term.args[0].type
                return s.quantifier(kind, self.bound[variable], args[0], args[1], over)
        raise TypeError(f"{term.node!r} is no condition")

    def _structure(self, term: Term, args: list[Spelled]) -> Spelled:
        match term.node:
            case e.FieldOf(name=name):
                return Spelled(f"{args[0].at(s.PRIMARY)}.{name}", s.PRIMARY)
            case e.Component(index=index):
                return s.component(args[0], index, term.args[0].type)
            case e.Sure() if isinstance(term.args[0].type, OptionalOf):
                return s.call(self.module.builtin("some"), args[0])
            case e.Sure():
                return args[0]
        if s.is_tuple(term.type):
            return s.items(args)
        return s.call(self.module.builtin("vector"), *args)

    def _leaf(self, node: e.Expr) -> Spelled:
        match node:
            case e.Number(value=value, type=type_):
                return s.number(value, type_)
            case e.Truth(value=truth):
                return Spelled(str(truth))
            case e.TextLiteral(value=text) | e.Member(name=text):
                return Spelled(literal(text))
            case e.Unused():
                return Spelled(self.module.imports.add("math", "nan"))
            case e.Nothing():
                return Spelled("None")
            case e.Clock(name=clock):
                return self._clock(clock)
        return Spelled(self._name(node), s.PRIMARY)

    def _name(self, node: e.Expr) -> str:
        match node:
            case e.Input() | e.Fresh() | e.Present():
                self.touched.add("x")
                return self._input(node)
            case e.MemoryRef(name=name):
                self.touched.add("memory")
                return f"memory.{self.module.memory[name]}"
            case e.ConstantRef(name=name):
                return self.constant(name)
            case e.FileRef(name=name):
                return self.module.file(name)
            case e.Bound(name=name):
                return self.bound[name]
        raise TypeError(f"no Python for {node!r}")

    def _input(self, node: e.Input | e.Fresh | e.Present) -> str:
        if isinstance(node, e.Input):
            return self.module.input(node)
        return self.module.flag("fresh" if isinstance(node, e.Fresh) else "present", node.input)

    def _clock(self, name: str) -> Spelled:
        if name == "period":
            return Spelled("PERIOD")
        if name == "entered":
            return Spelled(f"{self.periods} == 0", s.COMPARE)
        # A quotient of whole numbers is the decimal that the specification compares with, where a
        # multiple of the period may be off by a rounding error: 3 * 0.1 > 0.3.
        rate = self.module.rate_hz
        times = f" * {rate.denominator}" if rate.denominator > 1 else ""
        return Spelled(f"{self.periods}{times} / {rate.numerator}", s.PRODUCT)

    def _builtin(self, name: str, term: Term, args: list[Spelled]) -> Spelled:
        if name in PYTHON_FUNCTIONS:
            return s.call(name, *args)
        if name == "sqrt":
            return s.call(self.module.imports.add("math", "sqrt"), *args)
        if name == "near":
            kind = term.args[0].type
            if isinstance(kind, Pose):
                return s.call(self.module.builtin("near_pose"), *args)
            if not is_array(kind):
                distance = s.call("abs", s.binary("-", args[0], args[1]))
                return s.compare("<=", distance, args[2])
        return s.call(self.module.builtin(name), *args)

    def _define(
        self, key: object, name: str, term: Term, title: str, *, is_computed: bool = False
    ) -> None:
        text = Nodes(self.module, self.table).whole(term).text
        is_frozen = isinstance(term.node, (e.Items, e.ConstantRef)) or shared_name(term.node)
        if is_array(term.type) and not is_frozen:
            text = f"{self.module.builtin('read_only')}({text})"
        self.module.constants[key] = ConstantPlan(
            name=name,
            annotation=self.module.annotations.of(term.type) if is_computed else "",
            value=text,
            comment=comment("" if key == name else _unit(term.type), title),
            is_computed=is_computed,
        )


def _unit(type_: Type) -> str:
    match whole(type_):
        case Real(unit=unit) | Vector(element=Real(unit=unit)):
            return "" if str(unit) == "1" else str(unit)
        case Spatial(linear=linear, angular=angular):
            return f"{linear} and {angular}"
        case Pose():
            return str(type_)
    return ""
