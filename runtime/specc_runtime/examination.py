"""Whether operators keep their word: `specc run --check-operators`.

An operator is a pure function: its result depends only on its arguments, it does not change them,
and it keeps no reference to what it returns. Each call is made twice, with equal arguments.
"""

from __future__ import annotations

import copy
import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from types import ModuleType
from typing import Any

import numpy as np

from specc_runtime.encoding import encode
from specc_runtime.wrong import Blamed

DEEPEST = 12
"""How many levels of a value are examined; opaque values may contain themselves."""


class WordBroken(Blamed):
    """An operator is not a pure function."""


def examine(module: ModuleType) -> None:
    """Have all operators of a generated module examined at every call from now on."""
    for name, value in list(vars(module).items()):
        if with_function := getattr(value, "with_function", None):
            setattr(module, name, with_function(_examined(f"operator {name}", value.__wrapped__)))


def _examined(origin: str, function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def call(*args: Any) -> Any:
        equal = tuple(map(_copied, args))
        result = function(*args)
        for index, (now, before) in enumerate(zip(args, equal, strict=True)):
            if not same(now, before):
                raise WordBroken(origin, f"changes its argument {index + 1}; copy it first")
        again = function(*equal)
        if not same(result, again):
            raise WordBroken(
                origin, "returns two results for equal arguments; pass state as an argument"
            )
        if any(np.shares_memory(a, b) for a, b in itertools.product(_owned(result), _owned(again))):
            raise WordBroken(origin, "keeps an array that it returns; return a copy")
        return result

    return call


def same(a: Any, b: Any, depth: int = DEEPEST) -> bool:
    """Whether two values are of one type and equal to the last bit.

    What has neither an encoding nor parts is taken for equal.
    """
    if type(a) is not type(b):
        return False
    try:
        return encode(a) == encode(b)
    except TypeError:
        pairs = itertools.zip_longest(_parts(a), _parts(b)) if depth else ()
        return all(same(p, q, depth - 1) for p, q in pairs)


def _parts(value: Any) -> Iterator[Any]:
    if isinstance(value, tuple | list):
        yield from value
    elif isinstance(value, dict):
        yield from itertools.chain.from_iterable(value.items())
    elif is_dataclass(value):
        yield from (getattr(value, part.name, None) for part in fields(value))
    else:
        yield from getattr(value, "__dict__", {}).values()


def _owned(value: Any, depth: int = DEEPEST) -> Iterator[np.ndarray[Any, Any]]:
    """Arrays in a value that somebody could still change."""
    if isinstance(value, np.ndarray):
        if value.flags.writeable:
            yield value
    elif depth:
        for part in _parts(value):
            yield from _owned(part, depth - 1)


def _copied(value: Any) -> Any:
    """An equal value, as far as values of its class can be copied."""
    try:
        return copy.deepcopy(value)
    except Exception:  # noqa: BLE001  # classes of opaque values are anybody's
        return value
