"""Contracts: values that enter generated code are checked there against their declared types.

A contract is a function `as_...`: it gives the value as its type says, with numbers of numpy turned
into Python's and arrays copied and read-only, or raises `Unfit`. An array is not copied if nobody
can change it, its numbers being bytes. Values of opaque types are checked by their class only:
nobody but operators looks into them. Contracts are always on.

A class is what `type` says, not what a value says of itself, and values of subclasses are converted
by the methods of their base: no code of a foreign class is executed.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from struct import Struct
from typing import Any, ParamSpec, TypeVar, cast

import numpy as np

from specc_runtime.buffers import freeze
from specc_runtime.building import builder, named
from specc_runtime.usual import calling, usual_of, usual_record, usually, with_usual
from specc_runtime.wrong import Unfit, WrongValue, value_text

Contract = Callable[[Any], Any]
P = ParamSpec("P")
R = TypeVar("R")

_FLOAT64 = np.dtype(np.float64)
_ORTHONORMAL = 1e-3
"""How far columns of a rotation may be from unit length and from right angles."""
_NEARLY = 1e-9
"""How far the columns of a usual rotation are from that at most, all together."""
_LAST_ROW = [0.0, 0.0, 0.0, 1.0]
_LAST_ROW_OFF = 1e-9
"""How far the last row of a pose may be off, e.g. after an inversion; it is made exact."""
_FLOATS = "type({v}) is array and {v}.dtype is float64"
_OF_FLOATS: dict[str, Any] = {
    "array": np.ndarray,
    "float64": _FLOAT64,
    "isfinite": math.isfinite,  # a sum that overflows is looked at again
    "frombuffer": np.frombuffer,
}
# Of all 3 x 3 matrices with these squares of their numbers in sum, a rotation has the largest
# determinant (Hadamard), so that both together leave it no room for anything else: not 2e-4 in a
# length or an angle.
_OF_POSES: dict[str, Any] = {
    "rows": Struct("12d32s").unpack,
    "hypot": math.hypot,
    "longest": math.sqrt(3.0) + _NEARLY,
    "least": 1.0 - _NEARLY,
    "last_row": np.array(_LAST_ROW).tobytes(),
}
_INTS = (int, np.integer)
_NUMBERS = (*_INTS, np.floating)
_NO_NUMBERS = (bool, np.timedelta64)  # subclasses of the above


def operator(
    name: str, function: Callable[P, R], contract: Contract, declared: str, trace: str = ""
) -> Callable[P, R]:
    """The operator `name` of a specification: `function`, whose results are of their type.

    Calls raise `WrongValue`, and whatever the function raises.
    """

    most = sys.getrecursionlimit()

    def changed() -> None:
        sys.setrecursionlimit(most)
        raise RuntimeError(f"operator {name} has changed how deep Python may call")

    def wrong(unfit: Unfit) -> WrongValue:
        return WrongValue(f"operator {name}", declared, unfit, trace)

    def stopped(stop: StopIteration) -> RuntimeError:
        error = RuntimeError(f"operator {name} raised StopIteration")
        return error.with_traceback(stop.__traceback__)

    call: Any = calling(
        function, contract, limit=sys.getrecursionlimit, most=most, changed=changed,
        Unfit=Unfit, wrong=wrong, stopped=stopped,
    )  # fmt: skip
    call.trace = trace  # for faults
    call.with_function = lambda other: operator(name, other, contract, declared, trace)
    return cast("Callable[P, R]", call)


def as_any(value: Any) -> Any:
    """Any value, with read-only arrays; for elements without a declared type."""
    freeze(value)
    return value


@usually("if type({v}) is bool:")
def as_bool(value: Any) -> bool:
    """A truth value; numpy's becomes Python's."""
    if type(value) in (bool, np.bool_):  # nothing inherits from these
        return bool(value)
    raise Unfit(value_text(value), "True or False")


@usually("if type({v}) is int:")
def as_int(value: Any) -> int:
    """A whole number of any size; numpy's becomes Python's, so that it never wraps."""
    kind = type(value)
    if issubclass(kind, _INTS) and not issubclass(kind, _NO_NUMBERS):
        return int.__int__(value) if issubclass(kind, int) else np.generic.__int__(value)
    raise Unfit(value_text(value), "an int")


@usually("if type({v}) is float and isfinite({v}):", names={"isfinite": math.isfinite})
def as_real(value: Any) -> float:
    """A finite number, SI units."""
    number = _number(value)
    if math.isfinite(number):
        return number
    raise Unfit(value_text(value), "a finite float")


@usually("if type({v}) is str and {v}.isascii():")
def as_text(value: Any) -> str:
    """A text without lone surrogates, which no file can hold."""
    if issubclass(type(value), str):
        text = str.__str__(value)
        try:
            text.encode()
        except UnicodeEncodeError:
            raise Unfit("a text with lone surrogates", "a text that UTF-8 can hold") from None
        return text
    raise Unfit(value_text(value), "a str")


def as_member(*members: str) -> Contract:
    """One of the members of an enum."""
    known = {member: member for member in members}
    wanted = f"one of {', '.join(map(repr, members))}"

    @usually(
        "if type({v}) is str and {v} in {v}_known:",
        accepted="{v}_known[{v}]",
        names={"{v}_known": known},
    )
    def accept(value: Any) -> str:
        if type(value) is not str and issubclass(type(value), str):
            value = str.__str__(value)
        if type(value) is str and value in known:
            return known[value]
        raise Unfit(value_text(value), wanted)

    return accept


def as_vector(size: int) -> Contract:
    """A vector (size,) of finite numbers."""

    @usually(
        f"if {_FLOATS} and {{v}}.shape == ({size},) and isfinite(sum({{v}}.tolist(), 0.0)):",
        accepted="{v} if type({v}.base) is bytes else frombuffer({v}.tobytes())",
        names=_OF_FLOATS,
    )
    def accept(value: Any) -> np.ndarray[Any, Any]:
        return _array(value, (size,))

    return accept


def as_partial(size: int) -> Contract:
    """A vector (size,) of finite numbers and, for components that are not used, NaN."""
    return lambda value: _array(value, (size,), partial=True)


@usually(
    f"if {_FLOATS} and {{v}}.shape == (4, 4):",
    "{v}_data = {v}.tobytes()",
    "a, b, c, x, d, e, f, y, g, h, i, z, last = rows({v}_data)",
    "if hypot(a, b, c, d, e, f, g, h, i) < longest and last == last_row and isfinite(x + y + z):",
    "if a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > least:",
    accepted="{v} if type({v}.base) is bytes else array((4, 4), float64, {v}_data)",
    names=_OF_FLOATS | _OF_POSES,
)
def as_pose(value: Any) -> np.ndarray[Any, Any]:
    """A homogeneous transform (4, 4): a rotation, a translation in metres, and 0 0 0 1."""
    value = _array(value, (4, 4))
    (a, b, c, _), (d, e, f, _), (g, h, i, _), last = value.tolist()
    off = _ORTHONORMAL
    rotation = (  # two columns of unit length at a right angle, and the third is their product
        -off < a * a + d * d + g * g - 1.0 < off
        and -off < b * b + e * e + h * h - 1.0 < off
        and -off < a * b + d * e + g * h < off
        and -off < d * h - e * g - c < off
        and -off < b * g - a * h - f < off
        and -off < a * e - b * d - i < off
    )
    if not rotation or last != _LAST_ROW:
        value = _repaired(value, rotation)
    return _owned(value)


def as_rgb(height: int, width: int) -> Contract:
    """A colour image (height, width, 3) of bytes."""
    shape = (height, width, 3)

    def accept(value: Any) -> np.ndarray[Any, Any]:
        if type(value) is not np.ndarray or value.shape != shape or value.dtype != np.uint8:
            raise Unfit(value_text(value), f"a numpy array {shape} of uint8")
        return _owned(value)

    return accept


def as_depth(height: int, width: int) -> Contract:
    """A depth map (height, width) in metres, finite, 0 where there is no reading."""

    def accept(value: Any) -> np.ndarray[Any, Any]:
        depth = _array(value, (height, width), np.dtype(np.float32), kinds="f")
        if depth.min() < 0:
            raise _unfit_at(depth, depth < 0, "metres, 0 where there is no reading")
        return depth

    return accept


def as_tuple(contract: Contract, size: int) -> Contract:
    """A vector of values that are not reals: a tuple of `size` values."""
    return _items(contract, f"a tuple of {size}", lambda count: count == size)


def as_list(contract: Contract, *, least: int = 0) -> Contract:
    """A list: a tuple of any number of values, `least` or more."""
    wanted = f"a tuple of {least} or more" if least else "a tuple"
    return _items(contract, wanted, lambda count: count >= least)


def as_optional(contract: Contract) -> Contract:
    """A value, or None."""
    return lambda value: None if value is None else contract(value)


def as_instance(kind: type) -> Contract:
    """A value of an opaque type; only its class is checked.

    Raises TypeError for what is no class, or a protocol that classes cannot be tested for.
    """
    if not _has_subclasses(kind):
        raise TypeError(f"{named(kind)} cannot be the class of an opaque type")

    @usually("if type({v}) is {v}_kind:", names={"{v}_kind": kind})
    def accept(value: Any) -> Any:
        if issubclass(type(value), kind):
            return value
        raise Unfit(value_text(value), f"a value of class {kind.__name__}")

    return accept


def as_record(kind: type, /, **parts: Contract) -> Contract:
    """A record of class `kind` with these fields.

    Raises TypeError for a class whose values can be changed, or that has other fields.
    """
    known, build = builder(kind, parts.keys())

    def accept(value: Any) -> Any:
        if type(value) is not kind:  # a subclass may compute its fields, and have others
            raise Unfit(
                value_text(value), f"a value of class {kind.__module__}:{kind.__qualname__}"
            )
        accepted = {}
        for name, contract in parts.items():
            try:
                accepted[name] = contract(getattr(value, name, None))
            except Unfit as unfit:
                raise unfit.inside(f".{name}") from None
        return build([accepted[name] for name in known])

    usual = usual_record(kind, build, {name: usual_of(parts[name]) for name in known})
    return with_usual(usual, accept) if usual else accept


def _number(value: Any) -> float:
    """A number of any kind as a float, NaN for what is none."""
    kind = type(value)
    if issubclass(kind, float):
        return float.__float__(value)
    if not issubclass(kind, _NUMBERS) or issubclass(kind, _NO_NUMBERS):
        return math.nan
    try:
        return int.__float__(value) if issubclass(kind, int) else np.generic.__float__(value)
    except OverflowError:
        raise Unfit("an int beyond all floats", "a finite float") from None


def _repaired(finite: np.ndarray[Any, Any], rotation: bool) -> np.ndarray[Any, Any]:
    """A pose whose last row is exact; raises Unfit if it is not a pose."""
    last = finite[3].tolist()
    if not all(abs(n - m) <= _LAST_ROW_OFF for n, m in zip(last, _LAST_ROW, strict=True)):
        raise Unfit(f"an array whose last row is {last}", "a pose, with the last row 0 0 0 1")
    if not rotation:
        raise Unfit("an array (4, 4) that holds no rotation", "a pose, a rigid transform (4, 4)")
    return np.vstack((finite[:3], _LAST_ROW))


def _owned(value: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """A copy on bytes, which nobody can make writable, so that no receiver changes the sender's."""
    return np.ndarray(value.shape, value.dtype, value.tobytes())


def _array(
    value: Any,
    shape: tuple[int, ...],
    dtype: np.dtype[Any] = _FLOAT64,
    *,
    partial: bool = False,
    kinds: str = "fiu",
) -> np.ndarray[Any, Any]:
    if type(value) is not np.ndarray or value.shape != shape or value.dtype.kind not in kinds:
        raise Unfit(value_text(value), f"a numpy array {shape} of floats")
    with np.errstate(over="ignore"):  # what becomes infinite is refused below
        owned = value.astype(dtype)
    bad = np.isinf(owned) if partial else ~np.isfinite(owned)
    if bad.any():
        raise _unfit_at(owned, bad, "finite numbers")
    return _owned(owned)


def _unfit_at(array: np.ndarray[Any, Any], bad: np.ndarray[Any, Any], wanted: str) -> Unfit:
    at = tuple(map(int, np.argwhere(bad)[0]))
    return Unfit(f"an array with {array[at]} at {at[0] if len(at) == 1 else at}", wanted)


def _items(contract: Contract, wanted: str, fits: Callable[[int], bool]) -> Contract:
    def accept(value: Any) -> tuple[Any, ...]:
        if type(value) is not tuple and issubclass(type(value), tuple):
            value = tuple.__getitem__(value, slice(None))
        if type(value) is not tuple or not fits(len(value)):
            raise Unfit(value_text(value), wanted)
        return tuple(_each(contract, value))

    return accept


def _each(contract: Contract, values: Iterable[Any]) -> Iterable[Any]:
    for index, item in enumerate(values):
        try:
            yield contract(item)
        except Unfit as unfit:
            raise unfit.inside(f"[{index}]") from None


def _has_subclasses(kind: Any) -> bool:
    try:
        issubclass(object, kind)
    except TypeError:
        return False
    return isinstance(kind, type)
