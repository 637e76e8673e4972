"""Conditions of other formats: `and`, `or`, `not`, also as `&&`, `||`, `!`, over other texts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Literal

from specc.frozen import frozen

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


@frozen
class LogicConstant:
    """`TRUE` or `FALSE`."""

    value: bool


@frozen
class Operand:
    """A name, or a text without `and`, `or` and `not` in it; `start` is its offset."""

    text: str
    start: int = 0


@frozen
class Not:
    """`not operand`."""

    operand: Logic


@frozen
class Join:
    """Two or more operands, joined by `and` or by `or`."""

    op: Literal["and", "or"]
    operands: tuple[Logic, ...]


Logic = LogicConstant | Operand | Not | Join
TRUE, FALSE = LogicConstant(True), LogicConstant(False)


def parse_logic(text: str) -> Logic:
    """The structure of a condition; constants are `true` and `false` in any case.

    Raises:
        LogicError: the text is not a condition, or is nested too deep.
    """
    return _Parser(text).run()


def negation(logic: Logic) -> Logic:
    """`not logic`, simplified where that is evident."""
    match logic:
        case LogicConstant(value=value):
            return LogicConstant(not value)
        case Not(operand=operand):
            return operand
    return Not(logic)


def join(op: Literal["and", "or"], operands: Iterator[Logic] | tuple[Logic, ...]) -> Logic:
    """Operands joined; constants, repetition and nesting of the same operator are folded."""
    neutral = LogicConstant(op == "and")
    kept: dict[str, Logic] = {}
    for operand in operands:
        parts = operand.operands if isinstance(operand, Join) and operand.op == op else (operand,)
        kept |= {render(part, str): part for part in parts if part != neutral}
    if any(part == negation(neutral) for part in kept.values()):
        return negation(neutral)
    if len(kept) < 2:
        return next(iter(kept.values()), neutral)
    return Join(op, tuple(kept.values()))


def substitute(logic: Logic, values: dict[str, bool]) -> Logic:
    """`logic` with names replaced by truth values, simplified."""
    match logic:
        case Operand(text=text) if text in values:
            return LogicConstant(values[text])
        case Not(operand=operand):
            return negation(substitute(operand, values))
        case Join(op=op, operands=operands):
            return join(op, tuple(substitute(part, values) for part in operands))
    return logic


def atoms(logic: Logic) -> Iterator[Operand]:
    """The atoms of a condition from left to right."""
    match logic:
        case Operand():
            yield logic
        case Not(operand=operand):
            yield from atoms(operand)
        case Join(operands=operands):
            for operand in operands:
                yield from atoms(operand)


def render(logic: Logic, name: Callable[[str], str]) -> str:
    """The condition in the language of specifications; `name` gives the text of an atom."""
    match logic:
        case LogicConstant(value=value):
            return str(value)
        case Operand(text=text):
            return name(text)
        case Not(operand=operand):
            inner = render(operand, name)
            return f"not ({inner})" if isinstance(operand, Join) else f"not {inner}"
    parts = (
        f"({render(part, name)})" if isinstance(part, Join) else render(part, name)
        for part in logic.operands
    )
    return f" {logic.op} ".join(parts)


@frozen
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

    def run(self) -> Logic:
        logic = self._either()
        if self._at < len(self._tokens):
            raise self._unexpected()
        return logic

    def _either(self) -> Logic:
        return self._joined("or", lambda: self._joined("and", self._single))

    def _joined(self, op: Literal["and", "or"], part: Callable[[], Logic]) -> Logic:
        operands = [part()]
        while self._take(op):
            operands.append(part())
        return join(op, tuple(operands))

    def _single(self) -> Logic:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise LogicError(f"nested more than {_DEEPEST} deep", 0, self._length)
        try:
            return self._innermost()
        finally:
            self._depth -= 1

    def _innermost(self) -> Logic:
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
        return Operand(token.text, token.start) if known is None else known

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
