"""Proof that two subsystems do the same: same rows, states, outputs and memory at every step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


class Different(AssertionError):
    """Two subsystems that should do the same do not; the message says where they part."""


def check_same(one: Any, other: Any, inputs: Iterable[tuple[Any, Any]], sends: Sends) -> int:
    """Number of states visited while both step through `inputs`, a pair of buffers each.

    `sends` gives the output elements of each state, as generated classes do.

    Raises:
        Different: at the first step whose row, state, output or memory differs.
    """
    visited = set()
    for number, (one.x, other.x) in enumerate(inputs):
        rows = one.step(), other.step()
        here = f"step {number}, states {one.state!r} and {other.state!r}"
        if rows[0] != rows[1] or one.state != other.state:
            raise Different(f"{here}: rows {rows[0]} and {rows[1]}")
        visited.add(one.state)
        for buffer, names in (("y", sends[one.state]), ("memory", one.memory.__slots__)):
            for name in names:
                values = [getattr(getattr(side, buffer), name) for side in (one, other)]
                if not same(*values):
                    raise Different(f"{here}: {buffer}.{name} is {values[0]} and {values[1]}")
    return len(visited)


Sends = Mapping[str, tuple[str, ...]]


def same(a: Any, b: Any) -> bool:
    """Whether two values of a specification are equal, with NaN equal to itself."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if is_dataclass(a):
        return all(same(getattr(a, part.name), getattr(b, part.name)) for part in fields(a))
    # Handles of the library that knows the masses of the arm have no equality worth the name.
    return type(a).__module__.startswith("pinocchio.") or bool(a == b)
