"""Which part of a specification a line of generated code comes from: condition, equations.

Generated lines carry that in their comments (`# pose_reached, eq. 5`), so nothing is kept ready
for it while a subsystem runs: the module is read again when something has failed in it.
"""

from __future__ import annotations

import ast
import inspect
import io
import linecache
import re
import tokenize
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import CodeType

_NUMBERS = re.compile(r"\beqs?\.? (\d+(?:, \d+)*)")


@dataclass(frozen=True, slots=True)
class Origin:
    """A statement of generated code: its text, the condition it tests, its equation numbers."""

    line: str = ""
    condition: str = ""
    equations: tuple[int, ...] = ()

    def and_of(self, trace: str) -> Origin:
        """The same with the equations of an operator that it uses, from the operator's trace."""
        more = [number for number in _numbers(trace) if number not in self.equations]
        return replace(self, equations=(*self.equations, *more))


def origin_of_line(file: str, line: int, names: Mapping[str, object] | None = None) -> Origin:
    """What line `line` of `file` stands for; `names` are the globals of its module.

    A statement without equations of its own has those of the statements that use its result, else
    those of its method.
    """
    text = linecache.getline(file, line, dict(names or {})).strip()
    module = _module("".join(linecache.getlines(file, dict(names or {}))))
    method = module and module.method_at(line)
    if not module or not method:
        return Origin(text)
    statement = _innermost(method, line)
    if statement is None:
        return Origin(text)
    users = _users(method, statement)
    condition = next((c for s in users if (c := module.condition(s))), "")
    numbers = next((n for s in users if (n := module.equations(s))), ())
    return Origin(text, condition, numbers or _numbers(ast.get_docstring(method) or ""))


def origin_of_output(file: str, element: str, behaviour: tuple[int, ...]) -> Origin:
    """The assignment of an output element, in a behaviour with these equation numbers."""
    module = _module("".join(linecache.getlines(file)))
    found = Origin()
    for statement in module.assignments(element) if module else ():
        numbers = module.equations(statement) if module else ()
        text = linecache.getline(file, statement.lineno).strip()
        if set(numbers) <= set(behaviour):
            return Origin(text, "", numbers or behaviour)
        found = found if found.line else Origin(text, "", numbers)
    return found


def called(code: CodeType, names: Mapping[str, object]) -> str:
    """The operator of a module whose function has this code; "" if there is none."""
    for name, value in names.items():
        function = inspect.unwrap(value) if callable(value) else value
        if function is not value and getattr(function, "__code__", None) is code:
            return name
    return ""


class _Module:
    """The text of a module: its methods and the comments beside its statements."""

    def __init__(self, text: str) -> None:
        self._tree = ast.parse(text)
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        self._comments = {t.start[0]: t.string for t in tokens if t.type == tokenize.COMMENT}

    def method_at(self, line: int) -> ast.FunctionDef | None:
        """The innermost function around a line."""
        around = [f for f in self._functions() if f.lineno <= line <= (f.end_lineno or 0)]
        return max(around, key=lambda function: function.lineno, default=None)

    def assignments(self, element: str) -> Iterator[ast.stmt]:
        """Every statement that assigns the output `element`."""
        for function in self._functions():
            for node in ast.walk(function):
                targets = node.targets if isinstance(node, ast.Assign) else ()
                for target in targets:
                    if isinstance(target, ast.Attribute) and target.attr == element:
                        yield node  # type: ignore[misc]  # only assignments have targets

    def equations(self, statement: ast.stmt) -> tuple[int, ...]:
        """Equation numbers in the comment of a statement."""
        return _numbers(self._comment(statement))

    def condition(self, statement: ast.stmt) -> str:
        """The condition that a statement tests, which is the first word of its comment."""
        if not isinstance(statement, ast.If):
            return ""
        word = self._comment(statement).removeprefix("#").partition(",")[0].strip()
        return word if word.isidentifier() else ""

    def _comment(self, statement: ast.stmt) -> str:
        lines = range(statement.lineno, _head_end(statement) + 1)
        return " ".join(self._comments[line] for line in lines if line in self._comments)

    def _functions(self) -> Iterator[ast.FunctionDef]:
        return (node for node in ast.walk(self._tree) if isinstance(node, ast.FunctionDef))


@cache
def _module(text: str) -> _Module | None:
    try:
        return _Module(text) if text else None
    except (SyntaxError, tokenize.TokenError):
        return None


def _innermost(method: ast.FunctionDef, line: int) -> ast.stmt | None:
    inside = [
        node
        for node in ast.walk(method)
        if isinstance(node, ast.stmt) and node is not method and node.lineno <= line
    ]
    around = [node for node in inside if line <= (node.end_lineno or 0)]
    return max(around, key=lambda node: (node.lineno, node.col_offset), default=None)


def _users(method: ast.FunctionDef, statement: ast.stmt) -> list[ast.stmt]:
    """A statement, then those that use what it computes, in the order of the text."""
    names = _assigned(statement)
    found = [statement]
    for node in ast.walk(method):
        if isinstance(node, ast.stmt) and node.lineno > statement.lineno and names & _read(node):
            found.append(node)
            names |= _assigned(node)
    return sorted(found, key=lambda node: node.lineno)


def _assigned(statement: ast.stmt) -> set[str]:
    targets = statement.targets if isinstance(statement, ast.Assign) else ()
    return {target.id for target in targets if isinstance(target, ast.Name)}


def _read(statement: ast.stmt) -> set[str]:
    """Names that a statement reads; of one with a body, those of its head."""
    parts = [statement.test] if isinstance(statement, ast.If | ast.While) else [statement]
    return {
        node.id
        for part in parts
        for node in ast.walk(part)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }


def _head_end(statement: ast.stmt) -> int:
    """Last line of a statement, without its body if it has one."""
    body = getattr(statement, "body", None)
    if body:
        return max(statement.lineno, int(body[0].lineno) - 1)
    return statement.end_lineno or statement.lineno


def _numbers(text: str) -> tuple[int, ...]:
    found = _NUMBERS.findall(text)
    return tuple(int(number) for number in found[-1].split(", ")) if found else ()
