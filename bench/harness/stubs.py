"""Operators that do nothing, so that only the machine around them costs time.

Every value that is no plain number, text or tuple is one of two tokens, NEAR and FAR, and
comparing poses tells which. Random inputs then lead a machine through all of its states.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType, ModuleType
from typing import Any

MODES = (("u", "u", "g", "u", "u", "u"), ("c", "c", "u", "u", "u", "u"), ("s",) * 6)


class Token(float):
    """Stands for a number, an array or a record; arithmetic is that of numbers."""

    @property
    def c_d(self) -> Token:
        return self

    state = X_Bl = X_Br = c_d

    def __matmul__(self, other: Any) -> Token:
        return self

    def item(self, index: int) -> float:
        """As of an array."""
        return self


NEAR, FAR = Token(0.09), Token(5.0)


def _token(*_: Any) -> Token:
    return NEAR


def _first(value: Any, *_: Any) -> Any:
    return value


def _second(_: Any, value: Any) -> Any:
    return value


def _is_near(value: Any, *_: Any) -> bool:
    return value is NEAR


def _those_near(values: Any, *_: Any) -> tuple[Any, ...]:
    return tuple(value for value in values if value is NEAR)


_STUBS: dict[str, Callable[..., Any]] = {
    "DK": _first, "MJ": _first, "MD": _first, "DM": _first,
    "TO": _second, "US": _second,
    "GO": _those_near, "near_pose": _is_near, "finite": _first, "read_only": _first,
}  # fmt: skip
_REPLACED = ("specc_runtime.operators.", "specc_runtime.builtins")


@contextmanager
def stubbed(*modules: ModuleType) -> Iterator[None]:
    """Inside, the operators and builtins that the modules imported do nothing."""
    real = [(module, dict(vars(module))) for module in modules]
    try:
        for module, names in real:
            for name, value in names.items():
                if isinstance(value, FunctionType) and value.__module__.startswith(_REPLACED):
                    setattr(module, name, _STUBS.get(name, _token))
        yield
    finally:
        for module, names in real:
            vars(module).update(names)


def random_inputs(kind: type, steps: int, rng: random.Random, eager: float = 0.1) -> list[Any]:
    """Buffers of class `kind` in which something happens with the probability `eager`.

    Happening is: a flag is up, a Boolean is true (`busy` false), a token is FAR.
    """
    return [_random_buffer(kind, rng, eager) for _ in range(steps)]


def _random_buffer(kind: type, rng: random.Random, eager: float) -> Any:
    buffer = kind()
    for name in kind.__slots__:  # type: ignore[attr-defined]  # every class of buffers has them
        happens = rng.random() < eager
        setattr(buffer, name, _random_value(name, kind.__annotations__.get(name), happens, rng))
    if getattr(buffer, "fresh_c_T_d", False) and getattr(buffer, "fresh_c_b", False):
        buffer.fresh_c_b = False  # the flagship assumes that they never come together
    return buffer


def _random_value(name: str, annotation: str | None, happens: bool, rng: random.Random) -> Any:
    if name.startswith("fresh_") or annotation == "bool":
        return happens is not name.endswith("_busy")
    if annotation == "int":
        return rng.randrange(3)
    if name == "c_b":
        return rng.choice(MODES)
    if name == "k_O_c":
        return rng.choice(((), (NEAR,), (FAR,)))
    return FAR if happens else NEAR
