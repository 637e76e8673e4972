"""The record of a step, read by everything that watches a run, and the digest of a run."""

from __future__ import annotations

import hashlib
import struct
from typing import Any, NamedTuple

from specc_runtime.encoding import encode
from specc_runtime.faults import UnrecordableValue

_HEAD = struct.Struct("<QdiH").pack


class StepRecord(NamedTuple):
    """What a subsystem did at its time stamp `stamp`, committed when the others could see it.

    `transition` is an index into the subsystem's table or -1, `state` the state whose behaviour
    ran, `time_s` the simulated time of the stamp, `sent` the output elements that it wrote and
    `watched` memory that the task asked for.
    """

    subsystem: str
    stamp: int
    time_s: float
    state: str
    transition: int
    sent: tuple[tuple[str, Any], ...]
    watched: tuple[tuple[str, Any], ...] = ()


class _Texts(dict[str, bytes]):
    """The bytes of the few names that all records are made of."""

    def __missing__(self, text: str) -> bytes:
        data = self[text] = encode(text)
        return data


class RecordDigest:
    """SHA-256 over all records in the order in which they are committed; call it with each."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
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
