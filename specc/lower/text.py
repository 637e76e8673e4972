"""Texts of a specification inside Python: they can end neither a docstring nor a comment."""

from __future__ import annotations

from specc.model.trace import Trace


def one_line(text: str) -> str:
    """`text` without line breaks and invisible characters."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def in_docstring(text: str) -> str:
    """`text` for the inside of a docstring in triple quotes, at whose end it must not stand."""
    return one_line(text).replace("\\", "\\\\").replace('""', '\\"\\"')


def docstring(*parts: str) -> str:
    """The parts that are not empty as one sentence, for the inside of a docstring."""
    said = ", ".join(part for part in map(in_docstring, parts) if part)
    if not said:
        return ""
    return said if said[-1] in ".!?" else f"{said}."


def comment(*parts: str) -> str:
    """The parts that are not empty for a comment; instructions to linters lose their sign."""
    return ", ".join(part for part in (one_line(p).replace("#", "") for p in parts) if part)


def traced(line: str, trace: Trace, *before: str) -> str:
    """`line` with a comment of what stands `before` and where it comes from."""
    said = comment(*before, str(trace))
    return f"{line}  # {said}" if said else line


def literal(value: object) -> str:
    """A text, number, boolean or tuple as Python writes it."""
    if isinstance(value, tuple):
        inside = ", ".join(map(literal, value))
        return f"({inside},)" if len(value) == 1 else f"({inside})"
    return repr(value)
