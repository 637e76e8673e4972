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


def _made(cls: type[T], *, slots: bool) -> type[T]:
    cls.__doc__ = cls.__doc__ or cls.__name__  # else dataclasses make one of the signature
    is_plain = _is_plain(cls)
    made: Any = dataclass(init=not is_plain, eq=False, repr=False, slots=slots)(cls)
    if is_plain:
        made.__init__ = _init(fields(made))
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


def _is_plain(cls: type) -> bool:
    """Whether values are their arguments, and nothing else."""
    own = [part for part in vars(cls).values() if isinstance(part, Field)]
    known = (getattr(base, "__dataclass_fields__", {}).values() for base in cls.__mro__[1:])
    given = [*own, *(part for parts in known for part in parts)]
    is_more = hasattr(cls, "__post_init__") or "__init__" in vars(cls)
    return not is_more and all(p.init and p.default_factory is MISSING for p in given)


def _init(parts: Sequence[Field[Any]]) -> FunctionType:
    """What `dataclass` compiles for these fields: the code for as many, with their names."""
    parts = sorted(parts, key=lambda part: bool(part.kw_only))
    some = [part for part in parts if not part.kw_only]
    names = tuple(part.name for part in parts)
    code = _assigning(len(some), len(parts) - len(some))
    code = code.replace(co_varnames=("self", *names), co_names=names)
    defaults = tuple(part.default for part in some if part.default is not MISSING)
    made = FunctionType(code, globals(), "__init__", defaults)
    others = (part for part in parts if part.kw_only and part.default is not MISSING)
    made.__kwdefaults__ = {part.name: part.default for part in others}
    return made


@cache
def _assigning(positional: int, keyword: int) -> CodeType:
    """The code of a function that assigns its arguments to attributes of its first one."""
    names = [f"a{n}" for n in range(positional + keyword)]
    taken = ", ".join(["self", *names[:positional], *["*"] * (keyword > 0), *names[positional:]])
    body = "; ".join(f"self.{name} = {name}" for name in names) or "pass"
    made = compile(f"def __init__({taken}): {body}", "<fields>", "exec").co_consts
    return next(one for one in made if isinstance(one, CodeType))


def _key(parts: Sequence[Field[Any]]) -> Callable[[Any], object]:
    """What two values have alike if these fields are."""
    return attrgetter("__class__", *(part.name for part in parts))


def _shown(self: Any) -> str:
    parts = (f"{part.name}={getattr(self, part.name)!r}" for part in fields(self) if part.repr)
    return f"{type(self).__qualname__}({', '.join(parts)})"
