"""Constants whose arithmetic has no result, so that nothing is known of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from specc.lang.evaluate import Environment, evaluate
from specc.model.expr import Call, ConstantRef, FileRef, has_unknown, walk
from specc.model.system import Constant


def valueless(constants: Iterable[Constant]) -> Iterator[tuple[Constant, str]]:
    """Each with the reason; what operators and files give is known when the system is built."""
    values: dict[str, Any] = {}
    for constant in constants:
        if not _is_known(constant, values):
            values.pop(constant.name, None)
            continue
        try:
            values[constant.name] = _finite(evaluate(constant.value, Environment(constants=values)))
        except (ArithmeticError, ValueError) as error:
            yield constant, _why(error)


def _is_known(constant: Constant, values: dict[str, Any]) -> bool:
    nodes = tuple(walk(constant.value))
    names = {node.name for node in nodes if isinstance(node, ConstantRef)}
    given = any(isinstance(node, (Call, FileRef)) for node in nodes)
    return not given and names <= values.keys() and not has_unknown(constant.value)


def _why(error: Exception) -> str:
    match error:
        case OverflowError():
            return "it is too large"
        case ZeroDivisionError():
            return "it divides by zero"
    return "it takes a root of a negative number" if "domain" in str(error) else str(error)


def _finite(value: Any) -> Any:
    """The value; raises OverflowError if a number in it is not finite."""
    for part in value if isinstance(value, tuple) else (value,):
        if isinstance(part, tuple):
            _finite(part)
        elif isinstance(part, float) and math.isinf(part):
            raise OverflowError
    return value
