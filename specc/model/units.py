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

_LONGEST = 200
_LARGEST_EXPONENT = 20
_LARGEST_SCALE = 1e15


class UnitError(ValueError):
    """A text that is not a unit; `start` and `end` are offsets into it.

    `name` is the unknown unit, if that is what is wrong.
    """

    def __init__(
        self, message: str, start: int = 0, end: int | None = None, name: str = ""
    ) -> None:
        super().__init__(message)
        self.message = message
        self.start = start
        self.end = end
        self.name = name


@dataclass(frozen=True, slots=True)
class Unit:
    """A product of powers of base units times `scale` (1.0 for a coherent unit)."""

    dimensions: Dimensions = ()
    scale: float = 1.0

    def to_si(self, number: float) -> float:
        """The SI number of `number` in this unit; 1.1 mm is 0.0011 to the last digit."""
        per_si = round(1 / self.scale)
        if per_si > 1 and 1 / per_si == self.scale:
            return number / per_si
        return number * self.scale

    def coherent(self) -> Unit:
        """The SI unit of the same kind."""
        return Unit(self.dimensions)

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
        return self.scale == 1.0

    @property
    def is_reasonable(self) -> bool:
        """Whether exponents and scale are plausible for a quantity; a typing error has others."""
        largest = max((abs(e) for _, e in self.dimensions), default=Fraction(0))
        in_range = 1 / _LARGEST_SCALE < self.scale < _LARGEST_SCALE
        return largest <= _LARGEST_EXPONENT and in_range

    def same_kind(self, other: Unit) -> bool:
        """Whether quantities in the two units may be added and compared."""
        return self.dimensions == other.dimensions

    def __str__(self) -> str:
        """The coherent unit of this kind, in a spelling that `parse_unit` reads."""
        if name := _NAMES.get(self.dimensions):
            return name
        above = [_power(b, e) for b, e in self.dimensions if e > 0]
        below = [_power(b, -e) for b, e in self.dimensions if e < 0]
        return "/".join(["*".join(above) or "1", *below])


def _unit(exponents: dict[str, Fraction], scale: float) -> Unit:
    powers = tuple(sorted((b, e) for b, e in exponents.items() if e))
    return Unit(powers, 1.0 if math.isclose(scale, 1.0) else scale)


def _power(base: str, exponent: Fraction) -> str:
    if exponent == 1:
        return base
    return f"{base}**{exponent}" if exponent.denominator == 1 else f"{base}**({exponent})"


DIMENSIONLESS = Unit()
_BASE = {
    name: Unit(((name, Fraction(1)),)) for name in ("m", "kg", "s", "A", "K", "rad", "J", "px")
}
METRE, KILOGRAM, SECOND, AMPERE, RADIAN = (_BASE[b] for b in ("m", "kg", "s", "A", "rad"))
NEWTON = KILOGRAM * METRE / SECOND**2
NEWTON_METRE = NEWTON * METRE
HERTZ = SECOND**-1


def _all_units() -> dict[str, Unit]:
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


UNITS = _all_units()
"""Unit name -> unit, for every name that a specification may use."""
_NAMES = {u.dimensions: n for n, u in UNITS.items() if u.is_coherent and n not in ("Hz", "px")}
_NAMES |= {NEWTON_METRE.dimensions: "N*m", (): "1"}


def parse_unit(text: str) -> Unit:
    """Parse `m/s`, `kg*m**2/s` or `1`; raises `UnitError` with offsets into `text`."""
    bare = text.strip()
    if len(text) > _LONGEST or not text.isascii():
        raise UnitError("not a unit", 0, len(text))
    try:
        tree = ast.parse(bare, mode="eval").body
        return unit_of(tree)
    except UnitError as error:
        lead = text.index(bare)
        end = len(text) if error.end is None else lead + error.end
        raise UnitError(error.message, lead + error.start, end, error.name) from None
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise UnitError("not a unit", 0, len(text)) from error


def unit_of(node: ast.expr) -> Unit:
    """The unit that a parsed expression spells; raises `UnitError`."""
    match node:
        case ast.Name(id=name) if name in UNITS:
            return UNITS[name]
        case ast.Constant(value=int(value)) if value is not True and value == 1:
            return DIMENSIONLESS
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _reasonable(unit_of(left) * unit_of(right), node)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _reasonable(unit_of(left) / unit_of(right), node)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return _reasonable(unit_of(left) ** _exponent(right), node)
    name = node.id if isinstance(node, ast.Name) else ""
    message = f"unknown unit `{name}`" if name else "not a unit"
    raise UnitError(message, node.col_offset, node.end_col_offset, name)


def _reasonable(unit: Unit, node: ast.expr) -> Unit:
    if not unit.is_reasonable:
        message = "the powers in this unit are too large"
        raise UnitError(message, node.col_offset, node.end_col_offset)
    return unit


def _exponent(node: ast.expr, most: int = _LARGEST_EXPONENT) -> Fraction:
    match node:
        case ast.Constant(value=int(value)) if not isinstance(value, bool) and value <= most:
            return Fraction(value)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_exponent(operand, most)
        case ast.BinOp(left=left, op=ast.Div(), right=right) if below := _exponent(right):
            found = _exponent(left, most**2) / below
            if abs(found) <= most:
                return found
    raise UnitError(
        f"an exponent is a whole number up to {_LARGEST_EXPONENT} or a fraction such as (1/2)",
        node.col_offset,
        node.end_col_offset,
    )
