"""The texts of elements of buffers and memory, and values stored aside: images, codec bytes."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from hashlib import sha256
from itertools import repeat
from math import inf
from operator import attrgetter
from typing import Any

import numpy as np

from specc_runtime.forms import Element, Schema, object_schema
from specc_runtime.recording.container import CHUNK_S
from specc_runtime.recording.depth import DEPTH, ENCODING, DepthCoder
from specc_runtime.recording.log import Channel, Log
from specc_runtime.recording.pictures import Look, Make, compressed, raw
from specc_runtime.recording.text import dumped, dumped_each
from specc_runtime.records import digest

VALUES, VALUE_SCHEMA = "/values", "specc.Value"
VALUE = object_schema({"type": {"type": "string"}, "bytes": {"type": "string"}})
SMALL_BYTES = 512
"""A codec's bytes up to this size stand in the message itself."""
WINDOW = 32
"""A value stored aside is written again unless it is among the last so many of its kind."""
AGAIN_S = CHUNK_S
"""A value stored aside that stays is written again after this time: a copy against damage."""
BufferCells = tuple[tuple[str, ...], Any]
"""Attributes and their values."""
Times = tuple[Sequence[float], Sequence[int]]
"""Simulated times in s and dates in ns."""
_NONE = object()
_ROUNDING_S = 1e-6


class Shelf:
    """Stores the values of an element that are not plain data (`Aside`): images, codec bytes.

    A stored value is referred to by the digest of its bytes. Opaque values are written in an exact
    recording only. An image has a topic of its own. Unless the recording is exact, the image is a
    picture for viewing, as `Look` says, or missing, and nothing refers to it.
    """

    _window: float = WINDOW

    def __init__(self, log: Log | None, exact: bool, look: Look | None = None) -> None:
        """Without a log nothing is written."""
        self.log = log
        self._look = look
        self._shown: dict[str, float] = {}
        """The time in s at which the next picture of a topic is due."""
        self._coders: dict[str, DepthCoder] = {}
        self.exact = exact
        self.is_brief = False
        self._images: dict[str, float] = {}
        self._opaque: dict[str, float] = {}
        """The time in s at which a written value is due again; images come and go, values stay."""
        self._topic = ""
        self._time_s, self._date_ns = 0.0, 0

    def of(self, topic: str, brief: bool, time_s: float, date_ns: int) -> Shelf:
        """This shelf, set to an element and to the time of its message."""
        self._topic, self.is_brief = topic, brief
        self._time_s, self._date_ns = time_s, date_ns
        return self

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        if self.log is not None and not self.exact:
            self._look_at(self.log, value)
            return {"image": ""}
        name = digest_of(value.tobytes())
        if self.log is not None and self._is_new(name, self._images):
            self._keep(self.log, value)
        return {"image": name}

    def _look_at(self, log: Log, value: Any) -> None:
        """Write a picture, if one is due."""
        if self._look and self._time_s >= self._shown.get(self._topic, -inf) - _ROUNDING_S:
            self._shown[self._topic] = self._time_s + self._look.period_s
            self._draw(log, compressed(value, self._look), value)

    def _keep(self, log: Log, value: Any) -> None:
        """Write an image without loss."""
        if value.ndim == 3:
            self._draw(log, raw(value), value)
            return
        coder = self._coders.setdefault(self._topic, DepthCoder())
        self._draw(log, (DEPTH, {}, coder.message), value, ENCODING)

    def _draw(
        self, log: Log, how: tuple[str, Schema, Make], value: Any, encoding: str = "json"
    ) -> None:
        kind, schema, make = how
        channel = log.channel(self._topic, kind, schema, encoding=encoding)
        self._precede(log, channel, partial(make, value, self._time_s, self._topic), value.nbytes)

    def packed(self, kind: str, data: bytes | np.ndarray[Any, Any]) -> Any:
        """See `Aside`."""
        size = len(data) if isinstance(data, bytes) else data.nbytes
        if size <= SMALL_BYTES:
            return {"type": kind, "bytes": _base64(data)}
        name = digest_of(data)
        if self.log is not None and self._is_new(name, self._opaque):
            self._put(self.log, partial(_value, kind, data), size)
        return {"type": kind, "digest": name}

    def left_out(self, kind: str, value: Any) -> Any:
        """See `Aside`."""
        return {"type": kind}

    def _put(self, log: Log, make: Callable[[], bytes], size: int) -> None:
        self._precede(log, log.channel(VALUES, VALUE_SCHEMA, VALUE), make, size)

    def _precede(self, log: Log, channel: Channel, make: Callable[[], bytes], size: int) -> None:
        log.precede((channel.number, round(self._time_s * 1e9), self._date_ns, make), size)

    def _is_new(self, digest: str, written: dict[str, float]) -> bool:
        """Whether the value with this digest must be written now."""
        again_s = written.get(digest)
        if again_s is None and len(written) >= self._window:
            del written[next(iter(written))]
        if again_s is None or self._time_s > again_s:
            written[digest] = self._time_s + AGAIN_S if again_s is None else inf
            return True
        return False


def digest_of(data: bytes | np.ndarray[Any, Any]) -> str:
    """The name of bytes stored aside: the first 16 digits of their SHA-256."""
    found = digest(data) if isinstance(data, np.ndarray) else sha256(data).digest()
    return found.hex()[:16]


def _base64(data: bytes | np.ndarray[Any, Any]) -> str:
    return b64encode(data if isinstance(data, bytes) else data.tobytes()).decode()


def _value(kind: str, data: bytes | np.ndarray[Any, Any]) -> bytes:
    return dumped({"type": kind, "bytes": _base64(data)})


class Cell:
    """The texts of an element; an unchanged value keeps its text.

    With `brief`, arrays have single precision, and images and opaque values are left out.
    """

    def __init__(self, element: Element, topic: str, brief: bool) -> None:
        self._form = element.form
        self._topic = "/".join((topic, *element.name))
        self._brief = brief
        self._last: tuple[Any, bytes] = _NONE, b""

    def text(self, value: Any, shelf: Shelf, time_s: float = 0.0, date_ns: int = 0) -> bytes:
        """The text of a value in a message of that time."""
        last, text = self._last
        if value is last:
            return text
        data = value
        if not self._form.is_plain:
            data = self._form.data(value, shelf.of(self._topic, self._brief, time_s, date_ns))
        if self._brief and type(data) is np.ndarray:
            data = data.astype(np.float32)
        self._last = value, dumped(data)
        return self._last[1]

    def texts(self, values: Sequence[Any], shelf: Shelf, times: Times) -> Iterable[bytes]:
        """The texts of values at these times; values to be stored aside are done one by one."""
        if self._form.is_aside:
            return map(self.text, values, repeat(shelf), *times)
        if values[0] is not values[1 % len(values)] and values[-2] is not values[-1]:
            new, places = values, None  # it mostly changes at every step then
        elif len(set(map(id, values))) == 1:
            return repeat(self.text(values[0], shelf), len(values))
        else:
            new, places = _changes(values)
        data = new if self._form.is_plain else [self._form.data(value, shelf) for value in new]
        texts = dumped_each(data, brief=self._brief)
        self._last = values[-1], texts[-1]
        return texts if places is None else map(texts.__getitem__, places)


def _changes(values: Sequence[Any]) -> tuple[list[Any], list[int]]:
    """The values that differ from their predecessor, and for each value its index among them."""
    last, new, places = _NONE, list[Any](), list[int]()
    for value in values:
        if value is not last:
            new.append(value)
            last = value
        places.append(len(new) - 1)
    return new, places


class Cells:
    """The texts of the elements of a buffer or of memory; images have topics below `topic`."""

    def __init__(self, topic: str, elements: Sequence[Element], *, brief: bool = False) -> None:
        self.elements = {element.attribute: element for element in elements}
        self.cells = {e.attribute: Cell(e, topic, brief) for e in elements}
        self._absent = tuple(self.elements)
        self._there: tuple[str, ...] = ()
        self._get: Callable[[Any], Any] = lambda buffer: ()
        self._templates: dict[tuple[str, ...], bytes] = {}

    def of_buffer(self, buffer: Any) -> BufferCells:
        """The attributes that have a value now, and their values."""
        for name in self._absent:
            if hasattr(buffer, name):
                return self._held_first(buffer)
        try:
            return self._there, self._get(buffer)
        except AttributeError:  # an element lost its value
            return self._held_first(buffer)

    def _held_first(self, buffer: Any) -> BufferCells:
        there = self._there = tuple([name for name in self.elements if hasattr(buffer, name)])
        self._absent = tuple([name for name in self.elements if name not in there])
        self._get = getter(there)
        return there, self._get(buffer)

    def texts(
        self, names: Sequence[str], columns: Iterable[Sequence[Any]], shelf: Shelf, times: Times
    ) -> list[Iterable[bytes]]:
        """The texts of the values of each of these elements at these times."""
        cells = [self.cells[name] for name in names]
        return [cell.texts(v, shelf, times) for cell, v in zip(cells, columns, strict=True)]

    def template(self, attributes: tuple[str, ...]) -> bytes:
        """The text of these elements, nested by their names, with gaps for the texts of values."""
        if attributes not in self._templates:
            nested: dict[str, Any] = {}
            for attribute in attributes:
                *outer, name = self.elements[attribute].name
                (nested.setdefault(outer[0], {}) if outer else nested)[name] = 0
            self._templates[attributes] = _with_gaps(nested)
        return self._templates[attributes]


def getter(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """A function that returns these attributes of an object as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    # attrgetter makes no tuple of one
    return lambda buffer: tuple([getattr(buffer, name) for name in names])


def _with_gaps(nested: dict[str, Any]) -> bytes:
    inner = (
        dumped(name).replace(b"%", b"%%") + b":" + (_with_gaps(part) if part else b"%b")
        for name, part in nested.items()
    )
    return b"{" + b",".join(inner) + b"}"
