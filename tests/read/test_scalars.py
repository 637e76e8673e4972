"""Plain scalars by the core schema of YAML 1.2."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.read.compose import NumberRangeError, is_null, plain_value


@pytest.mark.parametrize("text", ["on", "off", "yes", "no", "y", "On", "NO", "nUll", "tRue"])
def test_words_of_older_yaml_are_text(text: str) -> None:
    assert plain_value(text) == text


@pytest.mark.parametrize("text", ["12:30", "2026-01-01", "1_000", "0b11", "500 Hz", "1.2.3", "-"])
def test_what_looks_nearly_like_a_number_is_text(text: str) -> None:
    assert plain_value(text) == text


@pytest.mark.parametrize(
    ("text", "value"),
    [("0o17", 15), ("0x1F", 31), ("017", 17), ("+3", 3), ("-.5", -0.5), ("1.", 1.0), ("1e3", 1e3)],
)
def test_numbers(text: str, value: float) -> None:
    assert plain_value(text) == value
    assert type(plain_value(text)) is type(value)


def test_special_numbers() -> None:
    assert plain_value("-.inf") == -math.inf
    assert plain_value(".Inf") == math.inf
    assert math.isnan(float(str(plain_value(".nan"))))


@pytest.mark.parametrize("text", ["", "~", "null", "NULL"])
def test_null(text: str) -> None:
    assert plain_value(text) is None
    assert is_null(text)


@pytest.mark.parametrize("text", ["9" * 5000, "0x" + "f" * 5000, "1e999", "-1e999", str(2**63)])
def test_a_number_that_does_not_fit_is_refused(text: str) -> None:
    with pytest.raises(NumberRangeError):
        plain_value(text)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_double_comes_back(number: float) -> None:
    assert plain_value(repr(number)) == number


@given(st.integers(-(2**63) + 1, 2**63 - 1))
def test_every_integer_of_64_bits_comes_back(number: int) -> None:
    assert plain_value(str(number)) == number
