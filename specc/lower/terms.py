"""Terms: the expressions of a subsystem, with equal ones made identical and lets put in place.

A let is only a name that a term prefers. Equality of terms is identity, so finding what can be
computed once costs a look into a set, however deep the expressions are.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace

from specc.lang import ranges
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import range_of_parts
from specc.lang.ranges import Range
from specc.lang.values import SIGNS
from specc.model import expr as e
from specc.model.fsm import Behaviour
from specc.model.system import Device, Let, Subsystem, System
from specc.model.types import Bool, Enum, Int, ListOf, PartialOf, Pose, Real, Spatial, Type, Vector
from specc.model.units import SECOND
from specc.reachable import grouped, reachable

TermSet = frozenset["Term"]
NONE: TermSet = frozenset()


@dataclass(eq=False, slots=True)
class Term:
    """A node of an expression; `node` says what it is, its own operands are replaced by `args`."""

    order: int
    """Terms have higher numbers than the terms they are made of."""
    node: e.Expr
    args: tuple[Term, ...]
    is_constant: bool
    """Made of literals and constants alone."""
    is_invariant: bool
    """Has one value from the end of the first period on, and computing it cannot fail."""
    range: Range
    """The bounds of all components."""
    let: Let | None = None
    """The let that names it; the first one if there are several."""
    bound: frozenset[str] = field(init=False)
    """Variables of quantifiers around this term that occur in it."""
    reads_clock: bool = field(init=False)
    memory: frozenset[str] = field(init=False)
    """Memory elements that its evaluation may read."""
    maybe_evaluated: TermSet = field(init=False, repr=False)
    """Terms worth keeping that an evaluation of this one may evaluate; itself among them."""
    is_rounded: bool = field(init=False)
    """Whether its value comes from arithmetic of reals, which rounds."""
    depends_on_rounding: bool = field(init=False)
    """Whether a comparison with such a value is in it."""
    is_costly: bool = field(init=False)
    """Whether computing it again costs more than handing its value on."""
    may_overflow: bool = field(init=False)
    """A result of arithmetic that has not been checked, and may not be finite."""
    is_unchecked: bool = field(init=False)
    """Such a result, or an array that was just made, which has to become read-only."""

    def __post_init__(self) -> None:
        node, args = self.node, self.args
        self.bound = frozenset[str]().union(*(arg.bound for arg in args))
        self.memory = frozenset[str]().union(*(arg.memory for arg in args))
        self.reads_clock = any(arg.reads_clock for arg in args)
        rounded = self.is_rounded = any(arg.is_rounded for arg in args)
        self.depends_on_rounding = any(arg.depends_on_rounding for arg in args)
        match node:
            case e.BoundVariable(name=name):
                self.bound = frozenset({name})
            case e.Quantifier(variable=variable):
                self.bound = args[0].bound | (args[1].bound - {variable})
                self.depends_on_rounding |= rounded
            case e.Compare():
                self.depends_on_rounding |= rounded
            case e.Binary(type=type_):
                self.is_rounded = not isinstance(type_, Int)
            case e.Builtin(name=name):
                self.is_rounded |= FUNCTIONS[name].rounds
                # A function that compares computes how far its arguments are apart.
                self.depends_on_rounding |= FUNCTIONS[name].compares
            case e.Call():
                self.is_rounded = False
            case e.MemoryRef(name=name):
                self.memory = frozenset({name})
            case e.Clock(name=name):
                self.reads_clock = name != "period"
        self.maybe_evaluated = NONE.union(*(arg.maybe_evaluated for arg in args))
        self.may_overflow = self.is_unchecked = False
        if _is_real(node.type) and not _is_pose_product(node):
            self.may_overflow = _may_overflow(self)
            self.is_unchecked = self.may_overflow or (node.type.is_array and _is_new_array(self))
        self.is_costly = not (self.bound or self.is_invariant) and _is_costly(
            node, self.maybe_evaluated
        )
        if self.is_costly or isinstance(node, e.ParameterRef):
            self.mark_worth_local()

    @property
    def type(self) -> Type:
        """Type of its values."""
        return self.node.type

    @property
    def largest(self) -> float:
        """No component is larger than this, up to sign; infinite where nothing is known."""
        return max(-self.range[0], self.range[1])

    @property
    def is_worth_local(self) -> bool:
        """Whether its value is worth a local variable when it is needed twice."""
        return self in self.maybe_evaluated

    def mark_worth_local(self) -> None:
        """Note that the value is worth a local variable."""
        self.maybe_evaluated |= {self}


def unevaluated(terms: Iterable[Term], known: Collection[Term]) -> dict[Term, None]:
    """Terms that an evaluation of `terms` may visit when the values of `known` are there."""
    return reachable(
        (term for term in terms if term not in known),
        lambda term: (arg for arg in term.args if arg not in known),
    )


def by_order(terms: Iterable[Term]) -> list[Term]:
    """Sort terms after those that they are made of; lets keep the order of the file."""
    return sorted(terms, key=lambda term: term.order)


def _is_costly(node: e.Expr, perhaps: TermSet) -> bool:
    match node:
        case e.Call():
            return True
        case e.Builtin(name=name) if FUNCTIONS[name].is_costly:
            return True
        case e.Builtin(name=name, args=(first, *_)) if FUNCTIONS[name].compares:
            return first.type.is_array
        case e.Builtin() | e.Unary() | e.Binary() | e.Items():
            return node.type.is_array
        case e.Quantifier(kind="argmax" | "argmin"):
            return True
        case e.Quantifier(over=over):
            members = isinstance(over.type, Vector) and isinstance(over.type.element, Enum)
            return not members or any(term.is_costly for term in perhaps)
        case e.Choice() | e.Logic():
            return any(term.is_costly for term in perhaps)
    return False


# Where arithmetic on finite numbers may give infinity or NaN, and where that is noticed.
#
# Infinity and NaN show in the result of any further arithmetic that they enter, so a value is
# checked only once: before it is compared, written or handed to an operator.


SAFE_LIMIT = 1e300
"""Numbers below this stay finite in one operation with numbers of their size."""
MAX_DURATION_S = 1e12
"""No state lasts longer than this."""


def propagating_operands(node: e.Expr) -> range:
    """The operands in which a number that is not finite makes the result not finite."""
    match node:
        case e.Binary(op="**", right=e.Number(value=exponent)) if exponent < 1:
            return range(0)  # infinity to the power of -1 is 0
        case e.Binary(op=op):
            return range(SIGNS[op].propagates)
        case e.Unary(op="-") | e.Component() | e.Unwrap():
            return range(1)
        case e.Builtin(name=name, args=args) if FUNCTIONS[name].propagates:
            return range(len(args))
        case e.Items(type=Vector() | Spatial(), items=items):
            return range(len(items))
    return range(0)


def _may_overflow(made: Term) -> bool:
    """Whether a term is the result of arithmetic that may not be finite.

    Finite are results that stay below `SAFE_LIMIT`, and those no larger than a finite term that
    they were made from; where poses are composed, generated code checks the result by itself.
    """
    node, args, largest = made.node, made.args, made.largest
    if any(args[place].may_overflow for place in propagating_operands(node)):
        return True
    match node:
        case e.Builtin(name=name):
            return FUNCTIONS[name].overflows and largest >= SAFE_LIMIT
        case e.Binary(op=op):
            shrinks = (op == "*" and any(arg.largest <= 1.0 for arg in args)) or (
                op == "/" and ranges.absolute(args[1].range)[0] >= 1.0
            )
            return largest >= SAFE_LIMIT and not shrinks
    return False


def _is_new_array(term: Term) -> bool:
    """Whether a term is an array that arithmetic makes, and that is no constant of the module."""
    node = term.node
    if any(term.args[place].is_unchecked for place in propagating_operands(node)):
        return True
    if term.largest < SAFE_LIMIT and all(arg.is_constant for arg in term.args):
        return False
    return isinstance(node, e.Binary) or (
        FUNCTIONS[node.name].overflows
        if isinstance(node, e.Builtin)
        else isinstance(node, e.Unary) and node.op == "-"
    )


def _is_pose_product(node: e.Expr) -> bool:
    return isinstance(node, e.Binary) and node.op == "@" and isinstance(node.type, Pose)


def _is_real(type_: Type) -> bool:
    return isinstance(type_, Real) or (type_.is_array and not isinstance(type_, PartialOf))


MAX_TERMS = 100_000
"""Most terms that one method may spell; conditional lets can multiply beyond any use."""


class TooLarge(Exception):
    """The work cycle of a subsystem would become too large a method."""

    def __init__(self, subsystem: str = "") -> None:
        self.subsystem = subsystem
        whose = f" of `{subsystem}`" if subsystem else ""
        super().__init__(
            f"one period{whose} evaluates more than {MAX_TERMS} terms, or terms nested too deep; "
            "lets that use other lets in both branches of a choice multiply: compute some in an "
            "operator"
        )


class TermTable:
    """All terms of a subsystem."""

    def __init__(
        self,
        lets: Iterable[Let] = (),
        computed: Iterable[str] = (),
        invariant_memory: Iterable[str] = (),
        constants: Mapping[str, e.Expr] | None = None,
        parameters: Mapping[str, tuple[Type, ...]] | None = None,
    ) -> None:
        """`computed`: constants whose value an operator or a file gives; `invariant_memory` keeps
        its initial value for ever; `constants`: the values of the others and of `period`;
        `parameters`: the types of the parameters of every operator.
        """
        self._terms: dict[object, Term] = {}
        self._lets: dict[str, Term] = {}
        self._computed = frozenset(computed)
        self._invariant_memory = frozenset(invariant_memory)
        self._constants = constants or {}
        self._parameters = parameters or {}
        for let in lets:
            term = self._lets[let.name] = self.of(let.value)
            if term.args and not term.is_invariant and term.let is None:
                term.let = let
                term.mark_worth_local()

    def of(self, node: e.Expr, as_type: Type | None = None) -> Term:
        """Intern an expression that is compared, written or passed on: its number is finite.

        `as_type` is the type of the place; an integer becomes a real there.
        """
        term = self._unchecked(node)
        if term.is_unchecked:
            return self._intern(e.Builtin(e.FINITE, (term.node,), type=term.type), (term,))
        if isinstance(as_type, Real) and isinstance(term.type, Int):
            if isinstance(term.node, e.Number):
                return self._intern(e.Number(float(term.node.value), type=as_type), ())
            return self._intern(e.Builtin(e.FLOAT, (term.node,), type=as_type), (term,))
        return term

    def arguments_of(self, call: Behaviour) -> tuple[Term, ...]:
        """What the call of a behaviour gives to its parameters."""
        parameters = call.generic.parameters if call.generic else ()
        pairs = zip(call.arguments, parameters, strict=True)
        return tuple(self.of(argument, parameter.type) for argument, parameter in pairs)

    def parameters_of(self, call: Behaviour) -> tuple[Term, ...]:
        """The parameters of a behaviour that is called."""
        parameters = call.generic.parameters if call.generic else ()
        return tuple(self.of(e.ParameterRef(p.name, type=p.type)) for p in parameters)

    def bound_parameters(self, behaviours: Iterable[Behaviour]) -> None:
        """Let parameters be as large as their arguments.

        One term stands for all parameters of one name and type.
        """
        pairs = (
            pair
            for call in behaviours
            for pair in zip(self.parameters_of(call), self.arguments_of(call), strict=True)
        )
        for parameter, arguments in grouped(pairs).items():
            parameter.range = ranges.union(*(argument.range for argument in arguments))

    def _unchecked(self, node: e.Expr) -> Term:
        """Intern an expression whose last result is not checked to be finite.

        Infinity and NaN show in all arithmetic that they enter, so one check at the end is enough.
        """
        if isinstance(node, e.LetRef):
            return self._lets[node.name]
        if isinstance(node, e.ConstantRef) and node.is_live:
            return self._unchecked(self._constants[node.name])
        if isinstance(node, (e.Fresh, e.Present, e.Lag)):
            return self._intern(node, ())
        propagating = propagating_operands(node)
        args = (
            self._unchecked(child)
            if place in propagating
            else self.of(child, self._operand_type(node, place))
            for place, child in enumerate(e.children(node))
        )
        return self.fold(node, tuple(args))

    def _operand_type(self, node: e.Expr, index: int) -> Type | None:
        """The type that an operand has to have; None where any number will do."""
        match node:
            case e.Call(operator=name) if name in self._parameters:
                return self._parameters[name][index]
            case e.Choice() if index:
                return node.type
            case e.Builtin(name=name) if FUNCTIONS[name].chooses:
                return node.type
            case e.Items(type=ListOf(element=element)):
                return element
        return None

    def fold(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        """Intern a node over given operands, after folding what is known."""
        match node:
            case e.Unary(op="not"):
                return self._fold_not(node, args[0])
            case e.Logic():
                return self._fold_logic(node, args)
            case e.Choice() if isinstance(args[0].node, e.Truth):
                return args[1] if args[0].node.value else args[2]
        return self._intern(node, args)

    def truth(self, value: bool) -> Term:
        """The term of a constant truth value."""
        return self._intern(e.TRUE if value else e.FALSE, ())

    def negation(self, term: Term) -> Term:
        """The term that holds when `term` does not."""
        return self._fold_not(e.Unary("not", term.node, type=Bool()), term)

    def _fold_not(self, node: e.Unary, arg: Term) -> Term:
        match arg.node:
            case e.Truth(value=value):
                return self.truth(not value)
            case e.Unary(op="not"):
                return arg.args[0]
            case e.Compare(op="==" | "!=" as op):
                return self._intern(replace(arg.node, op="!=" if op == "==" else "=="), arg.args)
        return self._intern(node, (arg,))

    def _fold_logic(self, node: e.Logic, args: tuple[Term, ...]) -> Term:
        """`and`/`or` without operands that decide nothing; `a and not a` is decided."""
        decided = self.truth(node.op == "or")
        operands: list[Term] = []
        for arg in args:
            nested = isinstance(arg.node, e.Logic) and arg.node.op == node.op and arg.let is None
            for part in arg.args if nested else (arg,):
                if part is decided or self.negation(part) in operands:
                    return decided
                if not isinstance(part.node, e.Truth) and part not in operands:
                    operands.append(part)
        if len(operands) < 2:
            return operands[0] if operands else self.truth(node.op == "and")
        return self._intern(node, tuple(operands))

    def _intern(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        key = (type(node), node.type, _payload(node), tuple(arg.order for arg in args))
        if key not in self._terms:
            match node:
                case e.ConstantRef(name=name) | e.Clock(name=name) if name in self._constants:
                    range_ = self._unchecked(self._constants[name]).range
                case e.Clock(name="elapsed") | e.Lag(name="age"):
                    range_ = 0.0, MAX_DURATION_S
                case _:
                    range_ = range_of_parts(node, [arg.range for arg in args])
            # The range may have made terms, which come before this one.
            self._terms[key] = Term(
                len(self._terms), node, args, *self._constness(node, args), range_
            )
        return self._terms[key]

    def _constness(self, node: e.Expr, args: tuple[Term, ...]) -> tuple[bool, bool]:
        """Whether a term is constant, and whether it is invariant."""
        is_constant = all(arg.is_constant for arg in args)
        is_invariant = all(arg.is_invariant for arg in args)
        match node:
            case e.Number() | e.Truth() | e.TextLiteral() | e.Member() | e.Unused() | e.Nothing():
                return True, True
            case e.ConstantRef(name=name):
                return name not in self._computed, True
            case e.MemoryRef(name=name):
                return False, name in self._invariant_memory
            case e.Clock(name=name):
                return name == "period", name == "period"
            case e.Binary(op=op) if SIGNS[op].may_fail:
                return False, False  # may fail, so only where it is needed
            case e.Builtin(name=name):
                may_fail = FUNCTIONS[name].may_fail
                is_constant &= not may_fail or FUNCTIONS[name].constants_checked
                return is_constant, is_invariant and not may_fail
            case e.Unary() | e.Binary() | e.Items() | e.Component() | e.FieldOf() if args:
                return is_constant, is_invariant
        return False, False


def term_table(system: System, part: Subsystem | Device, computed: Collection[str]) -> TermTable:
    """Make the terms of one part; operators and files give the constants `computed`."""
    declared = (*system.constants, *part.constants)
    constants = {c.name: c.value for c in declared if c.name not in computed}
    parameters = {o.name: tuple(t for _, t in o.parameters) for o in system.operators}
    if isinstance(part, Device):
        return TermTable((), computed, (), constants, parameters)
    constants["period"] = e.Number(float(1 / part.rate_hz), type=Real(SECOND))
    invariant = (item.name for item in part.memory if item.name not in part.changing_memory)
    table = TermTable(part.lets, computed, invariant, constants, parameters)
    table.bound_parameters(part.behaviours)
    return table


def _payload(node: e.Expr) -> object:
    """A key that distinguishes nodes of one kind, besides type and operands."""
    if isinstance(node, e.Number):
        return (type(node.value), repr(node.value))  # 0.0 and -0.0 are equal numbers
    if isinstance(node, (e.Fresh, e.Present)):
        return node.input
    if isinstance(node, e.Lag):
        return node.name, node.input
    values = (getattr(node, part.name) for part in fields(node) if part.name not in _COMMON)
    return tuple(v for v in values if isinstance(v, (str, int, float, bool, frozenset)))


_COMMON = ("type", "span")
