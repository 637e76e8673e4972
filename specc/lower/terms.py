"""Terms: the expressions of a subsystem with equal ones made identical and lets put in place.

A let is only a name that a term prefers. Equality of terms is identity, so finding what can be
computed once costs a look into a set, however deep the expressions are.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace

from specc.lower import finite
from specc.lower.finite import is_array
from specc.model import expr as e
from specc.model.system import Let
from specc.model.types import Bool, Enum, Int, Real, Type, Vector
from specc.reachable import reachable

Terms = frozenset["Term"]
NONE: Terms = frozenset()


LARGEST = 100_000
"""Most terms that one method may spell; conditional lets can multiply beyond any use."""


class TooLarge(Exception):
    """The work cycle of a subsystem would become too large a method."""

    def __init__(self, subsystem: str = "") -> None:
        self.subsystem = subsystem
        whose = f" of `{subsystem}`" if subsystem else ""
        super().__init__(
            f"one period{whose} evaluates more than {LARGEST} terms, or terms nested too deep; "
            "lets that use other lets in both branches of a choice multiply: compute some in an "
            "operator"
        )


@dataclass(slots=True, eq=False)
class Term:
    """A node of an expression; `node` says what it is, its own operands are replaced by `args`."""

    order: int
    """Terms have higher numbers than the terms they are made of."""
    node: e.Expr
    args: tuple[Term, ...]
    bound: frozenset[str]
    """Variables of quantifiers around this term that occur in it."""
    is_constant: bool
    """Made of literals and constants alone."""
    is_settled: bool
    """Has one value from the end of the first period on, and computing it cannot fail."""
    reads_clock: bool
    memory: frozenset[str]
    """Memory elements that its evaluation may read."""
    perhaps: Terms = field(repr=False)
    """Terms worth keeping that an evaluation of this one may evaluate; itself among them."""
    let: Let | None = None
    """The let that names it; the first one if there are several."""
    is_rounded: bool = False
    """Whether its value comes from arithmetic of reals, which rounds."""
    rests_on_rounding: bool = False
    """Whether a comparison with such a value is in it."""
    is_costly: bool = False
    """Whether computing it again costs more than handing its value on."""
    largest: float = math.inf
    """No component is larger than this, up to sign; infinite where nothing is known."""
    is_raw: bool = False
    """A result of arithmetic that has not been checked: it may not be finite."""

    @property
    def type(self) -> Type:
        """Type of its values."""
        return self.node.type

    @property
    def is_kept(self) -> bool:
        """Whether its value is worth a local variable when it is needed twice."""
        return self in self.perhaps

    def keep(self) -> None:
        """Note that the value is worth a local variable."""
        self.perhaps |= {self}


def unknown(terms: Iterable[Term], known: Collection[Term]) -> dict[Term, None]:
    """Terms that an evaluation of `terms` may visit when the values of `known` are there."""
    return reachable(
        (term for term in terms if term not in known),
        lambda term: (arg for arg in term.args if arg not in known),
    )


def in_order(terms: Iterable[Term]) -> list[Term]:
    """Terms after those that they are made of; lets in the order of the file."""
    return sorted(terms, key=lambda term: term.order)


class TermTable:
    """All terms of a subsystem."""

    def __init__(
        self,
        lets: Iterable[Let] = (),
        computed: Iterable[str] = (),
        settled: Iterable[str] = (),
        constants: Mapping[str, e.Expr] | None = None,
        parameters: Mapping[str, tuple[Type, ...]] | None = None,
    ) -> None:
        """`computed`: constants whose value an operator or a file gives; `settled`: memory that
        keeps its initial value; `constants`: the values of the others
        and of `period`; `parameters`: the types
        of the parameters of every operator."""
        self._terms: dict[object, Term] = {}
        self._lets: dict[str, Term] = {}
        self._computed = frozenset(computed)
        self._settled = frozenset(settled)
        self._constants = constants or {}
        self._parameters = parameters or {}
        for let in lets:
            self._lets[let.name] = self._named(self.of(let.value), let)

    def _named(self, term: Term, let: Let) -> Term:
        if term.args and not term.is_settled and term.let is None:
            term.let = let
            term.keep()
        return term

    def of(self, node: e.Expr, as_type: Type | None = None) -> Term:
        """The term of an expression that is compared, written or handed on: a number is finite.

        `as_type` is the type of the place; an integer becomes a real there.
        """
        term = self._raw(node)
        if term.is_raw:
            return self._make(e.Builtin("finite", (term.node,), type=term.type), (term,))
        if isinstance(as_type, Real) and isinstance(term.type, Int):
            if isinstance(term.node, e.Number):
                return self._make(e.Number(float(term.node.value), type=as_type), ())
            return self._make(e.Builtin("float", (term.node,), type=as_type), (term,))
        return term

    def _raw(self, node: e.Expr) -> Term:
        """The term of an expression. What is not finite shows in all arithmetic that it enters, so
        that one look at the end is enough; wherever it could hide, it is looked at before."""
        if isinstance(node, e.LetRef):
            return self._lets[node.name]
        if isinstance(node, (e.Fresh, e.Present)):
            return self._make(node, ())
        shown = finite.shows(node)
        args = (
            self._raw(child) if place in shown else self.of(child, self._place(node, place))
            for place, child in enumerate(e.children(node))
        )
        return self.make(node, tuple(args))

    def _place(self, node: e.Expr, place: int) -> Type | None:
        if isinstance(node, e.Call) and node.operator in self._parameters:
            return self._parameters[node.operator][place]
        return finite.place_type(node, place)

    def make(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        """The term of a node over given operands, after folding what is known."""
        match node:
            case e.Unary(op="not"):
                return self._negated(node, args[0])
            case e.Logic():
                return self._joined(node, args)
            case e.Choice() if isinstance(args[0].node, e.Truth):
                return args[1] if args[0].node.value else args[2]
        return self._make(node, args)

    def truth(self, value: bool) -> Term:
        """The term of a constant truth value."""
        return self._make(e.TRUE if value else e.FALSE, ())

    def negation(self, term: Term) -> Term:
        """The term that holds when `term` does not."""
        return self._negated(e.Unary("not", term.node, type=Bool()), term)

    def _negated(self, node: e.Unary, arg: Term) -> Term:
        match arg.node:
            case e.Truth(value=value):
                return self.truth(not value)
            case e.Unary(op="not"):
                return arg.args[0]
            case e.Compare(op="==" | "!=" as op):
                return self._make(replace(arg.node, op="!=" if op == "==" else "=="), arg.args)
        return self._make(node, (arg,))

    def _joined(self, node: e.Logic, args: tuple[Term, ...]) -> Term:
        """`and`/`or` without operands that decide nothing; `a and not a` is decided."""
        decided = self.truth(node.op == "or")
        kept: list[Term] = []
        for arg in args:
            nested = isinstance(arg.node, e.Logic) and arg.node.op == node.op and arg.let is None
            for part in arg.args if nested else (arg,):
                if part is decided or self.negation(part) in kept:
                    return decided
                if not isinstance(part.node, e.Truth) and part not in kept:
                    kept.append(part)
        if len(kept) < 2:
            return kept[0] if kept else self.truth(node.op == "and")
        return self._make(node, tuple(kept))

    def _make(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        key = (type(node), node.type, _payload(node), tuple(arg.order for arg in args))
        if key not in self._terms:
            self._terms[key] = self._new(node, args)
        return self._terms[key]

    def _new(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        perhaps = NONE.union(*(arg.perhaps for arg in args))
        largest = self._largest(node, args)  # may make terms, so before this one has its number
        term = Term(
            order=len(self._terms),
            node=node,
            args=args,
            bound=_bound(node, args),
            is_constant=_is_constant(node, args, self._computed),
            is_settled=_is_settled(node, args, self._settled),
            reads_clock=_reads_clock(node) or any(arg.reads_clock for arg in args),
            memory=_memory(node).union(*(arg.memory for arg in args)),
            perhaps=perhaps,
            is_rounded=_is_rounded(node, args),
            rests_on_rounding=_compares_rounded(node, args),
        )
        term.largest = largest
        term.is_raw = finite.is_raw(node, args, largest)
        term.is_costly = not term.bound and not term.is_settled and _is_costly(node, perhaps)
        if term.is_costly:
            term.keep()
        return term

    def _largest(self, node: e.Expr, args: tuple[Term, ...]) -> float:
        if isinstance(node, (e.ConstantRef, e.Clock)) and node.name in self._constants:
            return self._raw(self._constants[node.name]).largest
        return finite.largest(node, args)


def _payload(node: e.Expr) -> object:
    """What tells two nodes of one kind apart besides their type and operands."""
    if isinstance(node, e.Number):
        return (type(node.value), repr(node.value))  # 0.0 and -0.0 are equal numbers
    if isinstance(node, (e.Fresh, e.Present)):
        return node.input
    values = (getattr(node, part.name) for part in fields(node) if part.name not in _COMMON)
    return tuple(v for v in values if isinstance(v, (str, int, float, bool, frozenset)))


_COMMON = ("type", "span")


def _bound(node: e.Expr, args: tuple[Term, ...]) -> frozenset[str]:
    match node:
        case e.BoundVariable(name=name):
            return frozenset({name})
        case e.Quantifier(variable=variable):
            return args[0].bound | (args[1].bound - {variable})
    return frozenset[str]().union(*(arg.bound for arg in args))


def _memory(node: e.Expr) -> frozenset[str]:
    return frozenset({node.name}) if isinstance(node, e.MemoryRef) else frozenset()


def _reads_clock(node: e.Expr) -> bool:
    return isinstance(node, e.Clock) and node.name != "period"


def _is_constant(node: e.Expr, args: tuple[Term, ...], computed: frozenset[str]) -> bool:
    match node:
        case e.Number() | e.Truth() | e.TextLiteral() | e.Member() | e.Unused() | e.Nothing():
            return True
        case e.Clock(name=name):
            return name == "period"
        case e.ConstantRef(name=name):
            return name not in computed
        case e.Builtin(name="identity"):
            return True
        case e.Builtin(name="sqrt" | "finite" | "float") | e.Binary(op="/" | "**"):
            return False  # may fail, so only where it is needed
        case e.Builtin() | e.Unary() | e.Binary() | e.Items() | e.Component():
            return bool(args) and all(arg.is_constant for arg in args)
    return False


def _is_settled(node: e.Expr, args: tuple[Term, ...], settled: frozenset[str]) -> bool:
    match node:
        case e.Number() | e.Truth() | e.TextLiteral() | e.Member() | e.Unused() | e.ConstantRef():
            return True
        case e.Clock(name=name):
            return name == "period"
        case e.MemoryRef(name=name):
            return name in settled
        case e.Builtin(name="identity"):
            return True
        case e.Builtin(name="sqrt" | "pose" | "finite" | "float") | e.Binary(op="/" | "**"):
            return False
        case e.Builtin() | e.Unary() | e.Binary() | e.Items() | e.Component() | e.FieldOf():
            return bool(args) and all(arg.is_settled for arg in args)
    return False


def _is_rounded(node: e.Expr, args: tuple[Term, ...]) -> bool:
    match node:
        case e.Binary():
            return not isinstance(node.type, Int)
        case e.Builtin(name="inverse" | "norm" | "pose" | "sqrt"):
            return True
        case e.Call():
            return False
    return any(arg.is_rounded for arg in args)


def _compares_rounded(node: e.Expr, args: tuple[Term, ...]) -> bool:
    match node:
        case e.Compare() | e.Quantifier() if any(arg.is_rounded for arg in args):
            return True
        case e.Builtin(name="near"):
            return True  # it computes how far the two are apart
    return any(arg.rests_on_rounding for arg in args)


def _is_costly(node: e.Expr, perhaps: Terms) -> bool:
    match node:
        case e.Call():
            return True
        case e.Builtin(name="norm"):
            return True
        case e.Builtin(name="near", args=(first, *_)):
            return is_array(first.type)
        case e.Builtin() | e.Unary() | e.Binary() | e.Items():
            return is_array(node.type)
        case e.Quantifier(kind="argmax" | "argmin"):
            return True
        case e.Quantifier(over=over):
            members = isinstance(over.type, Vector) and isinstance(over.type.element, Enum)
            return not members or any(term.is_costly for term in perhaps)
        case e.Choice() | e.Logic():
            return any(term.is_costly for term in perhaps)
    return False
