"""Types of results by the type of the argument, None for one that does not fit; and ways out."""

from __future__ import annotations

from fractions import Fraction

from specc.lang.mismatch import scalar_unit
from specc.model.types import Int, ListOf, Pose, Real, Type, Vector
from specc.model.units import DIMENSIONLESS, RADIAN


def inverted_pose(type: Type | None) -> Type | None:
    """`inverse(X)`."""
    return Pose(type.child, type.parent) if isinstance(type, Pose) else None


def real_element(type: Type) -> Real | None:
    """`norm(v)`."""
    return type.element if isinstance(type, Vector) and isinstance(type.element, Real) else None


def root_type(type: Type) -> Type | None:
    """`sqrt(a)`."""
    unit = scalar_unit(type)
    return None if unit is None else Real(unit ** Fraction(1, 2))


def list_length(type: Type) -> Type | None:
    """`len(list)`."""
    return Int() if isinstance(type, ListOf) else None


def ratio_type(type: Type) -> Type | None:
    """`sin(angle)`, `cos(angle)`."""
    return Real() if type == Real(RADIAN) else None


def number_type(type: Type) -> Type | None:
    """`abs(a)`."""
    return None if scalar_unit(type) is None else type


def sign_type(type: Type) -> Type | None:
    """`sign(a)`."""
    return None if scalar_unit(type) is None else Int()


def integer_type(type: Type) -> Type | None:
    """`floor(a)`, `round(a)`."""
    return Int() if scalar_unit(type) == DIMENSIONLESS else None


def angle_type(type: Type) -> Type | None:
    """`wrap_angle(angle)`."""
    return type if type == Real(RADIAN) else None


def unit_help(type: Type) -> str:
    """A way out for a number with a unit."""
    unit = scalar_unit(type)
    return "" if unit is None else f"a whole number has no unit; divide by one: `a / 1[{unit}]`"


def angle_help(type: Type) -> str:
    """A way out for what is no angle."""
    plain = scalar_unit(type) == DIMENSIONLESS
    return "an angle has a unit: `30[deg]`; multiply a plain number by `1[rad]`" if plain else ""


def fixed_length(type: Type) -> str:
    """What is known of a length without asking."""
    return f"its length is always {type.size}" if isinstance(type, Vector) else ""
