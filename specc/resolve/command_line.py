"""What the command line gives: texts in the place of those that files have for values."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import isfinite

from specc.model.types import Real, Type
from specc.model.units import DIMENSIONLESS
from specc.resolve.context import Cursor, Findings

_LONGEST_NUMBER = 100
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?"
_QUANTITY = rf"\s*({_NUMBER})\s*(?:\[([^\[\]]*)\])?\s*"


def quantity(text: str) -> tuple[Fraction, str] | None:
    """Number and unit of a value that is one, as written: `0.1[m/s]`."""
    found = re.fullmatch(_QUANTITY, text)
    if not found or len(found[1]) > _LONGEST_NUMBER or not isfinite(float(found[1])):
        return None
    return Fraction(found[1]), (found[2] or "").strip()


def in_unit(text: str, unit: str) -> str:
    """A value as written; a number without a unit gets this one, if it is not empty."""
    found = quantity(text) if unit else None
    return text if found is None or found[1] else f"{text.strip()}[{unit}]"


def _unit(written: str, declared: Type | None) -> str:
    """The unit in which a value is written, else that of the type it is declared with."""
    found = quantity(written)
    if found is not None and found[1]:
        return found[1]
    has_unit = isinstance(declared, Real) and declared.unit != DIMENSIONLESS
    return str(declared.unit) if isinstance(declared, Real) and has_unit else ""


@dataclass(eq=False, slots=True)
class SetValues:
    """`texts` are those of the command line, by the names of what they are values of.

    `copies` has the agents of each `for` with the name of them all, `units` everything that can be
    given, each with the unit of a number without one.
    """

    texts: Mapping[str, Cursor] = field(default_factory=dict)
    copies: Mapping[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)

    def of(self, name: str, written: str, declared: Type | None = None) -> Cursor | None:
        """The text to take instead of what a file has for a name, if there is one.

        Parameters of copies have a name that is their own, and one that they share.
        What has a name first keeps it: descriptions that use others come before these.
        """
        if name in self.units:
            return None
        agent, dot, rest = name.partition(".")
        shared = f"{self.copies.get(agent, agent)}{dot}{rest}"
        self.units[name] = unit = _unit(written, declared)
        self.units.setdefault(shared, unit)
        found = self.texts.get(name) or self.texts.get(shared)
        return found and replace(found, raw=in_unit(str(found.raw), unit))

    def report_unknown(self, findings: Findings) -> None:
        """Report names that are those of nothing."""
        for name, where in self.texts.items():
            if name not in self.units:
                code, what = _DOTTED if "." in name else _PLAIN
                known = [other for other in self.units if ("." in other) == ("." in name)]
                findings.unknown(code, what, name, known, where.key)


_PLAIN, _DOTTED = ("E0201", "constant"), ("E0210", "parameter")
