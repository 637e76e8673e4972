"""The elements of a buffer or of memory on their way to another process, as they change.

Values of opaque types cross by their codecs (`forms`), all others as Python pickles them. An opaque
value that was in the last message as well is not encoded again, and stays the same object.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from specc_runtime.buffers import freeze
from specc_runtime.forms import Element, Form, NotRecorded

_NOTHING = object()
Changes = dict[str, Any]
"""Data of values by attributes; `GONE` has those that have none any more."""
GONE = ""


@dataclass(frozen=True, slots=True)
class _CrossingImage:
    """An array that is its own data."""

    array: np.ndarray[Any, Any]


class _CrossingOpaque(dict[str, Any]):
    """What stands for an opaque value: the number by which it is stored, and what codecs gave."""


class Sender:
    """Tells the values of one object that were not told yet."""

    def __init__(self, elements: Iterable[Element]) -> None:
        """`elements` say how values look; what is none of them is a flag or a number."""
        self._forms = {e.attribute: e.form for e in elements if e.form.codecs}
        self._last: dict[str, Any] = {}
        self._aside = _Aside()

    def changes(self, holder: object, names: Iterable[str]) -> Changes:
        """What has changed of these attributes; raises what codecs raise."""
        found: Changes = {}
        gone = []
        last = self._last
        for name in names:
            value = getattr(holder, name, _NOTHING)
            if last.get(name, _NOTHING) is value:
                continue
            if value is _NOTHING:
                del last[name]
                gone.append(name)
            else:
                last[name] = value
                found[name] = self._data(name, value)
        if gone:
            found[GONE] = gone
        self._aside.finish()
        return found

    def _data(self, name: str, value: Any) -> Any:
        form = self._forms.get(name)
        if form is None:
            return value
        self._aside.codecs = form.codecs
        return _plain(form.data(value, self._aside))


class Receiver:
    """Gives an object the values that a `Sender` told."""

    def __init__(self, elements: Iterable[Element]) -> None:
        self._forms = {e.attribute: e.form for e in elements if e.form.codecs}
        self._fetch = _Fetch()

    def take(self, holder: object, changes: Changes) -> None:
        """Raises what codecs raise."""
        for name in changes.pop(GONE, ()):
            delattr(holder, name)
        for name, data in changes.items():
            setattr(holder, name, self._value(name, data))
        self._fetch.finish()

    def _value(self, name: str, data: Any) -> Any:
        form = self._forms.get(name)
        if form is None:
            return data
        self._fetch.codecs = form.codecs
        return form.value(data, self._fetch)


def uncodable(elements: Iterable[Element]) -> Iterator[tuple[str, str]]:
    """Names of elements that cannot cross, each with the opaque type that has no codec."""
    for element in elements:
        for kind, (encode, _) in element.form.codecs.items():
            if encode is None:
                yield ".".join(element.name), kind


class _Aside:
    """Opaque values of one end, numbered; those of the last message are known at the other one."""

    exact, is_brief = False, False

    def __init__(self) -> None:
        self.codecs = Form.codecs
        self._sent_before: dict[int, tuple[Any, int]] = {}
        self._sent_now: dict[int, tuple[Any, int]] = {}
        self._count = 0

    def image(self, value: np.ndarray[Any, Any]) -> Any:
        return _CrossingImage(value)

    def packed(self, kind: str, data: bytes | np.ndarray[Any, Any]) -> Any:
        raise NotRecorded(f"a value of {kind}")  # opaque values come by `left_out`

    def left_out(self, kind: str, value: Any) -> Any:
        key = id(value)  # the value is kept, so that no other one gets its identity
        if key in self._sent_now:
            return _CrossingOpaque(kept=self._sent_now[key][1])
        if key in self._sent_before:
            self._sent_now[key] = self._sent_before[key]
            return _CrossingOpaque(kept=self._sent_now[key][1])
        encode = self.codecs[kind][0]
        if encode is None:
            raise NotRecorded(f"a value of {kind}, which has no codec")
        self._sent_now[key] = value, self._count
        self._count += 1
        return _CrossingOpaque(kept=self._sent_now[key][1], packed=encode(value))

    def finish(self) -> None:
        self._sent_before, self._sent_now = self._sent_now, {}


class _Fetch:
    """The other end of `_Aside`, which forgets at the same time."""

    def __init__(self) -> None:
        self.codecs = Form.codecs
        self._received_before: dict[int, Any] = {}
        self._received_now: dict[int, Any] = {}

    def image(self, data: Any) -> np.ndarray[Any, Any]:
        array: np.ndarray[Any, Any] = data.array
        return array

    def packed(self, kind: str, data: Any) -> bytes:
        raise NotRecorded(f"a value of {kind}")

    def opaque(self, kind: str, data: Mapping[str, Any]) -> Any:
        number = data["kept"]
        if "packed" in data:
            decode = self.codecs[kind][1]
            if decode is None:
                raise NotRecorded(f"a value of {kind}, which has no codec")
            freeze(data["packed"])
            self._received_now[number] = decode(data["packed"])
        elif number not in self._received_now:
            self._received_now[number] = self._received_before[number]
        return self._received_now[number]

    def finish(self) -> None:
        self._received_before, self._received_now = self._received_now, {}


def _plain(data: Any) -> Any:
    """Arrays of plain forms as the lists that they are read from."""
    kind = type(data)
    if kind is np.ndarray:
        return data.tolist()
    if kind is dict:
        return {name: _plain(item) for name, item in data.items()}
    return [_plain(item) for item in data] if kind is list else data
