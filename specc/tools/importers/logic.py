"""Conditions of other formats: `and`, `or`, `not`, also as `&&`, `||`, `!`, over other texts.

What is read is an expression of the model; a name, or a text without `and`, `or` and `not`, is a
variable in it, which knows where it stands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from specc.lang import show
from specc.model.expr import (
    FALSE,
    TRUE,
    BoundVariable,
    Expr,
    Logic,
    Unary,
    junction,
    negation,
    truth,
    walk,
)
from specc.model.types import Bool

_DEEPEST = 50
_LONGEST = 4000
_TOKEN = re.compile(
    r"""\s*(?:
    (?P<and>and\b|&&) | (?P<or>or\b|\|\|) | (?P<not>not\b|!(?!=)) | (?P<open>\() | (?P<close>\))
    | (?P<atom>(?:"[^"]*"|'[^']*'|[^\s()&|!"']|!=|&(?!&)|\|(?!\|))
        (?:"[^"]*"|'[^']*'|\([^()]*\)|(?!\s+(?:and|or)\b)[^()&|!"']|!=)*)
    )""",
    re.VERBOSE,
)


class LogicError(Exception):
    """A text that is not a condition; `start` and `end` are offsets into it."""

    def __init__(self, message: str, start: int, end: int) -> None:
        super().__init__(message)
        self.message = message
        self.start = start
        self.end = end


def atom(text: str, start: int = 0) -> BoundVariable:
    """A name, or a text, that begins at an offset."""
    return BoundVariable(text, type=Bool(), span=(start, start + len(text)))


def parse_logic(text: str) -> Expr:
    """The structure of a condition; constants are `true` and `false` in any case.

    Raises:
        LogicError: the text is not a condition, or is nested too deep.
    """
    return _Parser(text).run()


def join(op: Literal["and", "or"], operands: Iterable[Expr]) -> Expr:
    """Operands joined; constants, repetition and nesting of the same operator are folded."""
    neutral = truth(op == "and")
    kept: dict[Expr, None] = {}
    for operand in operands:
        parts = operand.operands if isinstance(operand, Logic) and operand.op == op else (operand,)
        kept |= dict.fromkeys(parts)
    kept.pop(neutral, None)
    return negation(neutral) if negation(neutral) in kept else junction(op, tuple(kept))


def substitute(logic: Expr, values: dict[str, bool]) -> Expr:
    """`logic` with names replaced by truth values, simplified."""
    match logic:
        case BoundVariable(name=text) if text in values:
            return truth(values[text])
        case Unary(operand=operand):
            return negation(substitute(operand, values))
        case Logic(op=op, operands=operands):
            return join(op, (substitute(part, values) for part in operands))
    return logic


def atoms(logic: Expr) -> list[BoundVariable]:
    """The atoms of a condition from left to right."""
    return [part for part in walk(logic) if isinstance(part, BoundVariable)]


def render(logic: Expr, name: Callable[[str], str]) -> str:
    """The condition in the language of specifications; `name` gives the text of an atom.

    All that is joined gets brackets: nobody has to know what binds more tightly.
    """
    match logic:
        case BoundVariable(name=text):
            return name(text)
        case Unary(operand=operand):
            return f"not {_operand(operand, name)}"
        case Logic(op=op, operands=operands):
            return f" {op} ".join(_operand(part, name) for part in operands)
    return show(logic)


def _operand(logic: Expr, name: Callable[[str], str]) -> str:
    text = render(logic, name)
    return f"({text})" if isinstance(logic, Logic) else text


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int
    end: int


class _Parser:
    """Recursive descent: `or` binds less tightly than `and`, that less than `not`."""

    def __init__(self, text: str) -> None:
        self._length = len(text)
        self._tokens = list(_tokens(text))
        self._at = 0
        self._depth = 0

    def run(self) -> Expr:
        logic = self._either()
        if self._at < len(self._tokens):
            raise self._unexpected()
        return logic

    def _either(self) -> Expr:
        return self._joined("or", lambda: self._joined("and", self._single))

    def _joined(self, op: Literal["and", "or"], part: Callable[[], Expr]) -> Expr:
        operands = [part()]
        while self._take(op):
            operands.append(part())
        return join(op, operands)

    def _single(self) -> Expr:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise LogicError(f"nested more than {_DEEPEST} deep", 0, self._length)
        try:
            return self._innermost()
        finally:
            self._depth -= 1

    def _innermost(self) -> Expr:
        if self._take("not"):
            return negation(self._single())
        if self._take("open"):
            logic = self._either()
            if not self._take("close"):
                raise self._unexpected("`)`")
            return logic
        token = self._take("atom")
        if token is None:
            raise self._unexpected("a name")
        known = {"true": TRUE, "false": FALSE}.get(token.text.lower())
        return atom(token.text, token.start) if known is None else known

    def _take(self, kind: str) -> _Token | None:
        if self._at < len(self._tokens) and self._tokens[self._at].kind == kind:
            self._at += 1
            return self._tokens[self._at - 1]
        return None

    def _unexpected(self, wanted: str = "`and` or `or`") -> LogicError:
        if self._at < len(self._tokens):
            token = self._tokens[self._at]
            message = f"`{token.text}` is not expected here; expected {wanted}"
            return LogicError(message, token.start, token.end)
        return LogicError(f"the condition ends where {wanted} is expected", 0, self._length)


def _tokens(text: str) -> Iterator[_Token]:
    if len(text) > _LONGEST:
        raise LogicError(f"longer than {_LONGEST} characters", 0, len(text))
    at = 0
    while text[at:].strip():
        found = _TOKEN.match(text, at)
        if found is None:
            raise LogicError(f"`{text[at:].strip()[0]}` is not expected here", at, len(text))
        kind = found.lastgroup or ""
        word = found.group(kind)
        start = found.start(kind)
        yield _Token(kind, word.rstrip(), start, start + len(word.rstrip()))
        at = found.end()
