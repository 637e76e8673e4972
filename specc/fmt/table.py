"""Rows of a table below each other: cells padded to the widths of their columns."""

from __future__ import annotations

import re

_GAP = re.compile(r"\s{2,}")


def header_cells(comment: str, columns: int) -> list[str] | None:
    """The words over the columns, if a comment has as many of them, two blanks apart."""
    cells = _GAP.split(comment.removeprefix("#").strip())
    return cells if len(cells) == columns else None


def widths(rows: list[list[str]], header: list[str] | None) -> list[int]:
    """Width of every column with its comma and the blanks behind it."""
    found = [max(len(cell) + 2 for cell in column) for column in zip(*rows, strict=True)]
    if header:
        found = [max(width, len(cell) + 2) for width, cell in zip(found, header, strict=True)]
    return found


def row(cells: list[str], columns: list[int]) -> str:
    """A row in brackets."""
    padded = [f"{cell}, ".ljust(width) for cell, width in zip(cells, columns, strict=True)]
    return f"[{''.join(padded[:-1])}{cells[-1]}]"


def header_line(cells: list[str], columns: list[int]) -> str:
    """The comment over a table; its words stand over the cells of `- [a, b]`."""
    padded = [cell.ljust(width) for cell, width in zip(cells, columns, strict=True)]
    return f"#  {''.join(padded).rstrip()}"
