"""Messages between the server and a browser: JSON, in which what is no number is null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from struct import pack
from typing import Any

Message = Mapping[str, Any]

_LONGEST_NAME = 2000
"""Characters of a name or a text that a browser sends."""
_MOST_ITEMS = 200
"""Items of a list that a browser sends."""


@dataclass(frozen=True, slots=True)
class Asset:
    """A file that is made from the specification or the run: a drawing, a scene."""

    content_type: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of a camera, as JPEG or PNG."""

    camera: str
    time_s: float
    data: bytes

    @property
    def message(self) -> bytes:
        """The length of the JSON that says of what it is, the JSON, and the picture."""
        about = json_text({"camera": self.camera, "time_s": self.time_s}).encode()
        return pack(">I", len(about)) + about + self.data


class Malformed(Exception):
    """What a browser sent is no message; the text says why."""


def json_text(message: Any) -> str:
    """The text of plain data, with null for NaN and infinities."""
    try:
        return bytes(import_module("specc_runtime.recording.text").dumped(message)).decode()
    except TypeError:  # of a name that is no UTF-8, or of an integer of more than 64 bits
        return json.dumps(_plain(message), allow_nan=False, separators=(",", ":"))


def _plain(data: Any) -> Any:
    match data:
        case Mapping():
            return {str(name): _plain(value) for name, value in data.items()}
        case list() | tuple():
            return [_plain(value) for value in data]
        case float() if not math.isfinite(data):
            return None
        case None | bool() | int() | float():
            return data
        case _:
            return str(data)


def read_message(text: str | bytes) -> dict[str, Any]:
    """What a browser sent. Raises Malformed."""
    try:
        message = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise Malformed("it is no JSON") from error
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise Malformed("it has no type")
    return message


def _no_number(name: str) -> float:
    raise ValueError(name)


# The fields of what a browser sends.


def text_in(message: Message, name: str) -> str:
    """A text. Raises Malformed."""
    value = message.get(name)
    if not isinstance(value, str) or len(value) > _LONGEST_NAME:
        raise Malformed(f"its {name} is no text, or too long")
    return value


def number_in(message: Message, name: str) -> float | None:
    """A finite number or None. Raises Malformed."""
    value = message.get(name)
    if value is None:
        return None
    if type(value) not in (int, float) or not abs(value) < 1e12:
        raise Malformed(f"its {name} is no number")
    return float(value)


def texts_in(message: Message, name: str) -> list[str]:
    """A list of texts. Raises Malformed."""
    values = message.get(name)
    if not isinstance(values, list) or len(values) > _MOST_ITEMS:
        raise Malformed(f"its {name} is no list, or too long")
    return [text_in({name: value}, name) for value in values]


def plain_in(message: Message, name: str) -> bool | int | float | str:
    """A number, a truth value or a text. Raises Malformed."""
    value = message.get(name)
    if isinstance(value, bool) or (isinstance(value, int | float) and abs(value) < 1e300):
        return value
    return text_in(message, name)
