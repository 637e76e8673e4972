"""Whether what users provide keeps its word.

Plants, scenes and judges can be called as a run calls them: the protocols say how, and they are the
only place that says so.

Operators are pure functions (`specc run --check-operators`): a result depends only on the
arguments, which are not changed, and no reference to it is kept. Each call is made twice, with
equal arguments.
"""

from __future__ import annotations

import copy
import functools
import inspect
import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from specc_runtime.records import encode
from specc_runtime.wrong import Blamed

_POSTPONED = (inspect.iscoroutinefunction, inspect.isasyncgenfunction, inspect.isgeneratorfunction)
"""Calls of such functions return before anything of them has been done."""


def shortcomings(thing: object, protocol: type, but: str = "") -> list[str]:
    """What an object lacks of a protocol: attributes, methods, methods with its parameters.

    `but`: a method that it need not have.
    """
    found = [_attribute(thing, name) for name in _attributes(protocol)]
    found += [_method(thing, f) for f in _methods(protocol) if f.__name__ != but]
    return [text for text in found if text]


def refusal(function: Callable[..., Any], arguments: Sequence[str]) -> str:
    """Why a function cannot be called with so many positional arguments; empty if it can."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # written in C, and not saying what it takes
        return ""
    try:
        signature.bind(*arguments)
    except TypeError:
        return f"is called with ({', '.join(arguments)}), but takes {signature}"
    return ""


def _attributes(protocol: type) -> Iterator[str]:
    yield from (name for name in protocol.__annotations__ if not name.startswith("_"))


def _methods(protocol: type) -> Iterator[FunctionType]:
    for name, member in vars(protocol).items():
        if isinstance(member, FunctionType) and not name.startswith("_"):
            yield member


def _attribute(thing: object, name: str) -> str:
    return "" if hasattr(thing, name) else f"has no `{name}`"


def _method(thing: object, wanted: FunctionType) -> str:
    name, (_, *arguments) = wanted.__name__, inspect.signature(wanted).parameters
    member = getattr(thing, name, None)
    # A class derived from the protocol inherits methods that do nothing.
    if member is None or getattr(member, "__func__", None) is wanted:
        return f"has no method `{name}({', '.join(arguments)})`"
    if not callable(member):
        return f"has a `{name}` that is not a method"
    if any(is_postponed(member) for is_postponed in _POSTPONED):
        return f"has a `{name}` that is `async` or yields: a call of it does nothing"
    why = refusal(member, arguments)
    return f"has a `{name}` that {why}" if why else ""


DEEPEST = 12
"""How many levels of a value are examined; opaque values may contain themselves."""
_PLAIN = {bool, int, float, str, bytes, type(None)}
"""Values of these types have no parts."""


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
        owned = [*_owned(result)]
        if owned and any(np.shares_memory(a, b) for a in _owned(again) for b in owned):
            raise WordBroken(origin, "keeps an array that it returns; return a copy")
        return result

    return call


def same(a: Any, b: Any, depth: int = DEEPEST) -> bool:
    """Whether two values are of one type and equal to the last bit.

    What has neither an encoding nor parts is taken for equal.
    """
    if a is b or type(a) is not type(b):
        return a is b
    if type(a) is np.ndarray and not a.dtype.hasobject:
        is_alike = a.dtype.str == b.dtype.str and a.shape == b.shape
        return is_alike and bool(a.tobytes() == b.tobytes())
    if not (depth and (isinstance(a, tuple) or is_dataclass(a))):
        with suppress(TypeError):
            return encode(a) == encode(b)
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
    elif depth and type(value) not in _PLAIN:
        for part in _parts(value):
            yield from _owned(part, depth - 1)


def _copied(value: Any) -> Any:
    """An equal value, as far as values of its class can be copied."""
    try:
        return copy.deepcopy(value)
    except Exception:  # noqa: BLE001  # classes of opaque values are anybody's
        return value
