"""Bounds on the size of a compiled model, computed from its text alone."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, prod

MOST_ELEMENTS = 200_000
"""Of a model with its copies."""
MOST_NUMBERS = 100_000_000
"""Of one element: pixels of a texture, points of a height field, what `<size>` reserves."""
MOST_STEPS = 100_000
"""Of one solver, in each step of the simulation."""
STEPS_S = (1e-6, 1.0)
"""The shortest and the longest step of a simulation, s."""
MOST_BYTES = 500_000_000
"""Of all meshes, textures and height fields."""

_MOST_DIGITS = 18
_COPYING = ("replicate", "composite", "flexcomp")
_NUMBERS = {"texture": ("width", "height"), "hfield": ("nrow", "ncol")}
_RESERVED = ("njmax", "nconmax", "nstack", "nuserdata", "nkey")
_REPEATED = (
    "iterations",
    "ls_iterations",
    "noslip_iterations",
    "ccd_iterations",
    "sdf_iterations",
    "sdf_initpoints",
)
_UNITS = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}


def copies(tag: str, attributes: Mapping[str, str]) -> int:
    """How many copies an element makes of its content."""
    if tag not in _COPYING:
        return 1
    numbers = attributes.get("count", "").split(maxsplit=3)[:3]
    return max(1, prod(map(_whole, numbers)))


def excess(tag: str, attributes: Mapping[str, str]) -> str:
    """Why an element exceeds the bounds; empty if it does not."""
    if tag in _NUMBERS:
        numbers = prod(_whole(attributes.get(name, "")) for name in _NUMBERS[tag])
        if numbers > MOST_NUMBERS:
            return f"a <{tag}> of {_shown(numbers)} numbers; at most {MOST_NUMBERS:,} are read"
    if tag == "size":
        most = max((_whole(attributes.get(name, "")) for name in _RESERVED), default=0)
        if max(most, _bytes(attributes.get("memory", "")) // 10) > MOST_NUMBERS:
            return f"<size> reserves more than {MOST_NUMBERS:,} numbers"
    if tag == "option":
        return _of_options(attributes)
    return ""


def _of_options(attributes: Mapping[str, str]) -> str:
    for name in _REPEATED:
        if (steps := _whole(attributes.get(name, ""))) > MOST_STEPS:
            return f"{_shown(steps)} `{name}`; at most {MOST_STEPS:,} are made"
    asked_s = step_s(attributes.get("timestep", ""))
    least_s, most_s = STEPS_S
    if asked_s is not None and not least_s <= asked_s <= most_s:
        return f"a timestep of {asked_s:g} s; it is {least_s:g} to {most_s:g} s"
    return ""


def step_s(text: str) -> float | None:
    """The duration of a step; None for a text that is no positive number."""
    found = number(text)
    return found if found is not None and 0 < found < inf else None


def number(text: str) -> float | None:
    """The number that a text is; None for any other text."""
    try:
        return float(text)
    except ValueError:
        return None


def digits(text: str) -> int:
    """A number that is written in digits, 0 for any other text."""
    return int(text) if text.isdecimal() and len(text) <= _MOST_DIGITS else 0


def _whole(text: str) -> int:
    """A positive number, rounded down and cut at 1e18; 0 for any other text."""
    found = number(text)
    return int(min(found, 1e18)) if found is not None and found > 0 else 0


def _bytes(text: str) -> int:
    unit = _UNITS.get(text.strip()[-1:].upper(), 1)
    return _whole(text.strip().rstrip("KMGTPEkmgtpe")) * unit


def _shown(number: int) -> str:
    return f"{number:,}" if number < 10**12 else f"{float(number):.1g}"
