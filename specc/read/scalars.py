"""What a plain scalar means: the core schema of YAML 1.2 (10.3.2).

`on`, `off`, `yes` and `no` are text, as are sexagesimal numbers and dates.
"""

import math
import re
from collections.abc import Callable

_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(_NULLS, None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_NUMBER_STARTS = frozenset("+-.0123456789")
_FORMS: tuple[tuple[re.Pattern[str], Callable[[str], int | float]], ...] = (
    (re.compile(r"[-+]?[0-9]+"), int),
    (re.compile(r"0o[0-7]+"), lambda text: int(text[2:], 8)),
    (re.compile(r"0x[0-9a-fA-F]+"), lambda text: int(text[2:], 16)),
    (re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"), float),
)
_INFINITY = re.compile(r"[-+]?\.(?:inf|Inf|INF)")
_NOT_A_NUMBER = frozenset((".nan", ".NaN", ".NAN"))

# Longer ones are out of range or a mistake, and int() of a very long text is slow.
_MOST_DIGITS = 400
_LARGEST_INT = 2**63 - 1


class NumberRangeError(ValueError):
    """A number that neither a double nor an integer of 64 bits can hold."""


def plain_value(text: str) -> str | int | float | bool | None:
    """Value of an unquoted scalar.

    Raises:
        NumberRangeError: the text is a number beyond 64 bits, a double or 400 digits.
    """
    if text in _WORDS:
        return _WORDS[text]
    return _number(text) if text[0] in _NUMBER_STARTS else text


def is_null(text: str) -> bool:
    """Whether an unquoted scalar stands for no value."""
    return text in _NULLS


def _number(text: str) -> str | int | float:
    for pattern, convert in _FORMS:
        if pattern.fullmatch(text):
            if len(text) > _MOST_DIGITS:
                raise NumberRangeError(text)
            return _in_range(convert(text), text)
    if _INFINITY.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    return math.nan if text in _NOT_A_NUMBER else text


def _in_range(number: int | float, text: str) -> int | float:
    too_large = abs(number) > _LARGEST_INT if isinstance(number, int) else math.isinf(number)
    if too_large:
        raise NumberRangeError(text)
    return number
