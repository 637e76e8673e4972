"""Texts of calls of behaviours and functions: `go(to: X_lift, speed: slow)`, `go(X_lift, slow)`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from specc.diagnostics.nearest import nearest
from specc.lang.errors import ExprError, did_you_mean
from specc.lang.types import parameter_parts

_CALL = re.compile(r"\s*([^\W\d]\w*)\s*(?=\()")
_QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'")
_NAMED = re.compile(r"\s*([^\W\d]\w*)\s*:(?!=)")
_CODE = "E0315"


@dataclass(frozen=True, slots=True)
class Argument:
    """The span of an argument in a call, and of the name before it; equal ends for no name."""

    start: int
    end: int
    name: tuple[int, int]


@dataclass(frozen=True, slots=True)
class CallText:
    """The text of a call: the name of what is called, where it stands, and the arguments."""

    text: str
    name: str
    span: tuple[int, int]
    arguments: tuple[Argument, ...]

    def by_parameter(self, parameters: Sequence[str]) -> Mapping[str, Argument]:
        """The argument of each parameter: first those by position, then those by name.

        Raises:
            ExprError: one is missing, superfluous or given twice.
        """
        found: dict[str, Argument] = {}
        for index, argument in enumerate(self.arguments):
            name = self.text[slice(*argument.name)]
            at = argument.name if name else (argument.start, argument.end)
            if not name and any(one.name[0] < one.name[1] for one in self.arguments[:index]):
                message = "an argument without a name stands behind one with a name"
                raise self._error(message, at, parameters)
            if not name and index >= len(parameters):
                count = f"{len(parameters)} argument{'' if len(parameters) == 1 else 's'}"
                raise self._error(f"`{self.name}` takes {count}, not more", at, parameters)
            name = name or parameters[index]
            if name not in parameters:
                close = nearest(name, parameters)
                error = self._error(f"`{self.name}` has no parameter `{name}`", at, parameters)
                error.help = did_you_mean(close) or error.help
                raise error.set_repair(name, close)
            if name in found:
                message = f"parameter `{name}` of `{self.name}` has two arguments"
                raise self._error(message, at, parameters)
            found[name] = argument
        for name in (name for name in parameters if name not in found):
            message = f"`{self.name}` lacks an argument for its parameter `{name}`"
            raise self._error(message, self.span, parameters)
        return {name: found[name] for name in parameters}

    def _error(self, message: str, at: tuple[int, int], parameters: Sequence[str]) -> ExprError:
        return ExprError(message, *at, f"it is called as `{usage(self.name, parameters)}`", _CODE)


def names_of_parameters(signature: str) -> list[str]:
    """The names of parameters in a signature; none if it cannot be read."""
    try:
        stretches, _ = parameter_parts(signature)
    except ExprError:
        return []
    return [signature[first:last].partition(":")[0].strip() for first, last in stretches]


def usage(name: str, parameters: Sequence[str]) -> str:
    """How something with parameters is called."""
    return f"{name}({', '.join(f'{parameter}: ...' for parameter in parameters)})"


def parse_call(text: str) -> CallText | None:
    """Parse a call; None for a text without brackets behind a name. Raises `ExprError`."""
    head = _CALL.match(text)
    if head is None:
        return None
    # What stands in quotes has neither commas nor brackets that count.
    plain = _QUOTED.sub(lambda found: "_" * len(found[0]), text)
    before = head.end()
    try:
        stretches, end = parameter_parts(plain[before:])
    except ExprError:
        message = "the bracket is not closed"
        raise ExprError(message, before, len(text), "write `)` at the end", "E0301") from None
    if rest := text[before + end :].strip():
        message, help = f"`{rest}` stands behind the call", "a call ends with its bracket"
        raise ExprError(message, before + end, len(text), help, "E0301")
    found = []
    for first, last in ((a + before, b + before) for a, b in stretches):
        named = _NAMED.match(plain, first, last)
        start = named.end() if named else first
        start += len(text[start:last]) - len(text[start:last].lstrip())
        name = named.span(1) if named else (first, first)
        if start >= last:
            at = name if named else head.span(1)
            raise ExprError("an argument is empty", *at, "write its value", "E0301")
        found.append(Argument(start, last, name))
    return CallText(text, head[1], head.span(1), tuple(found))
