"""Which questions, and which parts of a conjunction, depend on each other.

Tables treat the variables of conditions as independent. Their proofs hold all the same; their
refutations are open where variables are computed from the same value.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from itertools import islice

from specc.lang.builtins import FUNCTIONS
from specc.limits import spend
from specc.model.expr import (
    LENGTH,
    Binary,
    BoundVariable,
    Builtin,
    Call,
    Choice,
    Compare,
    Component,
    Expr,
    FieldOf,
    Input,
    IsOneOf,
    Items,
    Logic,
    MemoryRef,
    Quantifier,
    Unary,
    children,
)
from specc.model.types import Int, Real, Spatial, Vector
from specc.proof.clock import ELAPSED
from specc.proof.formula import (
    Arrival,
    Atom,
    EnumItem,
    Formula,
    PoseDistance,
    Quantity,
    Variable,
    atoms_of,
)
from specc.proof.numbering import Numbering


def conjuncts(formulas: Iterable[Formula]) -> list[Formula]:
    """The parts of a conjunction of formulas."""
    return [p for f in formulas for p in (f.parts if f.kind == "and" else (f,))]


def variables_of(formulas: Iterable[Formula]) -> set[Variable]:
    """The variables that the formulas ask about."""
    return {atom.variable for atom in atoms_of(formulas)}


Variables = Callable[[Iterable[Formula]], Set[object]]
"""What formulas depend on; formulas with a common dependency are connected."""


def connected(
    parts: Sequence[Formula], seeds: Iterable[Formula], dependencies: Variables = variables_of
) -> list[Formula]:
    """The parts that are connected with the seeds, directly or through other parts.

    A constant is connected with everything.
    """
    places = _Index(dependencies((part,)) for part in parts)
    return [parts[place] for place in places.connected_with(dependencies(seeds))]


def components(
    parts: Sequence[Formula], dependencies: Variables = variables_of
) -> Iterator[list[Formula]]:
    """The parts in groups that have nothing to do with each other."""
    places = _Index(dependencies((part,)) for part in parts)
    for place, part in enumerate(parts):
        if place in places.remaining:
            places.remaining.remove(place)
            yield [part, *(parts[other] for other in places.connected_with(places.about[place]))]


class _Index:
    """Positions of parts by what they depend on; each is returned once."""

    def __init__(self, about: Iterable[Set[object]]) -> None:
        self.about = list(about)
        self.remaining = set(range(len(self.about)))
        self._constants = [place for place, names in enumerate(self.about) if not names]
        self._by_dependency: dict[object, list[int]] = {}
        for place, names in enumerate(self.about):
            for name in names:
                self._by_dependency.setdefault(name, []).append(place)

    def connected_with(self, seeds: Set[object]) -> list[int]:
        """The remaining constants, then what is connected with the seeds."""
        found = [place for place in self._constants if place in self.remaining]
        self._constants = []
        self.remaining.difference_update(found)
        reached, open_ = set[object](), set(seeds)
        while open_:
            places = {place for thing in open_ for place in self._by_dependency.get(thing, ())}
            near = sorted(places & self.remaining)
            self.remaining.difference_update(near)
            found += near
            reached |= open_
            open_ = {thing for place in near for thing in self.about[place]} - reached
        return found


# Which questions ask about values that are computed from the same ones.


_LOOKED_INTO = (
    IsOneOf, Binary, Choice, Compare, Component, Items, Logic, Quantifier, Unary
)  # fmt: skip


_MET_IN_A_STEP = 16
"""Things that are put together in about the time of a step of a proof."""
_MOST_LEAVES = 64
"""Parts of a comparison that are counted, in which lets may be many times over."""
_MOST_APART = 64
"""Components of a vector that are told apart; those of longer ones all count as related."""


class Dependencies:
    """Relations between the atoms of one subsystem."""

    def __init__(self, numbering: Numbering) -> None:
        self.numbering = numbering
        self._roots: dict[Atom, frozenset[object]] = {}

    def are_related(self, atoms: Sequence[Atom]) -> bool:
        """Whether some answers of the atoms may be impossible together."""
        met: dict[object, Variable] = {}
        for atom in atoms:
            variable = atom.variable
            if (
                isinstance(variable, Quantity)
                and self._is_computed_comparison(atom)
                and not self._takes_all_answers(atom)
            ):
                return True
            if any(met.setdefault(root, variable) != variable for root in self._roots_of(atom)):
                return True
        return False

    def of(self, formulas: Iterable[Formula]) -> set[object]:
        """The variables that formulas ask about, and what the answers depend on."""
        found: set[object] = set()
        for atom in atoms_of(formulas):
            found.add(atom.variable)
            roots = self._roots_of(atom)
            spend("proof", len(roots) // _MET_IN_A_STEP)
            found |= roots
        return found

    def _roots_of(self, atom: Atom) -> frozenset[object]:
        if atom not in self._roots:
            self._roots[atom] = frozenset(self._find_roots(atom))
        return self._roots[atom]

    def _find_roots(self, atom: Atom) -> Iterator[object]:
        """Numbers of what an answer is computed from, as far as the solver knows how."""
        variable = atom.variable
        if isinstance(variable, (PoseDistance, Arrival)):
            return
        if isinstance(variable, Quantity) and variable.kind == "periods":
            yield self.numbering.number(ELAPSED)
            return
        seen: set[int] = set()
        open_ = [variable.expr if isinstance(variable, EnumItem) else atom.expr]
        while open_:
            part = open_.pop()
            if part is None:
                continue
            if not spend("proof", 1):  # nothing more is decided then, whatever is related
                return
            expr = self._resolve(part)
            if id(expr) in seen or self._is_constant(expr):
                continue
            seen.add(id(expr))
            if isinstance(expr, Component) and _independent_components(
                whole := self._resolve(expr.value)
            ):
                yield self.numbering.number(whole), expr.index
                continue
            function = FUNCTIONS[expr.name] if isinstance(expr, Builtin) else None
            is_near = function is not None and function.compares and len(children(expr)) == 3
            has_term = is_near or (function is not None and function.term is not None)
            if isinstance(expr, _LOOKED_INTO) or has_term:
                open_ += children(expr)
                continue
            if not isinstance(expr, BoundVariable):
                yield (number := self.numbering.number(expr))
                yield from ((number, index) for index in range(_independent_components(expr)))
            if isinstance(expr, Builtin) and (expr.name == LENGTH or FUNCTIONS[expr.name].laws):
                open_ += expr.args
            elif isinstance(expr, Call) and any(arg.type.is_discrete for arg in expr.args):
                yield "operator", expr.operator
                open_ += [arg for arg in expr.args if arg.type.is_discrete]

    def _is_computed_comparison(self, atom: Atom) -> bool:
        """Whether a comparison of computed values may have fewer answers than its tests suggest."""
        match atom.expr:
            case Compare(left=a, right=b) if getattr(atom.variable, "kind", "") != "periods":
                computed: tuple[type[Expr], ...] = (Binary, Choice)
            case Builtin(name=name, args=(a, b, *_)) if FUNCTIONS[name].compares:
                computed = ()
            case _:
                return False
        for side in map(self._resolve, (a, b)):
            if self._is_constant(side):
                continue
            if isinstance(side, computed):
                return True
            if isinstance(side, Builtin):
                function = FUNCTIONS[side.name]
                if function.term is not None or function.laws is not None:
                    return True
        return False

    def _takes_all_answers(self, atom: Atom) -> bool:
        """Whether the sums that a comparison compares can differ by any amount, because one input
        or memory element occurs in them exactly once.
        """
        match atom.expr:
            case Compare(left=Builtin(args=(sum_,)) as size, right=right) if FUNCTIONS[
                size.name
            ].is_size and self._is_constant(right):
                compared: tuple[Expr, ...] = (sum_,)
            case Compare(left=left, right=right):
                compared = (left, right)
            case _:
                return False
        leaves = Counter(islice(self._leaves(compared), _MOST_LEAVES))
        whole = all(isinstance(side.type, Int) for side in compared)
        return leaves.total() < _MOST_LEAVES and any(
            leaves[self.numbering.number(self._container(summand))] == 1
            for side in compared
            for summand in self._summands(side)
            if isinstance(self._container(summand), Input | MemoryRef)
            and (whole or isinstance(summand.type, Real))
        )

    def _leaves(self, exprs: Iterable[Expr]) -> Iterator[int]:
        """Numbers of what expressions are made of, through lets, as often as it is there."""
        open_ = list(exprs)
        while open_:
            expr = self._resolve(open_.pop())
            parts = children(expr)
            open_ += parts
            if not parts:
                yield self.numbering.number(expr)

    def _summands(self, expr: Expr) -> Iterator[Expr]:
        """What is added up, or subtracted."""
        open_ = [expr]
        while open_:
            match part := self._resolve(open_.pop()):
                case Unary(op="-") | Binary(op="+" | "-"):
                    open_ += children(part)
                case _:
                    yield part

    def _container(self, expr: Expr) -> Expr:
        """The value that an expression is a component or field of; otherwise the expression."""
        while isinstance(expr, Component | FieldOf):
            expr = self._resolve(expr.value)
        return expr

    def _resolve(self, expr: Expr) -> Expr:
        return self.numbering.resolve(expr)

    def _is_constant(self, expr: Expr) -> bool:
        """Whether an expression is one value, which relates no variables with each other."""
        return self.numbering.constant_value(self.numbering.number(expr)) is not None


def _independent_components(expr: Expr) -> int:
    """The number of components of which none constrains another; 0 if they are not told apart."""
    if not isinstance(expr, Input | MemoryRef):
        return 0
    if isinstance(expr.type, Spatial):
        return len(expr.type.components)
    return expr.type.size if isinstance(expr.type, Vector) and expr.type.size <= _MOST_APART else 0
