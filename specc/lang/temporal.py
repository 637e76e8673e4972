"""Temporal formulas to syntax trees: `p implies q` is read as a call before Python's syntax is."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from types import MappingProxyType

from specc.diagnostics import nearest
from specc.lang.builtins import BUILTIN_NAMES
from specc.lang.errors import ExprError, did_you_mean
from specc.lang.parse import nodes_of, parse, span

TIMED = ("within", "throughout", "once", "historically")
USAGE = MappingProxyType(
    {name: f"{name}(0.2[s], p)" for name in TIMED}
    | {"always": "always(p)", "since": "since(p, q)", "implies": "p implies q"}
)
"""The operators of formulas and how each is written."""
_TOKEN = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)*'|\b(?:implies|for)\b|[()\[\]{},]")


def parse_formula(text: str) -> ast.expr:
    """The syntax tree of a formula, one's own to change; raises `ExprError`."""
    if not re.search(r"\bimplies\b", text):
        return parse(text, own=True)
    written, origins = _implies_as_calls(text)
    try:
        tree = parse(written, own=True)
    except ExprError as error:
        start, end = _original(origins, error.start, error.end)
        raise ExprError(error.message, start, end, error.help, error.code) from None
    for node in nodes_of(tree):
        if isinstance(node, ast.expr | ast.keyword):
            begin, end = node.col_offset, node.end_col_offset or node.col_offset
            node.col_offset, node.end_col_offset = _original(origins, begin, end)
    return tree


def refuse_misspelling(node: ast.expr, operators: Iterable[str]) -> None:
    """Raise `ExprError` for a call of what is meant to be an operator of formulas."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        name, known = node.func.id, {*operators, *BUILTIN_NAMES, "state"}
        close = () if name in known else nearest(name, [*known, *USAGE])
        if not USAGE.keys().isdisjoint(close):
            help = did_you_mean(close)
            error = ExprError(f"unknown operator `{name}`", *span(node.func), help, "E0202")
            raise error.with_suggestions(name, close)


def _original(origins: list[int], start: int, end: int) -> tuple[int, int]:
    last = len(origins) - 1
    return origins[min(start, last)], origins[min(max(end - 1, 0), last)] + 1


def _implies_as_calls(text: str) -> tuple[str, list[int]]:
    """The text with each `p implies q` as `implies(p, q)`, and whence each character comes.

    It binds weaker than anything else and to the right: `p implies (q implies r)`.
    """
    out: list[tuple[str, int]] = []
    operand_starts, open_calls = (
        [0],
        [0],
    )  # by bracket: where the last operand begins, calls to close

    def close(at: int) -> None:
        out.extend((")", max(at - 1, 0)) for _ in range(open_calls[-1]))
        open_calls[-1] = 0

    done = 0
    for token in _TOKEN.finditer(text):
        place, word = token.start(), token[0]
        out += [(char, done + i) for i, char in enumerate(text[done:place])]
        done = token.end()
        if word == "implies" and any(not char.isspace() for char, _ in out[operand_starts[-1] :]):
            first = out[operand_starts[-1]][1]
            out[operand_starts[-1] : operand_starts[-1]] = [(char, first) for char in "implies("]
            out.append((",", place))
            open_calls[-1] += 1
            operand_starts[-1] = len(out)
            continue
        if word in (")", "]", "}", ",", "for"):  # of a quantifier: what it says is over
            close(place)
        out += [(char, place + i) for i, char in enumerate(word)]
        if word in "([{":
            operand_starts.append(len(out))
            open_calls.append(0)
        elif word in ")]}" and len(operand_starts) > 1:
            operand_starts.pop()
            open_calls.pop()
        elif word == ",":
            operand_starts[-1] = len(out)
    out += [(char, done + i) for i, char in enumerate(text[done:])]
    close(len(text))
    return "".join(char for char, _ in out), [origin for _, origin in out]
