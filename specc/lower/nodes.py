"""Python for single nodes of expressions over that of their operands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from specc.lang.builtins import FUNCTIONS
from specc.lang.row import Form
from specc.lang.signs import SIGNS
from specc.lower.module import Module, shared_name
from specc.lower.names import ConstantPlan, Namespace, comment, literal
from specc.lower.table import LARGEST, TermTable, TooLarge
from specc.lower.terms import Term
from specc.model import expr as e
from specc.model.system import Constant
from specc.model.types import (
    Enum,
    Int,
    ListOf,
    OptionalOf,
    Pose,
    Type,
    Vector,
    whole,
)

# Python for one node of an expression over the Python of its operands, with its rank.


CHOICE, OR, AND, NOT, COMPARE, SUM, PRODUCT, SIGN, POWER, PRIMARY, ATOM = range(11)
"""How tightly Python binds; an operand of lower rank than its place needs brackets."""
_RANKS = {"": CHOICE, "compare": COMPARE, "sum": SUM, "product": PRODUCT, "primary": PRIMARY}


@dataclass(frozen=True, slots=True)
class Spelled:
    """Python text of an expression and how tightly it binds."""

    text: str
    rank: int = ATOM

    def at(self, rank: int) -> str:
        """The text for a place that needs at least `rank`."""
        return self.text if self.rank >= rank else f"({self.text})"

    def __format__(self, binding: str) -> str:
        """The text for a place in a form, which says how tightly it has to bind."""
        return self.at(_RANKS[binding])


def number(value: float, type_: Type) -> Spelled:
    """A literal; reals get a point. Infinity has no literal in Python."""
    if not math.isfinite(value):
        return Spelled(f'float("{float(value)}")', PRIMARY)
    text = str(int(value)) if isinstance(type_, Int) else repr(float(value))
    return Spelled(text, SIGN if text.startswith("-") else ATOM)


def call(function: str, *args: Spelled) -> Spelled:
    """A call with its arguments."""
    return Spelled(f"{function}({', '.join(arg.text for arg in args)})", PRIMARY)


def sign(operand: Spelled) -> Spelled:
    """The negative; two signs never stand side by side."""
    rank = SIGN if operand.rank != SIGN else ATOM
    return Spelled(f"-{operand.at(rank)}", SIGN)


def negation(operand: Spelled) -> Spelled:
    """`not`."""
    return Spelled(f"not {operand.at(NOT)}", NOT)


def binary(op: str, left: Spelled, right: Spelled) -> Spelled:
    """Arithmetic between two operands."""
    if op == "**":
        return Spelled(f"{left.at(PRIMARY)} ** {right.at(SIGN)}", POWER)
    rank = _RANKS[SIGNS[op].binds]
    return Spelled(f"{left.at(rank)} {op} {right.at(rank + 1)}", rank)


def compare(op: str, left: Spelled, right: Spelled) -> Spelled:
    """One comparison, never a chain."""
    return Spelled(f"{left.at(SUM)} {op} {right.at(SUM)}", COMPARE)


def logic(op: str, operands: list[Spelled]) -> Spelled:
    """`and`/`or`; an `and` inside an `or` keeps its brackets, for the reader."""
    return Spelled(f" {op} ".join(o.at(NOT) for o in operands), AND if op == "and" else OR)


def choice(test: Spelled, then: Spelled, otherwise: Spelled) -> Spelled:
    """`then if test else otherwise`."""
    return Spelled(f"{then.at(OR)} if {test.at(OR)} else {otherwise.at(CHOICE)}", CHOICE)


def among(item: Spelled, members: frozenset[str], type_: Type, *, negated: bool) -> Spelled:
    """Whether an item is one of some members, which come in the order of their declaration."""
    order = type_.members if isinstance(type_, Enum) else ()
    names = [literal(member) for member in order if member in members]
    if not names:
        return Spelled(str(negated))
    if len(names) == 1:
        return compare("!=" if negated else "==", item, Spelled(names[0]))
    verb = "not in" if negated else "in"
    return Spelled(f"{item.at(SUM)} {verb} {{{', '.join(names)}}}", COMPARE)


def component(value: Spelled, index: int, of: Type) -> Spelled:
    """One component: a number of Python's, not one of numpy's."""
    end = f"[{index}]" if is_tuple(of) else f".item({index})"
    return Spelled(value.at(PRIMARY) + end, PRIMARY)


def is_tuple(type_: Type) -> bool:
    """Whether values are tuples: lists, and vectors of anything but reals."""
    return isinstance(type_, (Vector, ListOf)) and not type_.is_array


def items(operands: list[Spelled]) -> Spelled:
    """A tuple."""
    inside = ", ".join(o.text for o in operands)
    return Spelled(f"({inside},)" if len(operands) == 1 else f"({inside})")


# Python for single nodes of expressions over that of their operands; constants of a module.


class Nodes:
    """Spells terms for one method; `touched` has the buffers that it needs.

    `hoists`: literal arrays become constants of the module, settled ones attributes.
    """

    def __init__(self, module: Module, table: TermTable, *, hoists: bool = True) -> None:
        self.module = module
        self.table = table
        self.hoists = hoists
        self.names: Namespace = module.local_names()
        self.known: dict[Term, Spelled] = {}
        """Terms that need not be computed here, and what stands for them."""
        self.touched: set[str] = set()
        self.hint = ""
        """What a literal array would be called that is a constant of the module."""
        self.periods = "self._periods"
        self.is_settled = True
        """Whether memory that no function changes has its value for good."""
        self._visits = 0
        self._bound: dict[str, str] = {}
        """Variables of quantifiers and what they are called in Python."""

    def value(self, term: Term) -> Spelled:
        """Python for a term."""
        self._visits += 1
        if self._visits > LARGEST:
            raise TooLarge
        if term in self.known:
            return self.known[term]
        if self.hoists and term.type.is_array:
            if term.is_constant and not isinstance(term.node, e.ConstantRef):
                return Spelled(self.array(term))
            if term.is_settled and term.args and self.is_settled:
                return Spelled(self.settled(term), PRIMARY)
        match term.node:
            case e.Quantifier() as node:
                return self._quantifier(node, term)
            case e.Unary(op="not"):
                return self._negation(term.args[0])
        args = [self.value(arg) for arg in term.args]
        return _RULES[type(term.node)](self, term.node, args, term)

    def _quantifier(self, node: e.Quantifier, term: Term) -> Spelled:
        over, body = term.args
        match node.body:
            case e.Compare("==", e.BoundVariable(node.variable), e.Member() as member) if (
                node.kind == "any"
            ):
                return compare("in", Spelled(literal(member.name)), self.value(over))
        if node.kind in ("argmax", "argmin"):
            pairs = self.each(node, over, lambda item: f"({self.value(body).text}, {item})")
            return call(self.module.imports.own(node.kind), Spelled(pairs))
        return call(node.kind, Spelled(self.each(node, over, lambda _: self.value(body).text)))

    def each(self, node: e.Quantifier, over: Term, body: Callable[[str], str]) -> str:
        """A generator over items; `body` spells what it gives of one, by the name of the item.

        Items of an array are those of a list of Python's numbers.
        """
        items, outer = self.value(over), dict(self._bound)
        item = self._bound[node.variable] = self.names.inner().new(node.variable)
        text = body(item)
        self._bound = outer
        listed = "" if is_tuple(over.type) else ".tolist()"
        return f"{text} for {item} in {items.at(PRIMARY)}{listed}"

    def _negation(self, arg: Term) -> Spelled:
        if arg not in self.known:
            match arg.node:
                case e.Among(members=members):
                    item = arg.args[0]
                    return among(self.value(item), members, item.type, negated=True)
                case e.IsNone():
                    return compare("is not", self.value(arg.args[0]), Spelled("None"))
        return negation(self.value(arg))

    def constant(self, name: str) -> str:
        """A declared constant; it and those it needs are added to the module or its class."""
        own = self.module.constant_name(name)
        is_computed = name in self.module.computed
        if name not in self.module.constants:
            constant = self.module.declared(name)
            if name in self.module.given:
                self._receive(name, own, constant)
                return f"self._{own}"
            term = self.table.of(constant.value)
            self._define(name, own, term, constant.title, is_computed=is_computed)
        return f"self._{own}" if is_computed else own

    def _receive(self, name: str, own: str, constant: Constant) -> None:
        """An attribute for a parameter that the class is given."""
        type_ = constant.value.type
        self.module.constants[name] = ConstantPlan(
            name=own,
            annotation=self.module.annotations.of(type_),
            value=self.module.given[name],
            comment=comment(_unit(type_), constant.title),
            is_computed=True,
        )

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
        nodes = Nodes(self.module, self.table, hoists=False)
        nodes.touched = self.touched
        return [
            f"self.{name}: {self.module.annotations.of(term.type)} = {nodes.value(term).text}"
            for term, name in self.module.settled.items()
        ]

    def _input(self, node: e.Input | e.Fresh | e.Present | e.Lag) -> Spelled:
        self.touched.add("x")
        if isinstance(node, e.Input):
            return Spelled(self.module.input(node), PRIMARY)
        kind = node.name if isinstance(node, e.Lag) else type(node).__name__.lower()
        return Spelled(self.module.beside(kind, node.input), PRIMARY)

    def _memory(self, node: e.MemoryRef) -> Spelled:
        self.touched.add("memory")
        return Spelled(f"memory.{self.module.memory[node.name]}", PRIMARY)

    def _items(self, args: list[Spelled], term: Term) -> Spelled:
        if is_tuple(term.type):
            return items(args)
        return call(self.module.imports.own("vector"), *args)

    def _sure(self, args: list[Spelled], term: Term) -> Spelled:
        if isinstance(term.args[0].type, OptionalOf):
            return call(self.module.imports.own("some"), args[0])
        return args[0]

    def _clock(self, name: str) -> Spelled:
        if name == "period":
            return Spelled("PERIOD")
        if name == "entered":
            return Spelled(f"{self.periods} == 0", COMPARE)
        # A quotient of whole numbers is the decimal that the specification compares with, where a
        # multiple of the period may be off by a rounding error: 3 * 0.1 > 0.3.
        rate = self.module.rate_hz
        times = f" * {rate.denominator}" if rate.denominator > 1 else ""
        return Spelled(f"{self.periods}{times} / {rate.numerator}", PRODUCT)

    def _binary(self, node: e.Binary, args: list[Spelled]) -> Spelled:
        if node.op == "@":
            function = "moved" if isinstance(node.type, Vector) else "composed"
            return call(self.module.imports.own(function), *args)
        return binary(node.op, *args)

    def _builtin(self, name: str, args: list[Spelled], term: Term) -> Spelled:
        if name == e.FINITE and not term.args[0].overflows:
            return call(self.module.imports.own("read_only"), *args)
        function = FUNCTIONS[name]
        form = function.form(term.args[0].type) if args else ""
        if isinstance(form, Form):
            return Spelled(form.text.format(*args), _RANKS[form.binding])
        return call(self.module.imports.own(form or name) if function.python else name, *args)

    def _define(
        self, key: object, name: str, term: Term, title: str, *, is_computed: bool = False
    ) -> None:
        text = Nodes(self.module, self.table, hoists=False).value(term).text
        is_frozen = isinstance(term.node, (e.Items, e.ConstantRef)) or shared_name(term.node)
        if term.type.is_array and not is_frozen:
            text = f"{self.module.imports.own('read_only')}({text})"
        self.module.constants[key] = ConstantPlan(
            name=name,
            annotation=self.module.annotations.of(term.type) if is_computed else "",
            value=text,
            comment=comment("" if key == name else _unit(term.type), title),
            is_computed=is_computed,
        )


_Rule = Callable[[Nodes, Any, list[Spelled], Term], Spelled]
_RULES: dict[type[e.Node], _Rule] = {
    e.Number: lambda nodes, node, args, term: number(node.value, node.type),
    e.Truth: lambda nodes, node, args, term: Spelled(str(node.value)),
    e.TextLiteral: lambda nodes, node, args, term: Spelled(literal(node.value)),
    e.Member: lambda nodes, node, args, term: Spelled(literal(node.name)),
    e.Unused: lambda nodes, node, args, term: Spelled(nodes.module.imports.own("nan")),
    e.Nothing: lambda nodes, node, args, term: Spelled("None"),
    e.Input: lambda nodes, node, args, term: nodes._input(node),
    e.Fresh: lambda nodes, node, args, term: nodes._input(node),
    e.Present: lambda nodes, node, args, term: nodes._input(node),
    e.Lag: lambda nodes, node, args, term: nodes._input(node),
    e.MemoryRef: lambda nodes, node, args, term: nodes._memory(node),
    e.ConstantRef: lambda nodes, node, args, term: Spelled(nodes.constant(node.name), PRIMARY),
    e.FileRef: lambda nodes, node, args, term: Spelled(nodes.module.file(node.name), PRIMARY),
    e.BoundVariable: lambda nodes, node, args, term: Spelled(nodes._bound[node.name], PRIMARY),
    e.Clock: lambda nodes, node, args, term: nodes._clock(node.name),
    e.Call: lambda nodes, node, args, term: call(nodes.module.operator(node.operator), *args),
    e.Builtin: lambda nodes, node, args, term: nodes._builtin(node.name, args, term),
    e.Unary: lambda nodes, node, args, term: sign(args[0]),
    e.Binary: lambda nodes, node, args, term: nodes._binary(node, args),
    e.Compare: lambda nodes, node, args, term: compare(node.op, *args),
    e.IsNone: lambda nodes, node, args, term: compare("is", args[0], Spelled("None")),
    e.Sure: lambda nodes, node, args, term: nodes._sure(args, term),
    e.Among: lambda nodes, node, args, term: among(
        args[0], node.members, term.args[0].type, negated=False
    ),
    e.Logic: lambda nodes, node, args, term: logic(node.op, args),
    e.Choice: lambda nodes, node, args, term: choice(*args),
    e.Items: lambda nodes, node, args, term: nodes._items(args, term),
    e.FieldOf: lambda nodes, node, args, term: Spelled(
        f"{args[0].at(PRIMARY)}.{node.name}", PRIMARY
    ),
    e.Component: lambda nodes, node, args, term: component(args[0], node.index, term.args[0].type),
}
"""How a node over spelled operands is spelled; quantifiers and `not` look at theirs first."""


def _unit(type_: Type) -> str:
    if isinstance(type_, Pose):
        return str(type_)
    units = " and ".join(map(str, whole(type_).units))
    return "" if units == "1" else units
