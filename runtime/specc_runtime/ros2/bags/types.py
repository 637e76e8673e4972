"""Messages of ROS 2 as bytes (CDR) and as plain data, by the types that `rosbags` knows.

Plain data is as the device host gives it: fields by name, bytes for arrays of uint8.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import fields as parts_of
from dataclasses import is_dataclass
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from specc_runtime.faults import error_text
from specc_runtime.ros2.host.plain import DURATION, duration

TEXT = "std_msgs/msg/String"
_LONGEST_DEFINITION = 100_000
"""Characters of a definition in a bag."""
_MOST_PARTS, _DEEPEST = 10_000, 20
"""Numbers in a message of a type that a bag defines, sequences being one, and types in types."""
_HEAD = 4
"""Bytes before a message."""
_FILLER = "structure_needs_at_least_one_member"
_BYTES = ("byte", "char", "uint8")


class NoMessage(Exception):
    """Bytes that are no message of a type, or a type that is not known; the message says why."""


def whole_type(name: str) -> str:
    """`package/msg/Type` of `package/Type`."""
    package, _, last = name.rpartition("/")
    return name if package.endswith("/msg") else f"{package}/msg/{last}"


class Types:
    """Types of messages by their whole names: those of ROS itself, and what bags define besides."""

    def __init__(self, *, is_empty: bool = False) -> None:
        """Without those of ROS if it `is_empty`, for what another distribution has recorded."""
        self._store = get_typestore(Stores.EMPTY if is_empty else Stores.LATEST)
        self._store.max_sequence_length = 1 << 28

    def __contains__(self, name: str) -> bool:
        """Whether a type is known."""
        return name in self._store.fielddefs

    def definition(self, name: str) -> bytes:
        """The text of a known type and of those in it, as bags have it."""
        text, _ = self._store.generate_msgdef(name, ros_version=2)
        return str(text).encode()

    def learn(self, name: str, text: str) -> None:
        """Know a type from the text of its definition; raises NoMessage."""
        if not text:
            raise NoMessage(f"{name} is not known, and the bag does not define it")
        if len(text) > _LONGEST_DEFINITION:
            raise NoMessage(f"the definition of {name} has {len(text)} characters")
        try:
            found = get_types_from_msg(text, name)
            _check_size(name, found | {n: self._store.fielddefs[n] for n in self._store.fielddefs})
            self._store.register({n: found[n] for n in found if n not in self})
        except NoMessage:
            raise
        except Exception as error:  # the library raises what it may on a text that is none
            raise NoMessage(f"the definition of {name} is none: {error_text(error)}") from error
        if name not in self:
            raise NoMessage(f"the definition of {name} is that of another type")

    def agrees(self, name: str, text: str) -> bool:
        """Whether a text says of a known type what is known of it. No text says nothing."""
        try:
            is_one = 0 < len(text) <= _LONGEST_DEFINITION
            found = get_types_from_msg(text, name) if is_one else {}
        except Exception:  # noqa: BLE001  # the text is a stranger's
            return True
        return all(found[n][1] == self._fields(n) for n in found if n in self)

    def _fields(self, name: str) -> list[Any]:
        """The names of fields, with what their values are."""
        return [each for each in self._store.fielddefs[name][1] if each[0] != _FILLER]

    def decoded(self, name: str, data: bytes) -> dict[str, Any]:
        """The fields of a message; raises NoMessage."""
        if len(data) < _HEAD or data[0] or data[1] > 1:
            raise NoMessage(f"this is no {name}: it is no CDR")
        try:
            # The library's own function refuses bytes at the end, which ROS leaves for empty lists.
            known = self._store.get_msgdef(name)
            read = known.deserialize_cdr_le if data[1] else known.deserialize_cdr_be
            message, _ = read(data[_HEAD:], 0, known.cls, self._store)
            fields: dict[str, Any] = _plain(message)
        except Exception as error:  # as above
            raise NoMessage(f"this is no {name}: {error_text(error)}") from error
        return fields

    def encoded(self, name: str, fields: Mapping[str, Any]) -> bytes:
        """The bytes of a message with these fields, others being 0 or empty; raises NoMessage."""
        try:
            return bytes(self._store.serialize_cdr(self._message(name, fields), name))
        except Exception as error:  # as above
            raise NoMessage(f"this is no {name}: {error_text(error)}") from error

    def is_stamped(self, name: str) -> bool:
        """Whether messages begin with a header."""
        fields = self._fields(name)
        return bool(fields) and fields[0][1] == (Nodetype.NAME, "std_msgs/msg/Header")

    def _message(self, name: str, fields: Mapping[str, Any]) -> Any:
        values = [self._value(kind, fields.get(field)) for field, kind in self._fields(name)]
        return self._store.types[name](*values)

    def _value(self, described: Any, value: Any) -> Any:
        kind, of = described
        if kind == Nodetype.BASE:
            if value is None:
                return "" if of[0] == "string" else _zero(of[0])
            return value[0] if isinstance(value, bytes) else value  # a byte
        if kind == Nodetype.NAME:
            if isinstance(value, float) and of == DURATION:
                value = duration(value)
            return self._message(of, value or {})
        inside, count = of
        if inside[0] == Nodetype.BASE and inside[1][0] != "string":
            dtype = np.dtype("uint8" if inside[1][0] in _BYTES else inside[1][0])
            if isinstance(value, list) and value and isinstance(value[0], bytes):
                value = b"".join(value)
            if isinstance(value, bytes):
                return np.frombuffer(value, dtype)
            return np.zeros(count, dtype) if value is None else np.array(value, dtype)
        if value is None:
            value = [None] * (count if kind == Nodetype.ARRAY else 0)
        return [self._value(inside, item) for item in value]


def _zero(base: str) -> Any:
    if base == "bool":
        return False
    return 0.0 if base.startswith("float") else 0


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return {
            each.name.rstrip("_"): _plain(getattr(value, each.name))
            for each in parts_of(value)
            if each.name not in (_FILLER, "__msgtype__")
        }
    if isinstance(value, np.ndarray):
        return value.tobytes() if value.dtype == np.uint8 else value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list) else value


def _check_size(name: str, defined: Mapping[str, Any], depth: int = 0) -> int:
    """How many numbers a type has at least; raises NoMessage if that is no type of messages."""
    if depth > _DEEPEST:
        raise NoMessage(f"{name} is nested too deeply")
    size = 1
    for _, (kind, of) in defined[name][1]:
        inside, count = (of[0], of[1] or 1) if kind in _LISTS else ((kind, of), 1)
        is_named = inside[0] == Nodetype.NAME
        size += count * (_check_size(inside[1], defined, depth + 1) if is_named else 1)
    if size > _MOST_PARTS:
        raise NoMessage(f"{name} has more than {_MOST_PARTS} parts")
    return size


_LISTS = (Nodetype.ARRAY, Nodetype.SEQUENCE)


# What has no type that is known is a text, in JSON.


def text_of(data: Any) -> str:
    """Plain data as JSON."""
    return json.dumps(data, default=_encoded_bytes, ensure_ascii=False)


def data_of(text: str) -> Any:
    """The plain data of a text; raises NoMessage."""
    try:
        return json.loads(text, object_hook=_with_bytes)
    except (ValueError, RecursionError) as error:
        raise NoMessage(f"this is no JSON: {error}") from None


def _encoded_bytes(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"base64": base64.b64encode(value).decode()}
    raise TypeError(f"a value of {type(value).__name__}")


def _with_bytes(found: dict[str, Any]) -> Any:
    if found.keys() == {"base64"} and isinstance(found["base64"], str):
        return base64.b64decode(found["base64"], validate=True)
    return found
