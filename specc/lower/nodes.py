"""Python for single nodes of expressions over that of their operands."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from specc.lang.builtins import FUNCTIONS
from specc.lang.functions import Form
from specc.lang.values import SIGNS
from specc.lower.module import Module, literal_name
from specc.lower.names import ConstantPlan, Namespace, comment, literal
from specc.lower.terms import MAX_TERMS, Term, TermTable, TooLarge
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
    complete_type,
)

# Python for one node of an expression over the Python of its operands, with its rank.


CHOICE, OR, AND, NOT, COMPARE, SUM, PRODUCT, SIGN, POWER, PRIMARY, ATOM = range(11)
"""How tightly Python binds; an operand of lower rank than its place needs brackets."""
_RANKS = {"": CHOICE, "compare": COMPARE, "sum": SUM, "product": PRODUCT, "primary": PRIMARY}


@dataclass(frozen=True, slots=True)
class Emitted:
    """Python text of an expression and how tightly it binds."""

    text: str
    rank: int = ATOM

    def bracketed(self, rank: int) -> str:
        """The text for a place that needs at least `rank`."""
        return self.text if self.rank >= rank else f"({self.text})"

    def __format__(self, binding: str) -> str:
        """The text for a place in a form, which says how tightly it has to bind."""
        return self.bracketed(_RANKS[binding])


def number(value: float, type_: Type) -> Emitted:
    """Emit a literal; reals get a point. Infinity has no literal in Python."""
    if not math.isfinite(value):
        return Emitted(f'float("{float(value)}")', PRIMARY)
    text = str(int(value)) if isinstance(type_, Int) else repr(float(value))
    return Emitted(text, SIGN if text.startswith("-") else ATOM)


def call(function: str, *args: Emitted) -> Emitted:
    """Emit a call with its arguments."""
    return Emitted(f"{function}({', '.join(arg.text for arg in args)})", PRIMARY)


def sign(operand: Emitted) -> Emitted:
    """Emit a negative; two signs never stand side by side."""
    rank = SIGN if operand.rank != SIGN else ATOM
    return Emitted(f"-{operand.bracketed(rank)}", SIGN)


def negation(operand: Emitted) -> Emitted:
    """Emit `not`."""
    return Emitted(f"not {operand.bracketed(NOT)}", NOT)


def binary(op: str, left: Emitted, right: Emitted) -> Emitted:
    """Emit arithmetic between two operands."""
    if op == "**":
        return Emitted(f"{left.bracketed(PRIMARY)} ** {right.bracketed(SIGN)}", POWER)
    rank = _RANKS[SIGNS[op].binds]
    return Emitted(f"{left.bracketed(rank)} {op} {right.bracketed(rank + 1)}", rank)


def compare(op: str, left: Emitted, right: Emitted) -> Emitted:
    """Emit one comparison, never a chain."""
    return Emitted(f"{left.bracketed(SUM)} {op} {right.bracketed(SUM)}", COMPARE)


def logic(op: str, operands: list[Emitted]) -> Emitted:
    """Emit `and` or `or`; an `and` inside an `or` keeps its brackets, for the reader."""
    return Emitted(f" {op} ".join(o.bracketed(NOT) for o in operands), AND if op == "and" else OR)


def choice(test: Emitted, then: Emitted, otherwise: Emitted) -> Emitted:
    """Emit `then if test else otherwise`."""
    return Emitted(
        f"{then.bracketed(OR)} if {test.bracketed(OR)} else {otherwise.bracketed(CHOICE)}", CHOICE
    )


def member_test(item: Emitted, members: frozenset[str], type_: Type, *, negated: bool) -> Emitted:
    """Emit a test for membership; members come in the order of their declaration."""
    order = type_.members if isinstance(type_, Enum) else ()
    names = [literal(member) for member in order if member in members]
    if not names:
        return Emitted(str(negated))
    if len(names) == 1:
        return compare("!=" if negated else "==", item, Emitted(names[0]))
    verb = "not in" if negated else "in"
    return Emitted(f"{item.bracketed(SUM)} {verb} {{{', '.join(names)}}}", COMPARE)


def component(value: Emitted, index: int, of: Type) -> Emitted:
    """Emit one component: a number of Python's, not one of numpy's."""
    end = f"[{index}]" if is_tuple(of) else f".item({index})"
    return Emitted(value.bracketed(PRIMARY) + end, PRIMARY)


def is_tuple(type_: Type) -> bool:
    """Whether values are tuples: lists, and vectors of anything but reals."""
    return isinstance(type_, (Vector, ListOf)) and not type_.is_array


def items(operands: list[Emitted]) -> Emitted:
    """Emit a tuple."""
    inside = ", ".join(o.text for o in operands)
    return Emitted(f"({inside},)" if len(operands) == 1 else f"({inside})")


# Python for single nodes of expressions over that of their operands; constants of a module.


class Emitter:
    """Writes terms for one method; `used_buffers` are those that it needs.

    `hoists`: literal arrays become constants of the module, invariant ones attributes.
    """

    def __init__(self, module: Module, table: TermTable, *, hoists: bool = True) -> None:
        self.module = module
        self.table = table
        self.hoists = hoists
        self.names: Namespace = module.names.inner()
        self.known: dict[Term, Emitted] = {}
        """Terms that need not be computed here, and what stands for them."""
        self.used_buffers: set[str] = set()
        self.name_hint = ""
        """What a literal array would be called that is a constant of the module."""
        self.periods = "self._periods"
        self.may_hoist = True
        """Whether memory that no function changes has its value for good."""
        self._visits = 0
        self._bound: dict[str, str] = {}
        """Variables of quantifiers and what they are called in Python."""

    def emit(self, term: Term) -> Emitted:
        """Emit Python for a term."""
        self._visits += 1
        if self._visits > MAX_TERMS:
            raise TooLarge
        if term in self.known:
            return self.known[term]
        if self.hoists and term.type.is_array:
            if term.is_constant and not isinstance(term.node, e.ConstantRef):
                return Emitted(self.array(term))
            if term.is_invariant and term.args and self.may_hoist:
                hoisted = self.module.hoisted
                if term not in hoisted:
                    part = f"_{term.node.name}" if isinstance(term.node, e.Builtin) else ""
                    hoisted[term] = f"_{self.module.attributes.new(self.name_hint + part)}"
                return Emitted(f"self.{hoisted[term]}", PRIMARY)
        match term.node:
            case e.Quantifier() as node:
                return self._quantifier(node, term)
            case e.Unary(op="not"):
                return self._negation(term.args[0])
        if not term.args:
            return self._leaf(term.node)
        return self._operation(term, [self.emit(arg) for arg in term.args])

    def _quantifier(self, node: e.Quantifier, term: Term) -> Emitted:
        over, body = term.args
        match node.body:
            case e.Compare("==", e.BoundVariable(node.variable), e.Member() as member) if (
                node.kind == "any"
            ):
                return compare("in", Emitted(literal(member.name)), self.emit(over))
        if node.kind in ("argmax", "argmin"):
            pairs = self.generator(node, over, lambda item: f"({self.emit(body).text}, {item})")
            return call(self.module.imports.runtime_name(node.kind), Emitted(pairs))
        return call(node.kind, Emitted(self.generator(node, over, lambda _: self.emit(body).text)))

    def generator(self, node: e.Quantifier, over: Term, body: Callable[[str], str]) -> str:
        """A generator over items; `body` spells what it gives of one, by the name of the item.

        Items of an array are those of a list of Python's numbers.
        """
        items, outer = self.emit(over), dict(self._bound)
        item = self._bound[node.variable] = self.names.inner().new(node.variable)
        text = body(item)
        self._bound = outer
        listed = "" if is_tuple(over.type) else ".tolist()"
        return f"{text} for {item} in {items.bracketed(PRIMARY)}{listed}"

    def _negation(self, arg: Term) -> Emitted:
        if arg not in self.known:
            match arg.node:
                case e.IsOneOf(members=members):
                    item = arg.args[0]
                    return member_test(self.emit(item), members, item.type, negated=True)
                case e.IsNone():
                    return compare("is not", self.emit(arg.args[0]), Emitted("None"))
        return negation(self.emit(arg))

    def constant(self, name: str) -> str:
        """A declared constant; it and those it needs are added to the module or its class."""
        own = self.module.constant_names[name]
        is_computed = name in self.module.computed
        if name not in self.module.constants:
            constant = self.module.declared[name]
            if name in self.module.parameters:
                self._add_parameter(name, own, constant)
                return f"self._{own}"
            term = self.table.of(constant.value)
            self._add_constant(name, own, term, constant.title, is_computed=is_computed)
        return f"self._{own}" if is_computed else own

    def _add_parameter(self, name: str, own: str, constant: Constant) -> None:
        """An attribute for a parameter that the class is given."""
        type_ = constant.value.type
        self.module.constants[name] = ConstantPlan(
            name=own,
            annotation=self.module.annotations.of(type_),
            value=self.module.parameters[name],
            comment=comment(_unit(type_), constant.title),
            is_computed=True,
        )

    def array(self, term: Term) -> str:
        """A constant for a literal array."""
        shared = literal_name(term.node)
        key = shared or term
        if key not in self.module.constants:
            name = self.module.names.new(shared or self.name_hint.upper())
            self._add_constant(key, name, term, "")
        return self.module.constants[key].name

    def hoisted_assignments(self) -> list[str]:
        """Statements that give those attributes their value."""
        nodes = Emitter(self.module, self.table, hoists=False)
        nodes.used_buffers = self.used_buffers
        return [
            f"self.{name}: {self.module.annotations.of(term.type)} = {nodes.emit(term).text}"
            for term, name in self.module.hoisted.items()
        ]

    def _leaf(self, node: e.Expr) -> Emitted:
        match node:
            case e.Number():
                return number(node.value, node.type)
            case e.Truth() | e.Nothing():
                return Emitted(str(node.value) if isinstance(node, e.Truth) else "None")
            case e.TextLiteral(value=text) | e.Member(name=text):
                return Emitted(literal(text))
            case e.Unused():
                return Emitted(self.module.imports.runtime_name("nan"))
            case e.Clock(name=name):
                return self._clock(name)
            case e.Input():
                self.used_buffers.add("x")
                text = self.module.input(node)
            case e.Fresh() | e.Present() | e.Lag():
                self.used_buffers.add("x")
                kind = node.name if isinstance(node, e.Lag) else type(node).__name__.lower()
                text = self.module.input_property(kind, node.input)
            case e.MemoryRef(name=name):
                self.used_buffers.add("memory")
                text = f"memory.{self.module.memory[name]}"
            case e.ConstantRef(name=name):
                text = self.constant(name)
            case e.Live(name=name):
                text = self.module.live[name]
                self.used_buffers.add(text.partition(".")[0])
            case e.FileRef(name=name):
                text = self.module.file(name)
            case e.BoundVariable(name=name):
                text = self._bound[name]
            case _:
                return self._application(node, (), [])
        return Emitted(text, PRIMARY)

    def _operation(self, term: Term, args: list[Emitted]) -> Emitted:
        match term.node:
            case e.Unary():
                return sign(args[0])
            case e.Binary(op="@", type=type_):
                function = "moved" if isinstance(type_, Vector) else "composed"
                return call(self.module.imports.runtime_name(function), *args)
            case e.Binary(op=op):
                return binary(op, *args)
            case e.Compare(op=op):
                return compare(op, *args)
            case e.IsNone():
                return compare("is", args[0], Emitted("None"))
            case e.Unwrap(value=value):
                is_optional = isinstance(value.type, OptionalOf)
                some = self.module.imports.runtime_name("some") if is_optional else ""
                return call(some, args[0]) if some else args[0]
            case e.Logic(op=op):
                return logic(op, args)
            case e.Choice():
                return choice(*args)
        return self._application(term.node, term.args, args)

    def _application(self, node: e.Expr, terms: Sequence[Term], args: list[Emitted]) -> Emitted:
        """An operator, a function of the language, items, or a part of a value."""
        match node:
            case e.Items() if is_tuple(node.type):
                return items(args)
            case e.Items():
                return call(self.module.imports.runtime_name("vector"), *args)
            case e.Call(operator=operator):
                return call(self.module.operator(operator), *args)
            case e.IsOneOf(members=members):
                return member_test(args[0], members, terms[0].type, negated=False)
            case e.FieldOf(name=name):
                return Emitted(f"{args[0].bracketed(PRIMARY)}.{name}", PRIMARY)
            case e.Component(index=index):
                return component(args[0], index, terms[0].type)
            case e.Builtin(name=e.FINITE) if not terms[0].may_overflow:
                return call(self.module.imports.runtime_name("read_only"), *args)
        assert isinstance(node, e.Builtin)
        function = FUNCTIONS[node.name]
        form = function.form(terms[0].type) if args else ""
        if isinstance(form, Form):
            return Emitted(form.text.format(*args), _RANKS[form.binding])
        name = self.module.imports.runtime_name(form or node.name) if function.python else node.name
        return call(name, *args)

    def _clock(self, name: str) -> Emitted:
        if name == "period":
            return Emitted("PERIOD")
        if name == "entered":
            return Emitted(f"{self.periods} == 0", COMPARE)
        # A quotient of whole numbers is the decimal that the specification compares with, where a
        # multiple of the period may be off by a rounding error: 3 * 0.1 > 0.3.
        rate = self.module.rate_hz
        times = f" * {rate.denominator}" if rate.denominator > 1 else ""
        return Emitted(f"{self.periods}{times} / {rate.numerator}", PRODUCT)

    def _add_constant(
        self, key: object, name: str, term: Term, title: str, *, is_computed: bool = False
    ) -> None:
        text = Emitter(self.module, self.table, hoists=False).emit(term).text
        is_frozen = isinstance(term.node, (e.Items, e.ConstantRef)) or literal_name(term.node)
        if term.type.is_array and not is_frozen:
            text = f"{self.module.imports.runtime_name('read_only')}({text})"
        self.module.constants[key] = ConstantPlan(
            name=name,
            annotation=self.module.annotations.of(term.type) if is_computed else "",
            value=text,
            comment=comment("" if key == name else _unit(term.type), title),
            is_computed=is_computed,
        )


def _unit(type_: Type) -> str:
    if isinstance(type_, Pose):
        return str(type_)
    units = " and ".join(map(str, complete_type(type_).units))
    return "" if units == "1" else units
