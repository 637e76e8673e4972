"""What is known of rounded results: they keep order with every float, and are not far off."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import z3

MOST_ORDERED = 3000
"""Pairs of numbers whose order is kept; beyond them a question is too large."""
_HALF_ULP = Fraction(1, 2**53)
_HALF_SMALLEST = Fraction(1, 2**1075)
_LARGEST = Fraction(2**1024 - 2**971)


class Rounding:
    """Floats and results of operations on them, which are the exact results, rounded.

    Every run satisfies the facts: rounding to nearest keeps order, and leaves floats as they are.
    An infinity satisfies them as a number larger than all others do. `exact` leaves rounding out.
    """

    def __init__(self, exact: bool) -> None:
        self._exact = exact
        self._floats: dict[int, Any] = {}
        self._results: dict[object, tuple[Any, Any]] = {}
        self._facts: list[Any] = []

    def float(self, term: Any) -> Any:
        """The term itself, which stands for a float."""
        self._floats[term.get_id()] = term
        return term

    def rounded(
        self, key: object, exact: Any, *, is_exact: bool = False, is_sum: bool = False
    ) -> Any:
        """The result of an operation; `key` names it. It `is_exact` if it is a float.

        A sum or difference of two floats is a multiple of the smallest one, so it does not vanish.
        """
        if self._exact:
            return exact
        if key not in self._results:
            self._results[key] = exact, (result := z3.Real(f"rounded {key}"))
            least = 0 if is_sum or is_exact else _HALF_SMALLEST
            self._facts.append(_is_close(exact, result, 0 if is_exact else _HALF_ULP, least))
        return self._results[key][1]

    @property
    def is_large(self) -> bool:
        """Whether there is too much to be in order."""
        results = len(self._results)
        return results * (results + len(self._floats)) > MOST_ORDERED

    def facts(self) -> list[Any]:
        """Facts about all results."""
        found = list(self._facts)
        results = list(self._results.values())
        for index, (exact, result) in enumerate(results):
            others = [*((t, t) for t in self._floats.values()), *results[:index]]
            for other_exact, other in others:
                found.append(z3.Implies(exact <= other_exact, result <= other))
                found.append(z3.Implies(exact >= other_exact, result >= other))
            for _, other in results:  # a result is a float
                if other is not result:
                    found.append(z3.Implies(exact <= other, result <= other))
                    found.append(z3.Implies(exact >= other, result >= other))
        return found


def _is_close(exact: Any, result: Any, relative: Fraction | int, least: Fraction | int) -> Any:
    size = z3.If(exact < 0, -exact, exact)
    error = z3.If(exact < result, result - exact, exact - result)
    bound = constant(relative) * size + constant(least)
    largest = constant(_LARGEST)
    return z3.And(
        z3.Implies(size <= largest, error <= bound),
        z3.Implies(exact > largest, result >= largest),
        z3.Implies(-exact > largest, -result >= largest),
    )


def constant(value: float | Fraction) -> Any:
    """The term of a finite number."""
    return z3.RealVal(str(Fraction(value)))
