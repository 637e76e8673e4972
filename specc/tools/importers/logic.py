"""Conditions of other formats: `and`, `or`, `not`, also as `&&`, `||`, `!`, over other texts.

They become expressions of the model; a name, or a text without `and`, `or` and `not`, is a
variable, whose span is its place in the text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from typing import Literal, NamedTuple

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
        self.message, self.start, self.end = message, start, end


def atom(text: str, start: int = 0) -> BoundVariable:
    """A name, or a text, that begins at an offset."""
    return BoundVariable(text, type=Bool(), span=(start, start + len(text)))


def parse_logic(text: str) -> Expr:
    """The structure of a condition; constants are `true` and `false` in any case.

    Raises:
        LogicError: the text is not a condition, or is nested too deep.
    """
    parser = _Parser(text)
    logic = parser.disjunction(0)
    parser.expect("end", "`and` or `or`")
    return logic


def join(op: Literal["and", "or"], operands: Iterable[Expr]) -> Expr:
    """Operands joined; constants, repetition and nesting of the same operator are folded."""
    neutral = truth(op == "and")
    parts: dict[Expr, None] = {}
    for operand in operands:
        nested = operand.operands if isinstance(operand, Logic) and operand.op == op else (operand,)
        parts |= dict.fromkeys(nested)
    parts.pop(neutral, None)
    return negation(neutral) if negation(neutral) in parts else junction(op, tuple(parts))


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
            return f"not {_in_brackets(operand, name)}"
        case Logic(op=op, operands=operands):
            return f" {op} ".join(_in_brackets(part, name) for part in operands)
    return show(logic)


def _in_brackets(logic: Expr, name: Callable[[str], str]) -> str:
    text = render(logic, name)
    return f"({text})" if isinstance(logic, Logic) else text


class _Token(NamedTuple):
    kind: str
    text: str
    start: int
    end: int


class _Parser:
    """Recursive descent: `or` binds less tightly than `and`, that less than `not`."""

    def __init__(self, text: str) -> None:
        self._length = len(text)
        # All of them: a text with a wrong character is refused before one with a wrong structure.
        self._tokens = iter([*_tokens(text)])
        self._next = next(self._tokens)

    def disjunction(self, depth: int) -> Expr:
        return self._joined("or", lambda: self._joined("and", lambda: self._single(depth + 1)))

    def expect(self, kind: str, what: str) -> _Token:
        """The next token, which must be of a kind."""
        token = self._next
        if token.kind == kind:
            self._next = next(self._tokens, token)
            return token
        if token.kind == "end":
            raise LogicError(f"the condition ends where {what} is expected", 0, token.end)
        message = f"`{token.text}` is not expected here; expected {what}"
        raise LogicError(message, token.start, token.end)

    def _accept(self, kind: str) -> bool:
        return self._next.kind == kind and bool(self.expect(kind, ""))

    def _joined(self, op: Literal["and", "or"], part: Callable[[], Expr]) -> Expr:
        operands = [part()]
        while self._accept(op):
            operands.append(part())
        return join(op, operands)

    def _single(self, depth: int) -> Expr:
        if depth > _DEEPEST:
            raise LogicError(f"nested more than {_DEEPEST} deep", 0, self._length)
        if self._accept("not"):
            return negation(self._single(depth + 1))
        if self._accept("open"):
            logic = self.disjunction(depth)
            self.expect("close", "`)`")
            return logic
        token = self.expect("atom", "a name")
        constant = {"true": TRUE, "false": FALSE}.get(token.text.lower())
        return atom(token.text, token.start) if constant is None else constant


def _tokens(text: str) -> Iterator[_Token]:
    if len(text) > _LONGEST:
        raise LogicError(f"longer than {_LONGEST} characters", 0, len(text))
    at = 0
    while text[at:].strip():
        found = _TOKEN.match(text, at)
        if found is None:
            raise LogicError(f"`{text[at:].strip()[0]}` is not expected here", at, len(text))
        kind = found.lastgroup or ""
        word = found.group(kind).rstrip()
        yield _Token(kind, word, found.start(kind), found.start(kind) + len(word))
        at = found.end()
    yield _Token("end", "", len(text), len(text))
