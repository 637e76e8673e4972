"""Forms: how values look outside of their process, as plain numbers, texts, lists and mappings.

Generated packages say in `layouts.py` which form each element of a subsystem has. A form makes
plain data of a value, and the value of plain data, bit for bit; other data is `Misshapen`.
What is too large for a line of text, images and what a codec gives, goes aside (`Aside`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from specc_runtime.building import builder

Schema = dict[str, Any]
Packed = bytes | tuple[np.ndarray[Any, Any], ...]
"""What a codec gives."""
Encode = Callable[[Any], Packed]
Decode = Callable[[Any], Any]
Codecs = Mapping[str, tuple[Encode | None, Decode | None]]
"""By the names of opaque types."""
_LARGEST_INT = 2**63 - 1
_MOST_DECIMAL_BITS = 10_000
"""Of a whole number with decimal digits, of which Python writes 4300 at most."""
_LONG = re.compile(r"-?([1-9][0-9]{0,4000}|0x[0-9a-f]+)\Z", re.ASCII)
_NUMBERS = re.compile(r"[<>|][fiub][1248]\Z")


class Misshapen(Exception):
    """Data that does not have the form of its element."""


class NotRecorded(Exception):
    """A value that was left out, or is not exactly what it was; the message says which and why."""


class Aside(Protocol):
    """Where values go that are no plain data; each method gives the data that stands for the value.

    Opaque values are left out if it is not exact, and images if it is brief.
    """

    exact: bool
    is_brief: bool

    def image(self, value: np.ndarray[Any, Any]) -> Any:
        """An image of `Image`."""

    def packed(self, kind: str, data: bytes | np.ndarray[Any, Any]) -> Any:
        """What the codec of an opaque type made of a value, or an array of it."""

    def left_out(self, kind: str, value: Any) -> Any:
        """An opaque value that has no codec, or is not asked for."""


class Fetch(Protocol):
    """What `Aside` put away; raises NotRecorded, Misshapen."""

    def image(self, data: Any) -> np.ndarray[Any, Any]:
        """An image, read-only."""

    def packed(self, kind: str, data: Any) -> bytes:
        """What a codec made."""

    def opaque(self, kind: str, data: Any) -> Any:
        """An opaque value itself, if it stayed in this process."""
        raise NotRecorded(f"a value of {kind}")


class Form:
    """How values of a type look; those of a plain form are their own data.

    `schema` is in the part of JSON Schema that viewers understand, empty where that has no word.
    Values of which something goes aside are `is_aside`.
    """

    is_plain = True
    is_opaque = False
    is_aside = False
    has_image = False
    codecs: Codecs = {}  # noqa: RUF012  # never written to
    """Those of the opaque types among the parts of a value."""

    def __init__(self, schema: Schema) -> None:
        self.schema = schema

    def data(self, value: Any, aside: Aside) -> Any:
        """The plain data of a value; arrays may stay."""
        return value

    def value(self, data: Any, fetch: Fetch) -> Any:
        """The value of plain data; raises Misshapen, NotRecorded."""
        raise NotImplementedError


class _Plain(Form):
    def __init__(self, kind: type, name: str) -> None:
        super().__init__({"type": name})
        self._kind = kind

    def value(self, data: Any, fetch: Fetch) -> Any:
        if type(data) is not self._kind:
            raise Misshapen(f"{_described(data)} is no {self._kind.__name__}")
        return data


def is_short(value: int) -> bool:
    """Whether a whole number has 64 bits at most, so that all who read JSON can."""
    return -_LARGEST_INT <= value <= _LARGEST_INT


def digits(value: int) -> str:
    """A whole number as text, hexadecimal (`0x...`) if it is long."""
    return str(value) if value.bit_length() < _MOST_DECIMAL_BITS else hex(value)


class _Integer(Form):
    """Whole numbers; those beyond 64 bits are texts."""

    is_plain = False

    def data(self, value: Any, aside: Aside) -> Any:
        return value if is_short(value) else digits(value)

    def value(self, data: Any, fetch: Fetch) -> Any:
        if type(data) is str and _LONG.match(data):
            return int(data, 0)
        if type(data) is not int:
            raise Misshapen(f"{_described(data)} is no whole number")
        return data


REAL: Form = _Plain(float, "number")
TRUTH: Form = _Plain(bool, "boolean")
TEXT: Form = _Plain(str, "string")
INTEGER: Form = _Integer({"type": "integer"})


class _Array(Form):
    """Numbers, row by row, since viewers take no lists of lists; a missing component is null."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        super().__init__({"type": "array", "items": {"type": "number"}})
        self._shape = shape
        self._size = math.prod(shape)
        self.is_plain = len(shape) == 1

    def data(self, value: Any, aside: Aside) -> Any:
        return value.reshape(-1)

    def value(self, data: Any, fetch: Fetch) -> Any:
        if (
            type(data) is not list
            or len(data) != self._size
            or not all(item is None or type(item) is float for item in data)
        ):
            raise Misshapen(f"{_described(data)} is no list of {self._size} numbers")
        array = np.array(data, dtype=np.float64).reshape(self._shape)  # None becomes NaN
        array.setflags(write=False)
        return array


def array(*shape: int) -> Form:
    """Arrays of floats."""
    return _Array(shape)


class _Items(Form):
    def __init__(self, form: Form) -> None:
        inside = form.schema
        nested = inside.get("type", "array") == "array"
        super().__init__({} if nested else {"type": "array", "items": inside})
        self._form = form
        self.is_plain, self.is_aside = form.is_plain, form.is_aside
        self.has_image = form.has_image
        self.codecs = form.codecs

    def data(self, value: Any, aside: Aside) -> Any:
        return [self._form.data(item, aside) for item in value]

    def value(self, data: Any, fetch: Fetch) -> Any:
        if type(data) is not list:
            raise Misshapen(f"{_described(data)} is no list")
        return tuple([self._form.value(item, fetch) for item in data])


def items(form: Form) -> Form:
    """Tuples of values of one form."""
    return _Items(form)


class _Optional(Form):
    def __init__(self, form: Form) -> None:
        super().__init__(form.schema)
        self._form = form
        self.is_plain, self.is_aside = form.is_plain, form.is_aside
        self.has_image = form.has_image
        self.codecs = form.codecs

    def data(self, value: Any, aside: Aside) -> Any:
        return None if value is None else self._form.data(value, aside)

    def value(self, data: Any, fetch: Fetch) -> Any:
        return None if data is None else self._form.value(data, fetch)


def optional(form: Form) -> Form:
    """Values of a form, or None."""
    return _Optional(form)


class _Record(Form):
    is_plain = False

    def __init__(self, kind: type, parts: Mapping[str, Form]) -> None:
        super().__init__(object_schema({name: form.schema for name, form in parts.items()}))
        self._parts = dict(parts)
        self.is_aside = any(form.is_aside for form in parts.values())
        self.has_image = any(form.has_image for form in parts.values())
        self.codecs = {kind: codec for f in parts.values() for kind, codec in f.codecs.items()}
        self._order, self._build = builder(kind, self._parts.keys())

    def data(self, value: Any, aside: Aside) -> Any:
        return {name: form.data(getattr(value, name), aside) for name, form in self._parts.items()}

    def value(self, data: Any, fetch: Fetch) -> Any:
        if type(data) is not dict or data.keys() != self._parts.keys():
            raise Misshapen(f"{_described(data)} has not the fields {', '.join(self._parts)}")
        return self._build([self._parts[name].value(data[name], fetch) for name in self._order])


def object_schema(properties: Mapping[str, Schema]) -> Schema:
    """The schema of a mapping, without what has none."""
    return {"type": "object", "properties": {n: s for n, s in properties.items() if s}}


def record(kind: type, /, **parts: Form) -> Form:
    """Records of a class, with the forms of their fields."""
    return _Record(kind, parts)


class _Image(Form):
    is_plain, is_aside = False, True
    has_image = True

    def __init__(self, shape: tuple[int, ...], dtype: type) -> None:
        super().__init__({"type": "object"})
        self._shape = shape
        self._dtype = dtype

    def data(self, value: Any, aside: Aside) -> Any:
        return {} if aside.is_brief else aside.image(value)

    def value(self, data: Any, fetch: Fetch) -> Any:
        image = fetch.image(data)
        if image.shape != self._shape or image.dtype != self._dtype:
            raise Misshapen(f"an image {image.shape} of {image.dtype} is not {self._shape}")
        return image


def image(height: int, width: int, channels: int) -> Form:
    """Images (height, width, 3) of bytes, or depth maps (height, width) of 32-bit floats."""
    if channels == 3:
        return _Image((height, width, 3), np.uint8)
    return _Image((height, width), np.float32)


class _Opaque(Form):
    """Values that only operators look into, in the bytes that their codec gives."""

    is_plain, is_aside = False, True
    is_opaque = True

    def __init__(self, kind: str, encode: Encode | None, decode: Decode | None) -> None:
        super().__init__({"type": "object"})
        self._kind = kind
        self._encode, self._decode = encode, decode
        self.codecs = {kind: (encode, decode)}

    def data(self, value: Any, aside: Aside) -> Any:
        if self._encode is None or not aside.exact:
            return aside.left_out(self._kind, value)
        data = self._encode(value)
        if type(data) is tuple and all(type(part) is np.ndarray for part in data):
            return {"type": self._kind, "arrays": [self._array(part, aside) for part in data]}
        if type(data) is not bytes:
            wanted = "bytes, or a tuple of arrays, are wanted"
            raise TypeError(f"the codec of {self._kind} gave {_described(data)} where {wanted}")
        return aside.packed(self._kind, data)

    def _array(self, array: np.ndarray[Any, Any], aside: Aside) -> Any:
        if not _NUMBERS.match(array.dtype.str):
            raise TypeError(f"the codec of {self._kind} gave an array of {array.dtype}")
        shaped = {"dtype": array.dtype.str, "shape": list(array.shape)}
        return {**aside.packed(self._kind, np.ascontiguousarray(array)), **shaped}

    def _unpacked(self, data: Any, fetch: Fetch) -> Packed:
        if not isinstance(data, dict) or type(data.get("arrays")) is not list:
            return fetch.packed(self._kind, data)
        arrays = []
        for part in data["arrays"]:
            packed = fetch.packed(self._kind, part)
            dtype, shape = part.get("dtype"), part.get("shape")
            if type(dtype) is not str or not _NUMBERS.match(dtype) or type(shape) is not list:
                raise Misshapen(f"{_described(part)} is no array")
            try:
                array = np.frombuffer(packed, dtype).reshape(shape)  # of bytes, so read-only
            except (TypeError, ValueError) as error:
                raise Misshapen(f"no array: {error}") from None
            arrays.append(array)
        return tuple(arrays)

    def value(self, data: Any, fetch: Fetch) -> Any:
        if isinstance(data, dict) and "kept" in data:
            return fetch.opaque(self._kind, data)
        packed = self._unpacked(data, fetch)
        if self._decode is None:
            raise NotRecorded(f"a value of {self._kind}, which has no codec any more")
        try:
            return self._decode(packed)
        except Exception as error:  # the user's own function may raise anything
            raise Misshapen(f"the codec of {self._kind} raised {type(error).__name__}") from error


def opaque(kind: str, encode: Encode | None = None, decode: Decode | None = None) -> Form:
    """Values of an opaque type, with the functions of its codec if it has one."""
    return _Opaque(kind, encode, decode)


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """An element of a buffer or of memory: its attribute, its name in the specification."""

    attribute: str
    name: tuple[str, ...]
    form: Form
    title: str = ""


@dataclass(frozen=True, slots=True)
class Layout:
    """What a subsystem reads, writes and remembers.

    `ends` has for each state the names of its terminal and its error condition (of several, those
    by their causes, highest priority first), and of the method that works in it.
    """

    x: Sequence[Element]
    y: Sequence[Element]
    memory: Sequence[Element]
    ends: Mapping[str, tuple[str, str | Mapping[str, str], str]]


def _described(data: Any) -> str:
    text = repr(data)
    return text if len(text) <= 60 else f"{text[:57]}..."
