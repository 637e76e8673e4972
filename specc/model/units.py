"""Units of measure as exponents of base units, with a scale to the coherent SI unit.

Radian and joule are base units here although SI derives them: an angle is not a plain number and
a torque (N*m) is not an energy (J). See docs/decisions/0002-units.md.
"""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from fractions import Fraction

Dimensions = tuple[tuple[str, Fraction], ...]


class UnitError(ValueError):
    """A text that is not a unit; `start` and `end` are offsets into it."""

    def __init__(self, message: str, start: int = 0, end: int | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.start = start
        self.end = end


@dataclass(frozen=True, slots=True)
class Unit:
    """A product of powers of base units times `scale` (1.0 for a coherent unit)."""

    dimensions: Dimensions = ()
    scale: float = 1.0

    def __mul__(self, other: Unit) -> Unit:
        exponents = dict(self.dimensions)
        for base, exponent in other.dimensions:
            exponents[base] = exponents.get(base, Fraction(0)) + exponent
        return _unit(exponents, self.scale * other.scale)

    def __pow__(self, exponent: int | Fraction) -> Unit:
        power = Fraction(exponent)
        return _unit({b: e * power for b, e in self.dimensions}, self.scale ** float(power))

    def __truediv__(self, other: Unit) -> Unit:
        return self * other**-1

    @property
    def is_coherent(self) -> bool:
        """Whether a number in this unit is an SI number."""
        return math.isclose(self.scale, 1.0)

    def same_kind(self, other: Unit) -> bool:
        """Whether quantities in the two units may be added and compared."""
        return self.dimensions == other.dimensions

    def __str__(self) -> str:
        return _NAMES.get(self.dimensions) or _spell(self.dimensions)


def _unit(exponents: dict[str, Fraction], scale: float) -> Unit:
    kept = tuple(sorted((b, e) for b, e in exponents.items() if e))
    return Unit(kept, scale)


def _spell(dimensions: Dimensions) -> str:
    above = [_power(b, e) for b, e in dimensions if e > 0]
    below = [_power(b, -e) for b, e in dimensions if e < 0]
    return "/".join(["*".join(above) or "1", *below])


def _power(base: str, exponent: Fraction) -> str:
    return base if exponent == 1 else f"{base}**{exponent}"


DIMENSIONLESS = Unit()
_BASE = {name: Unit(((name, Fraction(1)),)) for name in ("m", "kg", "s", "A", "K", "rad", "J", "px")}
METRE, KILOGRAM, SECOND, AMPERE, RADIAN = (_BASE[b] for b in ("m", "kg", "s", "A", "rad"))
NEWTON = KILOGRAM * METRE / SECOND**2
NEWTON_METRE = NEWTON * METRE
HERTZ = SECOND**-1


def _table() -> dict[str, Unit]:
    units = dict(_BASE)
    units |= {"N": NEWTON, "Hz": HERTZ, "Pa": NEWTON / METRE**2}
    units |= {"W": _BASE["J"] / SECOND, "V": _BASE["J"] / (AMPERE * SECOND)}
    units["Ohm"] = units["V"] / AMPERE
    for name, scale, of in (
        ("mm", 1e-3, "m"), ("cm", 1e-2, "m"), ("km", 1e3, "m"), ("g", 1e-3, "kg"),
        ("ms", 1e-3, "s"), ("us", 1e-6, "s"), ("min", 60.0, "s"), ("mA", 1e-3, "A"),
        ("mN", 1e-3, "N"), ("kN", 1e3, "N"), ("kHz", 1e3, "Hz"), ("mV", 1e-3, "V"),
        ("deg", math.pi / 180, "rad"), ("mrad", 1e-3, "rad"), ("turn", 2 * math.pi, "rad"),
    ):  # fmt: skip
        units[name] = Unit(units[of].dimensions, scale)
    return units


UNITS = _table()
"""Unit name -> unit, for every name that a specification may use."""
_NAMES = {u.dimensions: n for n, u in UNITS.items() if u.is_coherent and n not in ("Hz", "px")}
_NAMES |= {NEWTON_METRE.dimensions: "N*m", (): "1"}


def parse_unit(text: str) -> Unit:
    """Parse `m/s`, `kg*m**2/s` or `1`; raises `UnitError` with offsets into `text`."""
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        raise UnitError(f"{text!r} is not a unit", 0, len(text)) from error
    return unit_of(tree)


def unit_of(node: ast.expr) -> Unit:
    """The unit that a parsed expression spells; raises `UnitError`."""
    match node:
        case ast.Name(id=name) if name in UNITS:
            return UNITS[name]
        case ast.Constant(value=1):
            return DIMENSIONLESS
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return unit_of(left) * unit_of(right)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return unit_of(left) / unit_of(right)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return unit_of(left) ** _exponent(right)
    name = f"unknown unit {node.id!r}" if isinstance(node, ast.Name) else "not a unit"
    raise UnitError(name, node.col_offset, node.end_col_offset)


def _exponent(node: ast.expr) -> int:
    match node:
        case ast.Constant(value=int(value)) if abs(value) <= 9:
            return value
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int(value))) if value <= 9:
            return -value
    raise UnitError("an exponent is a whole number", node.col_offset, node.end_col_offset)
