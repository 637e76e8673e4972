"""The parameters of the operator or function whose arguments are being written."""

from __future__ import annotations

import re
from dataclasses import dataclass

from specc.lang.builtins import FUNCTIONS
from specc.schema.places import role_of
from specc.tools.lsp.cursor import cursors, outside
from specc.tools.lsp.index import Index

_NAME = re.compile(r"[^\W\d]\w*$")
_TEXT = re.compile(r"\"[^\"]*\"|'[^']*'")


@dataclass(frozen=True, slots=True)
class CallSignature:
    """How a call is written; `active` counts the argument at the cursor from 0."""

    label: str
    parameters: tuple[str, ...]
    words: str
    active: int


def signature(index: Index | None, text: str, offset: int) -> CallSignature | None:
    """The innermost call around an offset of a text, however unfinished the call is."""
    for cursor in cursors(text, offset):
        role = role_of(cursor.route)
        if role is None or role.form not in ("constant", "initial", "full", "argument"):
            continue
        found = _call(_TEXT.sub(lambda match: "_" * len(match.group()), cursor.before))
        if found is not None:
            return _of(index, *found)
    return None


def _call(before: str) -> tuple[str, int] | None:
    """The name in front of the innermost open bracket, and the commas behind it."""
    commas = 0
    for at, char in outside(before):
        if char == ",":
            commas += 1
        elif char in "([{":
            name = _NAME.search(before, 0, at)
            if char == "(" and name:
                return name.group(), commas
            commas = 0
    return None


def _of(index: Index | None, name: str, active: int) -> CallSignature | None:
    operators = index.system.operators if index and index.system else ()
    operator = next((o for o in operators if o.name == name), None)
    if operator is not None:
        parameters = tuple(f"{n}: {type_}" for n, type_ in operator.parameters)
        words = " ".join(
            filter(None, [operator.title, f"({operator.trace})" if str(operator.trace) else ""])
        )
        return _signature(name, parameters, str(operator.result), words, active)
    function = FUNCTIONS.get(name)
    if function and function.rule:
        listed, _, said = function.signature.partition("-> ")
        result, _, words = said.partition(": ")
        parameters = tuple(filter(None, listed.strip().split(", ")))
        return _signature(name, parameters, result, words, active)
    return None


def _signature(
    name: str, parameters: tuple[str, ...], result: str, words: str, active: int
) -> CallSignature:
    label = f"{name}({', '.join(parameters)}) -> {result}"
    return CallSignature(label, parameters, words, min(active, max(len(parameters) - 1, 0)))
