"""Which parts of a conjunction have to do with each other: those that ask about one variable."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from specc.model.expr import Binary, Builtin, Call, Compare, Expr, Input, LetRef, MemoryRef, walk
from specc.proof.formula import Formula, atoms_of
from specc.proof.variables import Quantity, Variable

_COMPUTING = ("abs", "min", "max")


def conjuncts(formulas: Iterable[Formula]) -> list[Formula]:
    """The parts of a conjunction of formulas."""
    return [p for f in formulas for p in (f.parts if f.kind == "and" else (f,))]


def related(parts: Sequence[Formula], seeds: Iterable[Formula]) -> list[Formula]:
    """The parts that are connected with the seeds, directly or through other parts.

    A constant is connected with everything.
    """
    reached = variables_of(seeds)
    left = [(part, variables_of((part,))) for part in parts]
    found = [part for part, names in left if not names]
    while True:
        near = [(part, names) for part, names in left if names & reached]
        if not near:
            return found
        left = [item for item in left if item not in near]
        for part, names in near:
            found.append(part)
            reached |= names


def components(parts: Sequence[Formula]) -> Iterator[list[Formula]]:
    """The parts in groups that have nothing to do with each other."""
    left = list(parts)
    while left:
        group = [left[0], *related(left[1:], left[:1])]
        yield group
        left = [part for part in left if part not in group]


def variables_of(formulas: Iterable[Formula]) -> set[Variable]:
    """The variables that the formulas ask about."""
    return {atom.variable for atom in atoms_of(formulas)}


def has_related_sums(formulas: Iterable[Formula]) -> bool:
    """Whether a sum or product is compared whose parts are compared elsewhere as well."""
    sides: dict[Variable, set[object]] = {}
    is_sum = False
    for atom in atoms_of(formulas):
        if isinstance(atom.variable, Quantity) and isinstance(atom.expr, Compare):
            nodes = list(walk(atom.expr))
            is_sum |= atom.variable.kind == "difference" or any(map(_computes, nodes))
            sides.setdefault(atom.variable, set()).update(n for n in nodes if _is_leaf(n))
    found: set[object] = set()
    for leaves in sides.values() if is_sum else ():
        if found & leaves:
            return True
        found |= leaves
    return False


def _is_leaf(expr: Expr) -> bool:
    return isinstance(expr, (Input, MemoryRef, LetRef, Call))


def _computes(expr: Expr) -> bool:
    return isinstance(expr, Binary) or (isinstance(expr, Builtin) and expr.name in _COMPUTING)
