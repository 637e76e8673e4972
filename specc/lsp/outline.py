"""The lines that the last line of a text lies in, known by their indentation alone."""

from __future__ import annotations

import re

_LINE_BREAK = re.compile(r"\r\n|\r|\n")
_HEAD = re.compile(r"((?:- +)*)(\"[^\"]*\"|'[^']*'|[^\s\"'\[\]{}#:,&*!|>%@`][^:#]*?)\s*:(?=\s|$)")
_DASH = re.compile(r"(?:- +|-$)*")
_LEAVES_OPEN = re.compile(r":\s+(?:[|>][+\-\d]*\s*(?:#.*)?|[\[{\"'].*)$")
_PAIRS = {"]": "[", "}": "{"}


def outline(head: str) -> str:
    """The last line below the keys that it belongs to, and beside those next to it.

    Other values are dropped, so that no error in them matters. A value that the line above leaves
    open stays as it is.
    """
    lines = _LINE_BREAK.split(head)
    at = _begin(lines)
    kept = ["\n".join(lines[at:])]
    column, dashed = _column(lines[at])
    for line in reversed(lines[:at]):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        here, dash = _column(line)
        above = here < column or (here == column and dashed and not dash)
        if not above and here > column:
            continue
        step = _step(line, above)
        if step is not None:
            kept.append(step)
        if above:
            column, dashed = here, dash
    return "\n".join(reversed(kept))


def _begin(lines: list[str]) -> int:
    """The line on which the value begins that the last line goes on with."""
    last = len(lines) - 1
    column, _ = _column(lines[last]) if lines[last].strip() else (len(lines[last]), False)
    for number in range(last - 1, -1, -1):
        line = lines[number]
        if line.strip() and _column(line)[0] < column:
            return number if _stays_open(line) else last
    return last


def _stays_open(line: str) -> bool:
    found = _LEAVES_OPEN.search(line)
    if found is None:
        return False
    value = found.group().removeprefix(":").strip()
    if value[0] in "\"'":
        return value.count(value[0]) % 2 == 1
    return value[0] in "|>" or any(value.count(o) > value.count(c) for c, o in _PAIRS.items())


def _column(line: str) -> tuple[int, bool]:
    """Where a line begins, and whether it begins an item of a list."""
    return len(line) - len(line.lstrip(" ")), line.lstrip(" ").startswith("-")


def _step(line: str, above: bool) -> str | None:
    """A line as the key or item that it begins; None if it begins none."""
    begin = line[: _column(line)[0]]
    body = line[len(begin) :]
    found = _HEAD.match(body)
    if found and above:
        return f"{begin}{found.group(1)}{found.group(2)}:"
    if body.startswith("-"):
        return f"{begin}-" if above else f"{begin}- 0"
    return f"{begin}{found.group(2)}: 0" if found else None
