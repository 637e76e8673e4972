"""What the operators of random specifications compute: pure functions, here and nowhere else."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True)
class Reading:
    """A record of random specifications."""

    d: float
    mode: str


def _mixed(*args: Any) -> int:
    """A number that the arguments decide; -0.0 counts as 0.0."""
    text = ";".join(_text(a) for a in args)
    return zlib.crc32(text.encode())


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return f"[{','.join(map(_text, value))}]"
    if isinstance(value, Reading):
        return f"{_text(value.d)}:{value.mode}"
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return repr(float(value) + 0.0)
    return repr(value)


def widen(d_m: float, ratio: float) -> float:
    """A length, 0 where the arguments are no numbers."""
    product = d_m * ratio
    return product if math.isfinite(product) else 0.0


def far(d_m: float) -> bool:
    """Whether a length is more than a metre."""
    return d_m > 1.0


def holds(q: Any) -> bool:
    """An arbitrary property of a vector."""
    return _mixed("holds", q) % 2 == 0


def choose(mode: str, n: int) -> str:
    """A mode."""
    return "ucgs"[_mixed("choose", mode, n) % 4]


def readings(n: int) -> tuple[Reading, ...]:
    """Up to three readings."""
    seed = _mixed("readings", n)
    return tuple(
        Reading((seed >> i) % 17 / 8 - 1, "ucgs"[(seed >> i) % 4]) for i in range(seed % 4)
    )


def best(found: Any) -> Reading:
    """The first reading, or one in place of it."""
    return found[0] if found else Reading(0.5, "c")


def turned(X: Any, n: int) -> Any:
    """A pose turned about z by quarters."""
    c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[n % 4]
    turn = ((c, -s, 0.0, 0.0), (s, c, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    rows = [
        tuple(
            sum(float(row[k]) * turn[k][j] for k in range(3)) + (float(row[3]) if j == 3 else 0.0)
            for j in range(4)
        )
        for row in tuple(X)[:3]
    ]
    return (*rows, (0.0, 0.0, 0.0, 1.0))


def turned_array(X: Any, n: int) -> Any:
    """`turned` for generated code."""
    return np.array(turned(X.tolist(), n))


def turn(n: int) -> Any:
    """Quarters of a turn about z."""
    return turned(((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)), n)


def turn_array(n: int) -> Any:
    """`turn` for generated code."""
    return np.array(turn(n))


def raw(numbers: Any) -> Any:
    """Between a plant and a device; never called, the plants of the tests need it not."""
    raise NotImplementedError(numbers)


PLAIN = {
    "widen": widen, "far": far, "holds": holds, "choose": choose, "readings": readings,
    "best": best, "turned": turned, "turn": turn,
}  # fmt: skip
"""The operators by name, on plain values."""
SIGNATURES = {
    "widen": ("(d: real[m], ratio: real) -> real[m]", "widen"),
    "far": ("(d: real[m]) -> bool", "far"),
    "holds": ("(q: vector[3, m]) -> bool", "holds"),
    "choose": ("(mode: Mode, n: int) -> Mode", "choose"),
    "readings": ("(n: int) -> list[Reading]", "readings"),
    "best": ("(found: list[Reading]) -> Reading", "best"),
    "turned": ("(X: pose[B, E], n: int) -> pose[B, E]", "turned_array"),
    "turn": ("(n: int) -> pose[E, E]", "turn_array"),
}
"""Name -> signature in a specification, function in this module."""


RAISING = ("widen", "far", "holds", "choose", "readings", "best", "turned")


def rarely_raising(name: str) -> Callable[..., Any]:
    """The operator, but for some arguments it raises."""
    operator = PLAIN[name]

    def raises(*args: Any) -> Any:
        if _mixed("raises", name, *args) % 7 == 0:
            raise ValueError(name)
        return operator(*args)

    return raises
