"""Operators of the probe in `test_clashing_names.py`, and the class of its record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, make_dataclass
from pathlib import Path
from typing import Any

Item: Any = None
"""The class of the record; `define` makes it."""


def define(names: Iterable[str]) -> None:
    """Give the record a width and fields of some names."""
    global Item
    Item = make_dataclass("Item", [(name, float) for name in ("p_width", *names)], frozen=True)


def item(*widths: float) -> Any:
    """An item."""
    return Item(**{field.name: 0.5 for field in fields(Item)})


def same(width: float) -> float:
    """The same width."""
    return width


def length(path: str) -> float:
    """One for each file that is there."""
    return float(Path(path).exists())


def __getattr__(name: str) -> Any:
    """Any other name is one of the same width."""
    if name == "__path__":
        raise AttributeError(name)
    return same
