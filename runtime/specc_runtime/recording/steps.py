"""The messages of a recording about the steps of one subsystem, and the values beside them."""

from __future__ import annotations

from base64 import b64encode
from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from hashlib import sha256
from operator import attrgetter
from typing import Any

import numpy as np

from specc_runtime.buffers import FRESH
from specc_runtime.forms import Element, Layout, Schema, object_schema
from specc_runtime.recording.log import Log
from specc_runtime.recording.pictures import compressed, raw
from specc_runtime.recording.text import dumped
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
_BOOLEANS = {"type": "object", "additionalProperties": {"type": "boolean"}}


def topic_of(subsystem: str, *parts: str) -> str:
    """The topic of a subsystem, or of one of its elements: `/irp.k/x/R/I_rgb`."""
    return "/".join(("", subsystem, *parts))


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
        self.subsystem = ""
        self.time_s = 0.0
        self._written: deque[str] = deque(maxlen=WINDOW)
        self._topic = ""

    def of(self, topic: str, time_s: float, brief: bool) -> Shelf:
        """The same for values of an element at a time."""
        self._topic, self.time_s, self.is_brief = topic, time_s, brief
        return self

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        digest = digest_of(value.tobytes())
        if self.log is not None and self._is_new(digest):
            kind, schema, make = (raw if self.exact else compressed)(value)
            channel = self.log.channel(self._topic, kind, schema)
            self.log.add(channel, self.time_s, partial(make, value, self.time_s, self._topic))
        return {"image": digest}

    def packed(self, kind: str, data: bytes) -> Any:
        """See `Aside`."""
        if len(data) <= SMALL_BYTES:
            return {"type": kind, "bytes": b64encode(data).decode()}
        digest = digest_of(data)
        if self.log is not None and self._is_new(digest):
            form = object_schema({"type": {"type": "string"}, "bytes": {"type": "string"}})
            channel = self.log.channel(VALUES, VALUE_SCHEMA, form)
            self.log.add(channel, self.time_s, partial(_value, kind, data))
        return {"type": kind, "digest": digest}

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


class Cells:
    """The texts of the elements of buffers and memory; a value that stays keeps its text.

    What is `brief` has arrays in single precision, and nothing of images and opaque values.
    """

    def __init__(self, name: str, elements: Sequence[Element], *, brief: bool = False) -> None:
        self.name = name
        self._brief = brief
        self._elements = {element.attribute: element for element in elements}
        self._absent = tuple(self._elements)
        self._there: tuple[str, ...] = ()
        self._get: Callable[[Any], Any] = lambda buffer: ()
        self._last: dict[str, tuple[Any, bytes]] = {}
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
        there = self._there = tuple([name for name in self._elements if hasattr(buffer, name)])
        self._absent = tuple([name for name in self._elements if name not in there])
        if len(there) > 1:
            self._get = attrgetter(*there)
        else:  # attrgetter makes no tuple of one
            self._get = lambda buffer: tuple([getattr(buffer, name) for name in there])
        return there, self._get(buffer)

    @property
    def elements(self) -> Collection[Element]:
        """All elements."""
        return self._elements.values()

    def element(self, attribute: str) -> Element:
        """The element of an attribute."""
        return self._elements[attribute]

    def text(self, attributes: tuple[str, ...], values: Any, shelf: Shelf, time_s: float) -> bytes:
        """The text of these elements, nested by their names."""
        template = self._templates.get(attributes)
        if template is None:
            template = self._templates[attributes] = self._template(attributes)
        return template % tuple(self.texts(attributes, values, shelf, time_s))

    def texts(
        self, attributes: tuple[str, ...], values: Any, shelf: Shelf, time_s: float
    ) -> list[bytes]:
        """The text of each of these elements."""
        last, parts = self._last, []
        for attribute, value in zip(attributes, values, strict=True):
            known = last.get(attribute)
            if known is None or known[0] is not value:
                known = last[attribute] = value, self._dumped(attribute, value, shelf, time_s)
            parts.append(known[1])
        return parts

    def _dumped(self, attribute: str, value: Any, shelf: Shelf, time_s: float) -> bytes:
        element = self._elements[attribute]
        if not element.form.is_plain:
            topic = topic_of(shelf.subsystem, self.name, *element.name)
            value = element.form.data(value, shelf.of(topic, time_s, self._brief))
        if self._brief and type(value) is np.ndarray:
            value = value.astype(np.float32)
        return dumped(value)

    def _template(self, attributes: tuple[str, ...]) -> bytes:
        nested: dict[str, Any] = {}
        for attribute in attributes:
            *outer, name = self._elements[attribute].name
            (nested.setdefault(outer[0], {}) if outer else nested)[name] = 0
        return _with_gaps(nested)


def _with_gaps(nested: dict[str, Any]) -> bytes:
    inner = (
        dumped(name).replace(b"%", b"%%") + b":" + (_with_gaps(part) if part else b"%b")
        for name, part in nested.items()
    )
    return b"{" + b",".join(inner) + b"}"


class Steps:
    """What is written of the steps of one subsystem; hears of each step before it is made."""

    def __init__(self, subsystem: Subsystem, layout: Layout, shelf: Shelf, log: Log) -> None:
        """Has the steps of the subsystem noted from now on."""
        self.subsystem = subsystem
        self.taken: tuple[str, Held, tuple[bool, ...]] | None = None
        """The state and the inputs of the step that is not committed yet, and what is fresh."""
        self._shelf = shelf
        brief = not shelf.exact
        self._x = Cells("x", layout.x)
        self._y = Cells("y", layout.y, brief=brief)
        self._memory = Cells("memory", remembered(layout, shelf.exact), brief=brief)
        flagged = [e for e in layout.x if hasattr(type(subsystem.x), FRESH + e.attribute)]
        self._flags = tuple(FRESH + e.attribute for e in flagged)
        self._flag_names = tuple(".".join(e.name) for e in flagged)
        self._ends = layout.ends
        self._passages: dict[tuple[str, int, str, tuple[bool, ...]], bytes] = {}
        self.channel = log.channel(
            topic_of(subsystem.name), STEP_SCHEMA + subsystem.name, _schema(layout)
        )
        self._step = subsystem.step
        vars(subsystem)["step"] = self._noted

    def _noted(self) -> int:
        """In the place of the subsystem's own step; may be called in a worker thread."""
        subsystem = self.subsystem
        x = subsystem.x
        fresh = tuple([getattr(x, name) for name in self._flags])
        self.taken = subsystem.state, self._x.held(x), fresh
        return self._step()

    def message(self, record: StepRecord) -> bytes:
        """The text about a step that was committed; raises TypeError for a value without one."""
        time_s, shelf = record.time_s, self._shelf
        begin = self._told(record.stamp, time_s, record.transition, record.state)
        attributes, values = zip(*record.sent, strict=True) if record.sent else ((), ())
        held = self._memory.held(self.subsystem.memory)
        self.taken = None
        y = self._y.text(attributes, values, shelf, time_s)
        return b'%b,"y":%b,"memory":%b}' % (begin, y, self._memory.text(*held, shelf, time_s))

    def failed(self, stamp: int, time_s: float, message: str) -> bytes:
        """The text about a step that ended in a fault."""
        begin = self._told(stamp, time_s, -1, self.subsystem.state)
        return b'%b,"fault":%b}' % (begin, dumped(message))

    def _told(self, stamp: int, time_s: float, row: int, state: str) -> bytes:
        assert self.taken is not None
        before, inputs, fresh = self.taken
        passage = before, row, state, fresh
        known = self._passages.get(passage)
        if known is None:
            table = self.subsystem.transitions
            told = passage_of(table, self._ends, before, row, state)
            told["fresh"] = dict(zip(self._flag_names, fresh, strict=True))
            known = self._passages[passage] = dumped(told)[1:-1]
        self._shelf.subsystem = self.subsystem.name
        x = self._x.text(*inputs, self._shelf, time_s)
        return b'{"stamp":%d,"time":%b,%b,"x":%b' % (stamp, dumped(time_s), known, x)


class Truth:
    """What is written of the plant as it really is."""

    def __init__(self, layout: Layout, shelf: Shelf, log: Log) -> None:
        self._shelf = shelf
        self._y = Cells("y", layout.y)
        number, counted = {"type": "number"}, {"type": "integer"}
        form = {"stamp": counted, "time": number, "y": _of_elements(layout.y)}
        self.channel = log.channel(topic_of(PLANT), TRUTH_SCHEMA, object_schema(form))

    def message(self, record: StepRecord) -> bytes:
        """The text about a tick."""
        self._shelf.subsystem = PLANT
        attributes, values = zip(*record.sent, strict=True)
        y = self._y.text(attributes, values, self._shelf, record.time_s)
        return b'{"stamp":%d,"time":%b,"y":%b}' % (record.stamp, dumped(record.time_s), y)


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
