"""The usual value of a type is known by a few lines, which are compiled where values come in.

A call costs as much as the test that it leads to. So an operator is called by a function of its
own, with the lines of its type in it: the interpreter adapts that code to this one operator and to
what it gives. What the lines do not know goes to a function that is right about every value, and
says what is wrong with it. The lines take nothing that it would refuse.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import CodeType, FunctionType, MappingProxyType
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])
_MOST_LINES = 80
"""Of a record before its last field; Python has a limit to how deep blocks are indented."""

_CONTRACT = """\
def accept(value):
{lines}
    return otherwise(value)
"""
_OPERATOR = """\
def call(*arguments):
    try:
        value = function(*arguments)
        if limit() != most:
            changed()
{lines}
        return otherwise(value)
    except Unfit as unfit:
        raise wrong(unfit) from None
    except StopIteration as stop:  # a generator around the call would take it for its own
        raise stopped(stop) from stop
"""


@dataclass(frozen=True, slots=True)
class Usual:
    """The test that a value of a type is as usual, and how the value is then accepted.

    Each of `lines` stands under the condition before it. In them, in `accepted` and in `names`,
    which has the objects that they use, `{v}` is what the value is called.
    """

    lines: tuple[str, ...]
    accepted: str = "{v}"
    names: Mapping[str, Any] = field(default_factory=dict)

    def named(self, v: str) -> Usual:
        """The same of a value that is called `v`."""
        names = {name.format(v=v): value for name, value in self.names.items()}
        lines = tuple(line.format(v=v) for line in self.lines)
        return Usual(lines, self.accepted.format(v=v), names)

    def code(self, indent: int) -> str:
        """Python that returns the value called `value` as it is accepted, if it is a usual one."""
        named = self.named("value")
        returned = f"return {named.accepted}" if self.lines else ""
        return "\n".join(_under((*named.lines, returned), indent))


def usually(
    *lines: str, accepted: str = "{v}", names: Mapping[str, Any] = MappingProxyType({})
) -> Callable[[F], F]:
    """Have the usual values of a contract accepted by these lines; see `Usual`."""
    return lambda otherwise: with_usual(Usual(lines, accepted, names), otherwise)


def with_usual(usual: Usual, otherwise: F) -> F:
    """The contract that looks for a usual value before it asks another one, `otherwise`."""
    accept: Any = _compiled(_CONTRACT, 4, usual, otherwise=otherwise)
    functools.update_wrapper(accept, otherwise)
    accept.usual = usual  # for those who look for it themselves
    return cast("F", accept)


def usual_of(contract: Callable[[Any], Any]) -> Usual | None:
    """How a contract knows a usual value, if it does."""
    return getattr(contract, "usual", None)


def usual_record(
    kind: type, build: Callable[[Any], Any], parts: Mapping[str, Usual | None]
) -> Usual | None:
    """How a record of a class is known, whose fields in their order are `parts`, if they all are.

    `build` makes a record of what is in its fields. Very large ones are not known.
    """
    made = Usual(("if type({v}) is {v}_kind:",), names={"{v}_kind": kind, "{v}_build": build})
    accepted = []
    for number, (name, usual) in enumerate(parts.items()):
        if usual is None or len(made.lines) > _MOST_LINES:
            return None
        v = f"{{v}}_{number}"
        part = usual.named(v)
        came = f'{v} = getattr({{v}}, "{name}", None)'
        made = Usual((*made.lines, came, *part.lines), names={**made.names, **part.names})
        accepted.append(part.accepted)
    return replace(made, accepted=f"{{v}}_build(({', '.join(accepted)},))")


def calling(
    function: Callable[..., Any], contract: Callable[[Any], Any], **names: Any
) -> Callable[..., Any]:
    """What calls a function and gives its result as the contract accepts it.

    `names`: `limit` and `most`, how deep Python may call; `changed`, for when that is no longer so;
    `Unfit`, and what `wrong` and `stopped` make of it and of StopIteration.
    """
    usual = usual_of(contract) or Usual(())
    call = _compiled(_OPERATOR, 8, usual, function=function, otherwise=contract, **names)
    return functools.wraps(function)(call)


def _compiled(template: str, indent: int, usual: Usual, **names: Any) -> FunctionType:
    """The function of a template, with code that no other one shares."""
    code = _code(template.format(lines=usual.code(indent)))
    scope = {"__name__": __name__, **usual.named("value").names, **names}
    return FunctionType(code.replace(), scope)


@functools.cache
def _code(text: str) -> CodeType:
    """Of a text that defines one function. The code of two operators often has one text."""
    defined = compile(text, "<checks>", "exec").co_consts
    return next(one for one in defined if isinstance(one, CodeType))


def _under(lines: tuple[str, ...], indent: int) -> Iterator[str]:
    for line in lines:
        yield " " * indent + line
        indent += 4 * line.endswith(":")
