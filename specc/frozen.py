"""Classes of values, such as `dataclass(frozen=True, slots=True)` makes, at a quarter of the cost.

All commands import some 200 of them. mypy, not the running program, keeps them from being changed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cache
from operator import attrgetter
from types import CodeType, FunctionType
from typing import Any, TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(cls: type[T]) -> type[T]:
    """A class of values that are made of their fields, compared and hashed by them."""
    return _made(cls, slots=True)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def remembering(cls: type[T]) -> type[T]:
    """A frozen class whose values keep what they have computed, with `cached_property`."""
    return _made(cls, slots=False)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field,))
def interned(cls: type[T]) -> type[T]:
    """A frozen class whose values are equal to themselves only: each thing has one, made once."""
    return _with_fields(cls, slots=True)  # type: ignore[no-any-return]  # the class, with slots


@dataclass_transform(eq_default=False, field_specifiers=(field,))
def mutable(cls: type[T]) -> type[T]:
    """A class of things that are made of their fields and change.

    Each is equal to itself only, and none shows its fields.
    """
    return _with_fields(cls, slots=True)  # type: ignore[no-any-return]  # the class, with slots


def _with_fields(cls: type[T], *, slots: bool) -> Any:
    """The class, with the slots and the `__init__` of its fields."""
    cls.__doc__ = cls.__doc__ or cls.__name__  # else dataclasses make one of the signature
    made: Any = dataclass(init=False, eq=False, repr=False, slots=slots)(cls)
    parts = [part for part in fields(made) if part.init]
    made.__init__ = _init(parts, ends=hasattr(cls, "__post_init__"))
    return made


def _made(cls: type[T], *, slots: bool) -> type[T]:
    made = _with_fields(cls, slots=slots)
    compared = [part for part in fields(made) if part.compare]
    equals = _key(compared)
    hashed = _key([part for part in compared if part.hash is not False])

    def equal(self: Any, other: object) -> Any:
        return equals(self) == equals(other) if isinstance(other, made) else NotImplemented

    methods = {"__eq__": equal, "__hash__": lambda self: hash(hashed(self)), "__repr__": _shown}
    for name, method in methods.items():
        if name not in cls.__dict__:
            setattr(made, name, method)
    return made  # type: ignore[no-any-return]  # the class itself, with slots


def _init(parts: Sequence[Field[Any]], *, ends: bool) -> FunctionType:
    """What `dataclass` compiles for these fields: the code for as many, with their names."""
    parts = sorted(parts, key=lambda part: bool(part.kw_only))
    names = {f"a{n}": part.name for n, part in enumerate(parts)}
    made = tuple(part.default_factory is not MISSING for part in parts)
    code = _assigning(sum(not part.kw_only for part in parts), made, ends)
    code = code.replace(
        co_varnames=("self", *names.values()),
        co_names=tuple(names.get(name, name) for name in code.co_names),
    )
    given = [part for part in parts if _default(part) is not MISSING]
    defaults = tuple(_default(part) for part in given if not part.kw_only)
    init = FunctionType(code, globals(), "__init__", defaults)
    init.__kwdefaults__ = {part.name: _default(part) for part in given if part.kw_only}
    return init


def _default(part: Field[Any]) -> Any:
    """The default of an argument; the field itself where its factory makes the value."""
    return part.default if part.default_factory is MISSING else part


@cache
def _assigning(positional: int, made: tuple[bool, ...], ends: bool) -> CodeType:
    """The code of a function that assigns its arguments to attributes of its first one.

    `made` says of each whether its default is a field, in whose place its factory is called; it
    `ends` with the class's own `__post_init__`.
    """
    names = [f"a{n}" for n in range(len(made))]
    taken = ["self", *names[:positional], *["*"] * (positional < len(made)), *names[positional:]]
    call = "{0}.default_factory() if type({0}) is Field else {0}"
    values = (call.format(name) if one else name for name, one in zip(names, made, strict=True))
    steps = [f"self.{name} = {value}" for name, value in zip(names, values, strict=True)]
    body = "; ".join((*steps, *["self.__post_init__()"] * ends)) or "pass"
    constants = compile(f"def __init__({', '.join(taken)}): {body}", "<fields>", "exec").co_consts
    return next(one for one in constants if isinstance(one, CodeType))


def _key(parts: Sequence[Field[Any]]) -> Callable[[Any], object]:
    """What two values have alike if these fields are."""
    return attrgetter("__class__", *(part.name for part in parts))


def _shown(self: Any) -> str:
    parts = (f"{part.name}={getattr(self, part.name)!r}" for part in fields(self) if part.repr)
    return f"{type(self).__qualname__}({', '.join(parts)})"
