"""Whether plants, scenes and judges that users provide can be called as a run calls them.

The protocols say how; they are the only place that says so.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from types import FunctionType
from typing import Any

_POSTPONED = (inspect.iscoroutinefunction, inspect.isasyncgenfunction, inspect.isgeneratorfunction)
"""Calls of such functions return before anything of them has been done."""


def shortcomings(thing: object, protocol: type) -> list[str]:
    """What an object lacks of a protocol: attributes, methods, methods with its parameters."""
    found = [_attribute(thing, name) for name in _attributes(protocol)]
    found += [_method(thing, function) for function in _methods(protocol)]
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


def _method(thing: object, asked: FunctionType) -> str:
    name, (_, *arguments) = asked.__name__, inspect.signature(asked).parameters
    member = getattr(thing, name, None)
    # A class derived from the protocol inherits methods that do nothing.
    if member is None or getattr(member, "__func__", None) is asked:
        return f"has no method `{name}({', '.join(arguments)})`"
    if not callable(member):
        return f"has a `{name}` that is not a method"
    if any(is_postponed(member) for is_postponed in _POSTPONED):
        return f"has a `{name}` that is `async` or yields: a call of it does nothing"
    why = refusal(member, arguments)
    return f"has a `{name}` that {why}" if why else ""
