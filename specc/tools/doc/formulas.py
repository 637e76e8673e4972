"""Expressions and formulas about runs in the notation of the paper."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeGuard

from specc.lang.builtins import FUNCTIONS
from specc.lang.functions import Form
from specc.lang.notation import MathSymbol, symbol_of
from specc.lang.show import show
from specc.lang.values import SIGNS
from specc.model import expr as m
from specc.model.requirement import (
    BoolOp,
    Reading,
    Requirement,
    Temporal,
    TemporalFormula,
    TickCondition,
)
from specc.model.types import Enum, Int, Real
from specc.model.units import DIMENSIONLESS, Unit
from specc.tools.doc.markup import (
    EMPTY,
    Math,
    attached,
    bracketed,
    drawn,
    joined,
    linked,
    listed,
    root,
    sign,
    word,
)
from specc.tools.doc.symbols import (
    SubsystemNames,
    SystemNames,
    operator_symbol,
    symbol_for,
)

_CHOICE, _IMPLIES, _OR, _AND, _NOT, _COMPARISON, _SUM, _PRODUCT, _NEGATION, _POWER, _ATOM = range(
    11
)
_RANKS = {"sum": _SUM, "product": _PRODUCT, "power": _POWER}
_COMPARISONS = {"<": "<", "<=": "lt.eq", ">": ">", ">=": "gt.eq", "==": "=", "!=": "eq.not"}
_LONGEST_NUMBER, _DEEPEST = 14, 14
THIN = Math("thin", 0.3)
DASH = word("–", 1)


@dataclass
class FormulaWriter:
    """Writes expressions; `inlined` has the lets that are written out.

    `signs` are those that were used and that a legend has to explain.
    """

    names: SubsystemNames | None
    outer: SystemNames
    inlined: Mapping[str, m.Expr] = field(default_factory=dict)
    readings: Mapping[str, Reading] = field(default_factory=dict)
    signs: dict[str, None] = field(default_factory=dict)
    _depth: int = 0

    def math(self, expr: m.Expr) -> Math:
        """An expression."""
        return self._form(expr)[0]

    def within(self, expr: m.Expr, rank: int) -> Math:
        """An expression, in brackets if it binds less tightly than what is around it."""
        shown, own = self._form(expr)
        return shown if own >= rank else bracketed(shown)

    def operands(self, expr: m.Expr) -> tuple[str, list[Math]]:
        """The sign and the operands of a conjunction or disjunction; else the formula alone."""
        if isinstance(expr, m.Logic):
            return expr.op, list(map(self._operand, expr.operands))
        return "", [self.math(expr)]

    def _operand(self, expr: m.Expr) -> Math:
        """An operand of a conjunction or disjunction: all but predicates are in brackets."""
        shown, rank = self._form(expr)
        is_plain = rank == _ATOM or (rank == _NOT and isinstance(expr, m.Unary))
        return shown if is_plain else bracketed(shown)

    def _form(self, expr: m.Expr) -> tuple[Math, int]:
        """The formula, and how tightly its outermost sign binds."""
        while isinstance(expr, m.Unwrap) or self._is_inlined(expr):
            expr = expr.value if isinstance(expr, m.Unwrap) else self.inlined[expr.name]
        if self._depth >= _DEEPEST:  # Typst sets no deeper ones, and nobody would read them
            return word(show(expr)), _ATOM
        self._depth += 1
        try:
            if compound := _COMPOUND.get(type(expr)):
                return compound(self, expr)
            return _ATOMS[type(expr)](self, expr), _ATOM
        finally:
            self._depth -= 1

    def _is_inlined(self, expr: m.Expr) -> TypeGuard[m.LetRef]:
        return isinstance(expr, m.LetRef) and expr.name in self.inlined

    # Parts.

    def _number(self, expr: m.Number) -> tuple[Math, int]:
        type_ = expr.type
        unit = type_.unit if isinstance(type_, Real) else DIMENSIONLESS
        shown = number_math(expr.value, is_whole=isinstance(type_, Int))
        rank = _NEGATION if expr.value < 0 else _ATOM
        if unit == DIMENSIONLESS or not expr.value:
            return shown, rank
        return shown + THIN + unit_math(unit), min(rank, _PRODUCT)

    def _unary(self, expr: m.Unary) -> tuple[Math, int]:
        operand = expr.operand
        if expr.op == "-":
            return sign("minus", 1) + self.within(operand, _NEGATION), _NEGATION
        match operand:
            case m.IsOneOf():
                return self._among(operand, "in.not"), _COMPARISON
            case m.IsNone(value=value):
                return self.within(value, _SUM) + sign("eq.not") + sign("emptyset", 1), _COMPARISON
            case m.Builtin(name=m.NEAR, args=args):
                return self._near(args, "eq.not"), _COMPARISON
        return sign("not", 1) + self.within(operand, _NOT + 1), _NOT

    def _compare(self, expr: m.Compare) -> tuple[Math, int]:
        sides = self.within(expr.left, _SUM), self.within(expr.right, _SUM)
        return joined(sides, sign(_COMPARISONS[expr.op])), _COMPARISON

    def _is_none(self, expr: m.IsNone) -> tuple[Math, int]:
        return self.within(expr.value, _SUM) + sign("=") + sign("emptyset", 1), _COMPARISON

    def _logic(self, expr: m.Logic) -> tuple[Math, int]:
        shown = joined(self.operands(expr)[1], sign(expr.op))
        return shown, _AND if expr.op == "and" else _OR

    def _binary(self, expr: m.Binary) -> tuple[Math, int]:
        op, left, right = expr.op, expr.left, expr.right
        own = _RANKS[SIGNS[op].binds]
        if op == "**":
            return attached(self.within(left, _ATOM), tr=self.math(right)), _POWER
        if op == "/":
            above, below = self.math(left), self.math(right)
            if above.width < 12 and below.width < 12:
                return Math(
                    f"frac({above.text}, {below.text})", max(above.width, below.width)
                ), _ATOM
        sides = self.within(left, own), self.within(right, own + 1)
        signs = {"+": sign("+"), "-": sign("minus"), "*": sign("dot.op", 1), "@": THIN}
        return joined(sides, signs.get(op, sign("slash", 1))), own

    def _among(self, expr: m.IsOneOf, word_: str) -> Math:
        type_ = expr.item.type
        members = type_.members if isinstance(type_, Enum) else tuple(sorted(expr.members))
        shown = listed(member(name) for name in members if name in expr.members)
        return self.within(expr.item, _SUM) + sign(word_) + bracketed(shown, "{", "}")

    def _choice(self, expr: m.Expr) -> Math:
        lines, width = [], 0.0
        while isinstance(expr, m.Choice):
            value, test = self.math(expr.then), self.math(expr.test)
            lines.append(f"{value.text} & #if_ {test.text}")
            width, expr = max(width, value.width + test.width + 4), expr.otherwise
        last = self.math(expr)
        lines.append(f"{last.text} & #otherwise_")
        return Math(f"cases({', '.join(lines)})", max(width, last.width + 8) + 1)

    def _builtin(self, expr: m.Builtin) -> tuple[Math, int]:
        name, args, row = expr.name, expr.args, FUNCTIONS[expr.name]
        if name == m.NEAR:
            return self._near(args, "eq"), _COMPARISON
        if name == m.JOINED:
            return joined((self.within(a, _SUM + 1) for a in args), sign("+")), _SUM
        if row.rule is None and not isinstance(row.form(args[0].type), Form):  # nobody wrote it
            return self._form(args[0])
        if row.notation == "power -1":
            return attached(self.within(args[0], _ATOM), tr=sign("minus/**/1", 1.5)), _ATOM
        if row.notation == "root":
            return root(self.math(args[0])), _ATOM
        if row.notation:
            bar = {"bars": "bar.v", "double bars": "bar.v.double"}[row.notation]
            return bracketed(self.math(args[0]), bar, bar), _ATOM
        return word(name) + bracketed(listed(map(self.math, args))), _ATOM

    def _near(self, args: Sequence[m.Expr], relation: str) -> Math:
        """Equal within a tolerance, or two, which stand below the sign."""
        self.signs[m.NEAR] = None
        left, right, *tolerances = args
        around = attached(sign(relation, 1), br=listed(map(self.math, tolerances)))
        relation_ = Math(f'class("relation", {around.text})', around.width + 0.6)
        return self.within(left, _SUM) + relation_ + self.within(right, _SUM)

    def _quantifier(self, expr: m.Quantifier) -> tuple[Math, int]:
        variable = drawn(symbol_of(expr.variable))
        over = variable + sign("in") + self.within(expr.over, _SUM)
        if expr.kind in ("argmax", "argmin"):
            base = Math(f'op("arg {expr.kind[3:]}", limits: #true)', 6)
            return attached(base, b=over) + THIN + self.within(expr.body, _SUM), _NOT
        base = sign("forall" if expr.kind == "all" else "exists", 1)
        return attached(base, br=over) + THIN + self.within(expr.body, _NOT), _NOT

    def _field(self, expr: m.FieldOf) -> Math:
        """A field of a record; of what an operator returns, the operator has it as an index."""
        value = expr.value
        while self._is_inlined(value):
            value = self.inlined[value.name]
        shown = drawn(symbol_of(expr.name))
        if isinstance(value, m.Call):
            operator = self.outer.operators.get(value.operator)
            own = attached(operator_symbol(operator, value.operator), br=shown)
            self.signs["field"] = None
            return linked(f"operator.{value.operator}", own) + self._arguments(value.args)
        return self.within(value, _ATOM) + Math("#sym.dot.basic", 0.4) + shown

    def _component(self, expr: m.Component) -> Math:
        value, names = expr.value, expr.value.type.names
        while isinstance(value, m.Unwrap):
            value = value.value
        if not names:
            at = bracketed(word(str(expr.index)), "[", "]")
            return self.within(value, _ATOM) + at
        name = names[expr.index]
        plain = self._symbol(value, name)
        return plain or attached(bracketed(self.math(value)), br=drawn(MathSymbol(name)))

    def _symbol(self, expr: m.Expr, component: str) -> Math | None:
        """The component of a value that has a symbol and no second frame."""
        if self.names is None or len(expr.type.frames) > 1:
            return None
        match expr:
            case m.Input(peer=peer, element=element):
                return self.names.input(peer, element, component)
            case m.MemoryRef(name=name):
                return self.names.value("memory", name, component)
            case m.LetRef(name=name) if name not in self.inlined:
                return self.names.value("let", name, component)
        return None

    def _arguments(self, args: Sequence[m.Expr]) -> Math:
        return bracketed(listed(map(self.math, args)))

    def _call(self, expr: m.Call) -> Math:
        return self.outer.operator(expr.operator) + self._arguments(expr.args)

    def _input(self, expr: m.Input) -> Math:
        if self.names is None:
            return word(f"x.{expr.peer}.{expr.element}")
        return self.names.input(expr.peer, expr.element)

    def _memory(self, expr: m.MemoryRef) -> Math:
        if reading := self.readings.get(expr.name):
            return reading_math(self.outer, reading)
        return self.names.value("memory", expr.name) if self.names else drawn(symbol_of(expr.name))

    def _let(self, expr: m.LetRef) -> Math:
        return self.names.value("let", expr.name) if self.names else drawn(symbol_of(expr.name))

    def _constant(self, expr: m.ConstantRef | m.Live) -> Math:
        if self.names is None:
            return self.outer.constant(expr.name)
        return self.names.value("constant", expr.name)

    def _clock(self, expr: m.Clock) -> Math:
        self.signs[expr.name] = None
        return Math("Delta/**/iota", 1.5) if expr.name == "period" else word(expr.name)

    def _arrival(self, expr: m.Fresh | m.Present | m.Lag) -> Math:
        name: str = expr.name if isinstance(expr, m.Lag) else "present"
        name = "fresh" if isinstance(expr, m.Fresh) else name
        self.signs[name] = None
        shown = Math('cal("P")', 1) if name == "fresh" else word(name)
        return shown + bracketed(self._buffered(expr.input))

    def _unused(self, _: m.Unused) -> Math:
        self.signs["unused"] = None
        return DASH

    def _buffered(self, given: m.Input) -> Math:
        if self.names is None:
            return word(f"x.{given.peer}.{given.element}")
        return self.names.placeholder("x", given.peer, given.element)


_COMPOUND: dict[type, Callable[[FormulaWriter, Any], tuple[Math, int]]] = {
    m.Number: FormulaWriter._number,
    m.Unary: FormulaWriter._unary,
    m.Binary: FormulaWriter._binary,
    m.Compare: FormulaWriter._compare,
    m.IsOneOf: lambda f, e: (f._among(e, "in"), _COMPARISON),
    m.IsNone: FormulaWriter._is_none,
    m.Logic: FormulaWriter._logic,
    m.Builtin: FormulaWriter._builtin,
    m.Quantifier: FormulaWriter._quantifier,
}
"""Expressions whose sign binds operands."""
_ATOMS: dict[type, Callable[[FormulaWriter, Any], Math]] = {
    m.Choice: FormulaWriter._choice,
    m.FieldOf: FormulaWriter._field,
    m.Component: FormulaWriter._component,
    m.Call: FormulaWriter._call,
    m.Input: FormulaWriter._input,
    m.MemoryRef: FormulaWriter._memory,
    m.LetRef: FormulaWriter._let,
    m.ConstantRef: FormulaWriter._constant,
    m.Live: FormulaWriter._constant,
    m.Clock: FormulaWriter._clock,
    m.Fresh: FormulaWriter._arrival,
    m.Present: FormulaWriter._arrival,
    m.Lag: FormulaWriter._arrival,
    m.Unused: FormulaWriter._unused,
    m.Items: lambda f, e: bracketed(listed(map(f.math, e.items)), "[", "]"),
    m.Truth: lambda f, e: word("TRUE" if e.value else "FALSE"),
    m.Member: lambda f, e: member(e.name),
    m.TextLiteral: lambda f, e: word(f"“{e.value}”"),
    m.Nothing: lambda f, e: sign("emptyset", 1),
    m.BoundVariable: lambda f, e: drawn(symbol_of(e.name)),
    m.ParameterRef: lambda f, e: drawn(symbol_of(e.name)),
    m.FileRef: lambda f, e: word(m.source_name(e.name)),
    m.Unknown: lambda f, e: word("?"),
}


def member(name: str) -> Math:
    """A member of an enum: a letter in Fraktur as in the paper, else a word."""
    if len(name) == 1 and name.isascii() and name.isalpha():
        return Math(f'frak("{name}")', 1)
    return word(name)


def number_math(value: float, is_whole: bool = False) -> Math:
    """A number, with powers of ten where Python has an exponent."""
    text = str(int(value)) if is_whole else repr(float(value)).removesuffix(".0")
    if len(text) > _LONGEST_NUMBER and not is_whole:
        text = f"{value:.10g}"
    mantissa, _, exponent = text.partition("e")
    minus = sign("minus", 1) if mantissa.startswith("-") else EMPTY
    shown = minus + word(mantissa.removeprefix("-"), 0.5 * len(mantissa))
    if not exponent:
        return shown
    power = number_math(int(exponent), is_whole=True)
    return shown + sign("dot.op", 1) + attached(word("10"), tr=power)


_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\*\*\(?(-?[\d/]+)\)?)?([*/]?)")


def unit_math(unit: Unit) -> Math:
    """A unit, with its exponents raised."""
    found = EMPTY
    for name, exponent, after in _FACTOR.findall(str(unit)):
        factor = word(name, 0.8 * len(name))
        found += attached(factor, tr=word(exponent)) if exponent else factor
        found += {"*": sign("dot.op", 1), "/": sign("slash", 1)}.get(after, EMPTY)
    return found


# FormulaWriter about runs.


def reading_math(names: SystemNames, reading: Reading) -> Math:
    """A value that requirements name, in the buffer or memory in which they name it."""
    text = reading.name.removeprefix("present(").removesuffix(")")
    first, second, *rest = text.split(".") if "(" not in text else ("", "")
    owner = names.subsystems.get(f"{first}.{second}")
    device = names.wires.devices.get(".".join((first, second, *rest[:1])))
    if reading.kind == "state":
        shown = names.subsystems[reading.subsystem].current_state
    elif owner is not None and len(rest) == 3:
        shown = owner.placeholder(rest[0], rest[1], rest[2])
    elif owner is not None and len(rest) == 1:
        shown = owner.placeholder("", "", rest[0])
    elif device is not None and len(rest) == 2:
        shown = names.device(device) + bracketed(symbol_for(rest[1], "", reading.type), "[", "]")
    elif reading.kind == "observed":
        shown = word(first) + bracketed(symbol_for(second, "", reading.type), "[", "]")
    else:
        shown = word(text)
    return word("present") + bracketed(shown) if reading.asks_presence else shown


_PAST = {"once": "diamond.filled", "historically": "square.filled"}
_FUTURE = {"within": "diamond.stroked", "throughout": "square.stroked"}


def requirement_forms(writer: FormulaWriter, requirement: Requirement) -> list[Math]:
    """A requirement, always or at the first tick: on one line, and on two if it `implies`."""
    shown, rank = _temporal(writer, requirement.formula)
    always = EMPTY
    if requirement.holds_always:
        writer.signs["always"] = None
        always = sign("square.stroked", 1) + THIN
        shown = shown if rank >= _NOT else bracketed(shown)
    forms = [always + shown]
    match requirement.formula:
        case BoolOp(operands=(_, conclusion), premise=premise) if premise is not None:
            first, second = (_bound(writer, each, _OR) for each in (premise, conclusion))
            if always.text:
                first = always + sign("#sym.paren.l", 0.5) + first
                second += sign("#sym.paren.r", 0.5)
            text = f"{first.text} #br & arrow.r.double/**/{second.text}"
            forms.append(Math(text, max(first.width, second.width) + 4))
    return forms


def _temporal(formulas: FormulaWriter, formula: TemporalFormula) -> tuple[Math, int]:
    match formula:
        case TickCondition(that=that):
            return formulas._form(that)
        case BoolOp(operands=(_, conclusion), premise=premise) if premise is not None:
            sides = _bound(formulas, premise, _OR), _bound(formulas, conclusion, _OR)
            return joined(sides, sign("arrow.r.double", 2)), _IMPLIES
        case BoolOp(op="not", operands=(operand,)):
            return sign("not", 1) + _bound(formulas, operand, _NOT + 1), _NOT
        case BoolOp(op=op, operands=operands):
            own = _AND if op == "and" else _OR
            return joined((_bound(formulas, each, own + 1) for each in operands), sign(op)), own
        case Temporal(op="since", operands=(left, right)):
            formulas.signs["since"] = None
            sides = _bound(formulas, left, _NOT), _bound(formulas, right, _NOT)
            return joined(sides, word("since")), _COMPARISON
        case Temporal(op=op, operands=(operand,)):
            formulas.signs[op] = None
            span = (
                formulas.math(formula.span) if formula.span else number_math(float(formula.span_s))
            )
            base = sign({**_PAST, **_FUTURE}[op], 1)
            around = attached(base, br=sign("lt.eq", 1) + span)
            return around + THIN + _bound(formulas, operand, _NOT), _NOT
    return word("?"), _ATOM


def _bound(formulas: FormulaWriter, formula: TemporalFormula, rank: int) -> Math:
    shown, own = _temporal(formulas, formula)
    return shown if own >= rank else bracketed(shown)
