"""Units of measure: their algebra, their names, and what is no unit."""

import math
from fractions import Fraction

import pytest
from hypothesis import strategies as st

from specc.lang.names import unit_error
from specc.model.units import (
    DIMENSIONLESS,
    KILOGRAM,
    METRE,
    NEWTON,
    NEWTON_METRE,
    SECOND,
    UNITS,
    Unit,
    UnitError,
    parse_unit,
)
from tests.seeds import drawn

FEW, MANY = 20, 200
"""Examples of a random test, and of a long one."""
COHERENT = [unit for unit in UNITS.values() if unit.is_coherent]


@st.composite
def units(draw: st.DrawFn) -> Unit:
    product = DIMENSIONLESS
    for _ in range(draw(st.integers(0, 3))):
        exponent = Fraction(draw(st.integers(-3, 3)), draw(st.sampled_from([1, 1, 1, 2])))
        product *= draw(st.sampled_from(COHERENT)) ** exponent
    return product


@drawn(units(), units(), units(), few=FEW, many=MANY)
def test_units_are_a_group(a: Unit, b: Unit, c: Unit) -> None:
    assert a * b == b * a
    assert (a * b) * c == a * (b * c)
    assert a * DIMENSIONLESS == a
    assert a / a == DIMENSIONLESS
    assert (a / b) * b == a


@drawn(units(), st.integers(-3, 3), st.integers(-3, 3), few=FEW, many=MANY)
def test_powers_add_and_multiply(a: Unit, n: int, k: int) -> None:
    assert a**n * a**k == a ** (n + k)
    assert (a**n) ** k == a ** (n * k)
    assert (a**2) ** Fraction(1, 2) == a


@drawn(units(), few=FEW, many=MANY)
def test_a_unit_reads_back_from_its_name(unit: Unit) -> None:
    assert parse_unit(str(unit)) == unit


def test_a_fraction_is_as_large_as_a_whole_exponent() -> None:
    assert parse_unit("s**(21/2)") == parse_unit("s**10 * s**(1/2)")
    with pytest.raises(UnitError, match="an exponent is a whole number up to 20"):
        parse_unit("s**(41/2)")


@pytest.mark.parametrize("name", UNITS)
def test_every_named_unit_is_a_multiple_of_the_one_it_is_shown_as(name: str) -> None:
    unit = parse_unit(name)
    assert parse_unit(str(unit)) == unit.coherent()
    assert math.isclose(unit.to_si(3.0), 3.0 * unit.scale)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("N", KILOGRAM * METRE / SECOND**2),
        ("kg*m/s**2", NEWTON),
        (" 1/s ", parse_unit("Hz")),
        ("N*m", NEWTON_METRE),
        ("mm/ms", METRE / SECOND),
        ("m**(1/2)", METRE ** Fraction(1, 2)),
        ("m**-2", METRE**-2),
        ("1", DIMENSIONLESS),
    ],
)
def test_spellings(text: str, unit: Unit) -> None:
    assert parse_unit(text) == unit


def test_an_angle_is_no_number_and_a_torque_no_energy() -> None:
    assert not parse_unit("rad").same_kind(DIMENSIONLESS)
    assert not NEWTON_METRE.same_kind(parse_unit("J"))
    assert parse_unit("deg").same_kind(parse_unit("rad"))


@pytest.mark.parametrize(
    ("number", "unit", "si"),
    [(1.1, "mm", 0.0011), (0.3, "kN", 300.0), (7.0, "us", 7e-6), (90.0, "deg", math.pi / 2)],
)
def test_si_numbers_are_exact_to_the_last_digit(number: float, unit: str, si: float) -> None:
    assert parse_unit(unit).to_si(number) == si


@pytest.mark.parametrize(
    ("text", "message", "start", "end"),
    [
        ("foo", "unknown unit `foo`", 0, 3),
        ("  m/sec", "unknown unit `sec`", 4, 7),
        ("m +", "not a unit", 0, 3),
        ("", "not a unit", 0, 0),
        ("2*m", "not a unit", 0, 1),
        ("True", "not a unit", 0, 4),
        ("m + s", "not a unit", 0, 5),
        ("m**x", "an exponent is a whole number up to 20 or a fraction such as (1/2)", 3, 4),
        ("m**True", "an exponent is a whole number up to 20 or a fraction such as (1/2)", 3, 7),
        ("m**(1/0)", "an exponent is a whole number up to 20 or a fraction such as (1/2)", 4, 7),
        ("(m**9)**9", "the powers in this unit are too large", 0, 9),
        ("((km**9)**9)**9", "the powers in this unit are too large", 2, 7),
        ("Ω", "not a unit", 0, 1),
        ("m\0", "not a unit", 0, 2),
    ],
)
def test_what_is_no_unit(text: str, message: str, start: int, end: int) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(text)
    error = caught.value
    assert (error.message, error.start, error.end) == (message, start, end)


@pytest.mark.parametrize("text", ["(" * 150, "-" * 199 + "m", "m**" * 60 + "2", "m" * 10_000])
def test_absurd_texts_are_no_units_either(text: str) -> None:
    with pytest.raises(UnitError):
        parse_unit(text)


@drawn(st.text() | st.text("mskgN*/()1- .", max_size=30), few=FEW, many=MANY)
def test_random_texts_are_units_or_unit_errors(text: str) -> None:
    try:
        assert parse_unit(text).is_reasonable
    except UnitError as error:
        assert 0 <= error.start <= (len(text) if error.end is None else error.end) <= len(text)


@pytest.mark.parametrize(
    ("name", "meant"),
    [("sec", "s"), ("Meters", "m"), ("degrees", "deg"), ("rpm", "turn/min"), ("foos", "")],
)
def test_a_unit_that_is_written_out_is_known(name: str, meant: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(name)
    help = f"did you mean `{meant}`?" if meant else "for example `m`"
    assert unit_error(caught.value, len(name), "`m`").help == help
