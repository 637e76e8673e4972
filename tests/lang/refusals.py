"""Reads and writes `rejected.txt`: expressions and everything that is said against them.

A block is an expression, `: type` if it is expected to be of one, and a finding per line pair.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from specc.lang import ExprErrors, Scope, enums_by_member, expression, parse_type
from specc.model.types import Enum
from tests.strategies import FINGERS, MODE, NAMES, SCOPE

FILE = Path(__file__).with_name("rejected.txt")
GEAR = Enum("Gear", ("u", "high"))
SCOPE_OF_TABLE: Scope = replace(SCOPE, enums=enums_by_member([MODE, FINGERS, GEAR]), files=("arm",))
_EXPECTED = " : "


class Block(NamedTuple):
    """An expression with the type expected of it, and the lines said about it."""

    head: str
    findings: str


def blocks() -> list[Block]:
    """The blocks of the table, in order."""
    found = []
    for part in FILE.read_text().split("\n\n"):
        lines = [line for line in part.splitlines() if not line.startswith("#")]
        if lines:
            found.append(Block(lines[0], "\n".join(lines[1:])))
    return found


def findings(head: str, scope: Scope = SCOPE_OF_TABLE) -> str:
    """What is said about the expression of a block; "" if it is accepted."""
    text, separator, type = head.rpartition(_EXPECTED)
    if not separator:
        text, type = head, ""
    try:
        expression(text, scope, parse_type(type, NAMES) if type else None)
    except ExprErrors as failure:
        return "\n".join(
            f"  {e.code} `{text[e.start : e.end]}`: {e.message}"
            + (f"\n        {e.help}" if e.help else "")
            for e in failure.errors
        )
    return ""
