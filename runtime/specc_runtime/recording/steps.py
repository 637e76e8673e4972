"""The messages of a recording about the steps of one subsystem, and the values beside them."""

from __future__ import annotations

from base64 import b64encode
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from hashlib import sha256
from itertools import groupby, repeat
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np

from specc_runtime.buffers import FRESH
from specc_runtime.forms import Element, Layout, Schema, object_schema
from specc_runtime.recording.log import Channel, Log
from specc_runtime.recording.pictures import compressed, raw
from specc_runtime.recording.text import dumped, dumped_each
from specc_runtime.records import StepRecord
from specc_runtime.sampling import PLANT
from specc_runtime.subsystem import Subsystem, Transition

VALUES, VALUE_SCHEMA, STEP_SCHEMA = "/values", "specc.Value", "specc.Step."
TRUTH_SCHEMA = "specc.Truth"
SMALL_BYTES = 2048
"""A codec's bytes up to this size stand in the message itself."""
WINDOW = 32
"""What is aside is written again unless it is among so many that were written last."""
Held = tuple[tuple[str, ...], Any]
"""Attributes and their values."""
Times = tuple[Sequence[float], Sequence[int]]
"""Simulated times in s and dates in ns."""
_NONE = object()
_BOOLEANS = {"type": "object", "additionalProperties": {"type": "boolean"}}


def topic_of(subsystem: str) -> str:
    """The topic of a subsystem; those of its images are below: `/irp.k/x/R/I_rgb`."""
    return f"/{subsystem}"


class Shelf:
    """Values that are no plain data: images and what codecs give. `Aside` of one element.

    Opaque values are written in an exact recording only.

    Each goes by the digest of its bytes. An image has a topic of its own, where it is compressed
    for viewing unless the recording is exact.
    """

    def __init__(self, log: Log | None, exact: bool) -> None:
        """Without a log nothing is written."""
        self.log = log
        self.exact = exact
        self.is_brief = False
        self._written: deque[str] = deque(maxlen=WINDOW)
        self._topic = ""
        self._time_s, self._date_ns = 0.0, 0

    def of(self, topic: str, brief: bool, time_s: float, date_ns: int) -> Shelf:
        """The same for values of an element in a message of that time."""
        self._topic, self.is_brief = topic, brief
        self._time_s, self._date_ns = time_s, date_ns
        return self

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        digest = digest_of(value.tobytes())
        if self.log is not None and self._is_new(digest):
            kind, schema, make = (raw if self.exact else compressed)(value)
            channel = self.log.channel(self._topic, kind, schema)
            make = partial(make, value, self._time_s, self._topic)
            self._precede(self.log, channel, make, value.nbytes)
        return {"image": digest}

    def packed(self, kind: str, data: bytes) -> Any:
        """See `Aside`."""
        if len(data) <= SMALL_BYTES:
            return {"type": kind, "bytes": b64encode(data).decode()}
        digest = digest_of(data)
        if self.log is not None and self._is_new(digest):
            form = object_schema({"type": {"type": "string"}, "bytes": {"type": "string"}})
            channel = self.log.channel(VALUES, VALUE_SCHEMA, form)
            self._precede(self.log, channel, partial(_value, kind, data), len(data))
        return {"type": kind, "digest": digest}

    def _precede(self, log: Log, channel: Channel, make: Callable[[], bytes], size: int) -> None:
        log.precede((channel.number, round(self._time_s * 1e9), self._date_ns, make), size)

    def _is_new(self, digest: str) -> bool:
        if digest in self._written:
            return False
        self._written.append(digest)
        return True


def digest_of(data: bytes) -> str:
    """What stands for bytes that are aside: the first 16 digits of their SHA-256."""
    return sha256(data).hexdigest()[:16]


def _value(kind: str, data: bytes) -> bytes:
    return dumped({"type": kind, "bytes": b64encode(data).decode()})


class Cell:
    """The texts of an element; a value that stays keeps its text.

    What is `brief` has arrays in single precision, and nothing of images and opaque values.
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
        """The texts of values at these times; those of which something goes aside come in turn."""
        if self._form.is_aside:
            return map(self.text, values, repeat(shelf), *times)
        distinct = len(set(map(id, values)))
        if distinct == 1:
            return repeat(self.text(values[0], shelf), len(values))
        new, places = (values, None) if distinct == len(values) else _changes(values)
        data = new if self._form.is_plain else [self._form.data(value, shelf) for value in new]
        texts = dumped_each(data, brief=self._brief)
        self._last = values[-1], texts[-1]
        return texts if places is None else map(texts.__getitem__, places)


def _changes(values: Sequence[Any]) -> tuple[list[Any], list[int]]:
    """The values that are not the one before, and for each value which of them it is."""
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

    def held(self, buffer: Any) -> Held:
        """The attributes that have a value now, and the values."""
        for name in self._absent:
            if hasattr(buffer, name):
                return self._held_first(buffer)
        try:
            return self._there, self._get(buffer)
        except AttributeError:  # an element lost its value
            return self._held_first(buffer)

    def _held_first(self, buffer: Any) -> Held:
        there = self._there = tuple([name for name in self.elements if hasattr(buffer, name)])
        self._absent = tuple([name for name in self.elements if name not in there])
        self._get = getter(there)
        return there, self._get(buffer)

    def texts(
        self, names: Sequence[str], columns: Iterable[Sequence[Any]], shelf: Shelf, times: Times
    ) -> list[Iterable[bytes]]:
        """For each of these elements the texts of its values at these times."""
        cells = [self.cells[name] for name in names]
        return [cell.texts(v, shelf, times) for cell, v in zip(cells, columns, strict=True)]

    def template(self, attributes: tuple[str, ...]) -> bytes:
        """The text of these elements, nested by their names, with gaps for those of the values."""
        if attributes not in self._templates:
            nested: dict[str, Any] = {}
            for attribute in attributes:
                *outer, name = self.elements[attribute].name
                (nested.setdefault(outer[0], {}) if outer else nested)[name] = 0
            self._templates[attributes] = _with_gaps(nested)
        return self._templates[attributes]


def getter(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """What gives these attributes of an object."""
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


class _Passages(dict[tuple[Any, ...], bytes]):
    """The text of states, row and what is fresh; those that differ are few."""

    def __init__(self, table: Sequence[Transition], layout: Layout, flags: Sequence[str]) -> None:
        super().__init__()
        self._table = table
        self._ends = layout.ends
        self._flags = flags

    def __missing__(self, passage: tuple[Any, ...]) -> bytes:
        before, row, state, fresh = passage
        told = passage_of(self._table, self._ends, before, row, state)
        told["fresh"] = dict(zip(self._flags, fresh, strict=True))
        text = self[passage] = dumped(told)[1:-1]
        return text


class Steps:
    """What is written of the steps of one subsystem; hears of each step before it is made."""

    def __init__(self, subsystem: Subsystem, layout: Layout, shelf: Shelf, log: Log) -> None:
        """Has the steps of the subsystem noted from now on."""
        self.subsystem = subsystem
        self._taken: tuple[str, Held, tuple[bool, ...]] | None = None
        """The state and the inputs of the step that is not committed yet, and what is fresh."""
        self._shelf = shelf
        brief = not shelf.exact
        topic = topic_of(subsystem.name)
        kept = remembered(layout, shelf.exact)
        self._x = Cells(f"{topic}/x", layout.x)
        self._y = Cells(f"{topic}/y", layout.y, brief=brief)
        self._memory = Cells(f"{topic}/memory", kept, brief=brief)
        flagged = [e for e in layout.x if hasattr(type(subsystem.x), FRESH + e.attribute)]
        self._flags = getter([FRESH + e.attribute for e in flagged])
        names = [".".join(e.name) for e in flagged]
        self._passages = _Passages(subsystem.transitions, layout, names)
        form = STEP_SCHEMA + subsystem.name, _schema(layout)
        self._channel = log.channel(topic, *form, self._texts)
        self._step = subsystem.step
        vars(subsystem)["step"] = self._noted

    def _noted(self) -> int:
        """In the place of the subsystem's own step; may be called in a worker thread."""
        subsystem = self.subsystem
        x = subsystem.x
        self._taken = subsystem.state, self._x.held(x), self._flags(x)
        return self._step()

    def add(self, record: StepRecord) -> None:
        """Write a step that was committed."""
        assert self._taken is not None
        before, (x, inputs), fresh = self._taken
        _, stamp, time_s, state, row, sent, _ = record
        memory, values = self._memory.held(self.subsystem.memory)
        self._taken = None
        passage = before, row, state, fresh
        self._channel.add(time_s, ((x, state, memory, ""), stamp, passage, inputs, sent, values))

    def failed(self, stamp: int, time_s: float, message: str) -> None:
        """Write the step that ended in a fault, if there is one."""
        if self._taken is not None and stamp >= 0:
            before, (x, inputs), fresh = self._taken
            state = self.subsystem.state
            passage = before, -1, state, fresh
            self._channel.add(time_s, ((x, state, (), message), stamp, passage, inputs, (), ()))

    def _texts(
        self, steps: Sequence[Any], times: Sequence[float], dates: Sequence[int]
    ) -> Iterator[bytes]:
        for kind, (alike, at) in _runs(steps, times, dates):
            yield from self._texts_alike(kind, alike, at)

    def _texts_alike(
        self, kind: tuple[Any, ...], rows: Sequence[Any], times: Times
    ) -> Iterator[bytes]:
        """The texts of steps that have values for the same elements: column by column."""
        x, state, memory, fault = kind
        shelf, names = self._shelf, self.subsystem.sends[state] if not fault else ()
        _, stamps, passages, inputs, sent, held = zip(*rows, strict=True)
        columns = [
            stamps,
            dumped_each(times[0]),
            map(self._passages.__getitem__, passages),
            *self._x.texts(x, zip(*inputs, strict=True), shelf, times),
        ]
        template = b'{"stamp":%%d,"time":%%b,%%b,"x":%b' % self._x.template(x)
        if fault:
            template += b',"fault":%b}' % dumped(fault).replace(b"%", b"%%")
        else:
            values = [list(map(itemgetter(1), column)) for column in zip(*sent, strict=True)]
            columns += self._y.texts(names, values, shelf, times)
            columns += self._memory.texts(memory, zip(*held, strict=True), shelf, times)
            template += b',"y":%b,"memory":%b}' % (
                self._y.template(names),
                self._memory.template(memory),
            )
        return map(template.__mod__, zip(*columns, strict=True))


class Truth:
    """What is written of the plant as it really is."""

    def __init__(self, layout: Layout, shelf: Shelf, log: Log) -> None:
        topic = topic_of(PLANT)
        self._shelf = shelf
        self._y = Cells(f"{topic}/y", layout.y)
        number, counted = {"type": "number"}, {"type": "integer"}
        form = {"stamp": counted, "time": number, "y": _of_elements(layout.y)}
        self._channel = log.channel(topic, TRUTH_SCHEMA, object_schema(form), self._texts)

    def add(self, record: StepRecord) -> None:
        """Write what is so at a tick."""
        names, values = zip(*record.sent, strict=True)
        self._channel.add(record.time_s, (names, record.stamp, values))

    def _texts(
        self, ticks: Sequence[Any], times: Sequence[float], dates: Sequence[int]
    ) -> Iterator[bytes]:
        for names, (alike, at) in _runs(ticks, times, dates):
            _, stamps, values = zip(*alike, strict=True)
            y = self._y.texts(names, zip(*values, strict=True), self._shelf, at)
            template = b'{"stamp":%%d,"time":%%b,"y":%b}' % self._y.template(names)
            columns = stamps, dumped_each(at[0]), *y
            yield from map(template.__mod__, zip(*columns, strict=True))


def _runs(
    contents: Sequence[Any], times: Sequence[float], dates: Sequence[int]
) -> Iterator[tuple[Any, tuple[list[Any], Times]]]:
    """Contents that follow one another and begin with the same, that, and their times."""
    begin = 0
    for kind, alike in groupby(contents, itemgetter(0)):
        rows = list(alike)
        end = begin + len(rows)
        yield kind, (rows, (times[begin:end], dates[begin:end]))
        begin = end


def remembered(layout: Layout, exact: bool) -> Sequence[Element]:
    """The memory that is written."""
    return [element for element in layout.memory if exact or not element.form.is_opaque]


def passage_of(
    table: Sequence[Transition],
    ends: Mapping[str, tuple[str, str, str]],
    before: str,
    row: int,
    state: str,
) -> dict[str, Any]:
    """States, cause and row of a step, with the conditions that were asked and their values.

    The error condition is asked first, then the terminal one, then those of the rows, of which
    exactly one applies.
    """
    cause, taken = (table[row].cause, str(table[row])) if row >= 0 else ("", "")
    asked = {}
    if before:
        terminal, error, _ = ends[before]
        asked[error] = cause == "error"
        if cause != "error":
            asked[terminal] = cause == "terminal"
    if row >= 0:
        rows = enumerate(table)
        asked |= {
            other.condition: index == row
            for index, other in rows
            if (other.source, other.cause) == (before, cause)
        }
    return {
        "before": before,
        "state": state,
        "cause": cause,
        "row": row,
        "transition": taken,
        "conditions": asked,
    }


def _schema(layout: Layout) -> Schema:
    texts = {name: {"type": "string"} for name in ("before", "state", "cause", "transition")}
    return object_schema(
        {
            "stamp": {"type": "integer"},
            "time": {"type": "number"},
            "row": {"type": "integer"},
            **texts,
            "conditions": _BOOLEANS,
            "x": _of_elements(layout.x),
            "fresh": _BOOLEANS,
            "y": _of_elements(layout.y),
            "memory": _of_elements(layout.memory),
            "fault": {"type": "string"},
        }
    )


def _of_elements(elements: Sequence[Element]) -> Schema:
    groups: dict[str, dict[str, Schema]] = {}
    alone: dict[str, Schema] = {}
    for element in elements:
        schema = element.form.schema
        if schema:
            within = alone if len(element.name) == 1 else groups.setdefault(element.name[0], {})
            within[element.name[-1]] = schema | {"description": element.title}
    return object_schema({n: object_schema(group) for n, group in groups.items()} | alone)
