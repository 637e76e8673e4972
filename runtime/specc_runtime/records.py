"""The record of a step, the bytes of its values and the digest of a run.

The encoding is stable and injective: every value starts with a tag, and everything of variable
length is preceded by it. Equal bytes mean the same type and the same value; floats are compared by
their bits, so -0.0 is not 0.0.
"""

from __future__ import annotations

import hashlib
import struct
import weakref
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import Enum
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from specc_runtime.faults import UnrecordableValue
from specc_runtime.forms import digits

LARGE_ARRAY_BYTES = 4096
"""Arrays from this size on enter by the digest of their bytes."""

_float = struct.Struct("<cd").pack
_length = struct.Struct("<cI").pack


def encode(value: Any) -> bytes:
    """The bytes of a value; raises TypeError for a type that has no encoding."""
    kind = type(value)
    encoder = _ENCODERS.get(kind)
    if encoder is None:
        encoder = _ENCODERS[kind] = _encoder_for(value, kind)
    return encoder(value)


def _of_bytes(value: bytes) -> bytes:
    return _length(b"y", len(value)) + value


def _of_text(value: str) -> bytes:
    data = value.encode()
    return _length(b"s", len(data)) + data


def _of_int(value: int) -> bytes:
    data = digits(value).encode()
    return _length(b"i", len(data)) + data


def _of_float(value: float) -> bytes:
    return _float(b"f", value)


def _of_bool(value: bool) -> bytes:
    return b"T" if value else b"F"


def _of_tuple(value: tuple[Any, ...]) -> bytes:
    return _length(b"t", len(value)) + b"".join([encode(item) for item in value])


def _of_array(value: np.ndarray[Any, Any]) -> bytes:
    key = (value.dtype, value.shape)
    head = _HEADS.get(key)
    if head is None:
        if value.dtype.hasobject:
            raise TypeError("arrays of objects have no stable encoding")
        text = f"{value.dtype.str}{value.shape}".encode()
        head = _HEADS[key] = _length(b"a", len(text)) + text
    return head + (value.tobytes() if value.nbytes < LARGE_ARRAY_BYTES else digest(value))


def digest(array: np.ndarray[Any, Any]) -> bytes:
    """SHA-256 of the bytes, which are read once of an array that nobody can change.

    Objects are seen again and again with the same descriptors and colours.
    """
    key = id(array)
    known = _DIGESTS.get(key)
    if known is not None and known[0]() is array:
        return known[1]
    found = hashlib.sha256(array.tobytes()).digest()
    if (array.base is None or isinstance(array.base, bytes)) and not array.flags.writeable:
        _DIGESTS[key] = weakref.ref(array, lambda _: _DIGESTS.pop(key, None)), found
    return found


_DIGESTS: dict[int, tuple[weakref.ref[np.ndarray[Any, Any]], bytes]] = {}
_HEADS: dict[tuple[np.dtype[Any], tuple[int, ...]], bytes] = {}
_ENCODERS: dict[type, Callable[[Any], bytes]] = {
    type(None): lambda _: b"N",
    bool: _of_bool,
    int: _of_int,
    float: _of_float,
    str: _of_text,
    bytes: _of_bytes,
    tuple: _of_tuple,
    np.ndarray: _of_array,
}


def _encoder_for(value: Any, kind: type) -> Callable[[Any], bytes]:
    if is_dataclass(kind):
        return _of_record(kind)
    if isinstance(value, Enum):
        return lambda member: _of_text(f"{kind.__qualname__}.{member.name}")
    if isinstance(value, np.generic):
        return lambda scalar: encode(scalar.item())
    for base in (bool, int, float, str, bytes, tuple, np.ndarray):
        if isinstance(value, base):
            return _ENCODERS[base]
    raise TypeError(f"values of {kind.__module__}.{kind.__qualname__} have no stable encoding")


def _of_record(kind: type) -> Callable[[Any], bytes]:
    head = _of_text(f"{kind.__module__}.{kind.__qualname__}")
    names = [part.name for part in fields(kind)]
    if len(names) < 2:
        return lambda record: b"r" + head + b"".join([encode(getattr(record, n)) for n in names])
    get = attrgetter(*names)
    return lambda record: b"r" + head + b"".join([encode(item) for item in get(record)])


_HEAD = struct.Struct("<QdiH").pack


class StepRecord(NamedTuple):
    """What a subsystem did at its time stamp `stamp`, committed when the others could see it.

    `transition` is an index into the subsystem's table or -1, `state` the state whose behaviour
    ran, `time_s` when the step began, `sent` the output elements that it wrote and `watched` memory
    that the task asked for. `visible_s` is when the others saw it, of which digests know nothing.
    """

    subsystem: str
    stamp: int
    time_s: float
    state: str
    transition: int
    sent: tuple[tuple[str, Any], ...]
    watched: tuple[tuple[str, Any], ...] = ()
    visible_s: float = 0.0


Observer = Callable[[StepRecord], None]
"""Called with each record when it is committed, in an order that is the same in every run."""


class _Texts(dict[str, bytes]):
    """The bytes of the few names that all records are made of."""

    def __missing__(self, text: str) -> bytes:
        data = self[text] = encode(text)
        return data


class RecordDigest:
    """SHA-256 over all records in the order in which they are committed; call it with each."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self._folded = b""
        self._is_folded = True
        self._texts = _Texts()
        self._last: dict[tuple[str, str], tuple[Any, bytes]] = {}

    def __call__(self, record: StepRecord) -> None:
        """Add a record. Raises `UnrecordableValue`."""
        name, texts = record.subsystem, self._texts
        parts = [
            texts[name],
            texts[record.state],
            _HEAD(record.stamp, record.time_s, record.transition, len(record.sent)),
        ]
        try:
            for element, value in record.sent + record.watched:
                parts += (texts[element], self._value(name, element, value))
        except TypeError as error:
            raise UnrecordableValue(name, record.state, element, error) from error
        self._hash.update(b"".join(parts))
        self._is_folded = False

    def fold(self) -> None:
        """Go on from the digest of all until now, so that this is all that has to be kept."""
        if not self._is_folded:
            self.restore(self._hash.hexdigest())

    def saved(self) -> str:
        """What was folded last."""
        return self._folded.hex()

    def restore(self, saved: str) -> None:
        """Go on from there; raises ValueError for what is no digest."""
        self._folded, self._is_folded = bytes.fromhex(saved), True
        self._hash = hashlib.sha256(self._folded)

    def hexdigest(self) -> str:
        """The digest so far."""
        return self._hash.hexdigest()

    def _value(self, subsystem: str, element: str, value: Any) -> bytes:
        # Values never change once sent, so one that is sent again has the bytes it had.
        last = self._last.get((subsystem, element))
        if last is not None and last[0] is value:
            return last[1]
        data = encode(value)
        self._last[subsystem, element] = (value, data)
        return data
