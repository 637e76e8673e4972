"""The content of the messages of a recording, and its values stored aside.

Files come from strangers: the content of a message is checked before it is used.
"""

from __future__ import annotations

import re
from base64 import b64decode
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from math import inf
from pathlib import Path
from sys import maxsize
from typing import Any, NamedTuple

from specc_runtime.forms import Element, Fetch, Misshapen, NotRecorded
from specc_runtime.recording.budget import Budget
from specc_runtime.recording.cells import VALUE_SCHEMA, WINDOW, digest_of
from specc_runtime.recording.depth import DEPTH, read_depth
from specc_runtime.recording.log import FORMAT
from specc_runtime.recording.pictures import RAW, read_raw
from specc_runtime.recording.reading import (
    Attachment,
    Channel,
    Message,
    Metadata,
    RecordFile,
    Schema,
    Unusable,
    profile_of,
)
from specc_runtime.recording.steps import STEP_SCHEMA, TRUTH_SCHEMA
from specc_runtime.recording.text import loaded

LATEST_S = 1e12
"""Times in reports are earlier; what says otherwise was made by no run."""
NOTHING = b"nothing"
"""Stands for an element without a value."""


class Shelved(Fetch):
    """The values stored aside that were read last; see `Fetch`."""

    def __init__(self, most: float = 2 * WINDOW, most_bytes: float = inf) -> None:
        """Keeps the last `most` images and values, at most `most_bytes` of each kind."""
        self.report: Mapping[str, str] = {}
        """The report of the run, empty if the file has none."""
        self.is_whole = True
        """Whether every wanted value was there, as far as that is known."""
        self._images = _Last(most, most_bytes)
        self._values = _Last(most, most_bytes)

    def put(self, digest: str, value: Any) -> None:
        """Keep an image (array), or the bytes of a value."""
        (self._values if isinstance(value, bytes) else self._images).put(digest, value)

    def image(self, data: Any) -> Any:
        """See `Fetch`."""
        return self._images.found(_part(data, "image"), "an image, without --record-exact")

    def packed(self, kind: str, data: Any) -> bytes:
        """See `Fetch`."""
        if isinstance(data, dict) and data.keys() == {"type"}:
            raise NotRecorded(f"a value of {kind}, without a codec or --record-exact")
        if isinstance(data, dict) and "bytes" in data:
            return unpacked(data)
        return bytes(self._values.found(_part(data, "digest"), f"a value of {kind}"))


class _Last:
    """The values that were put last, by digest."""

    def __init__(self, most: float, most_bytes: float) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._bytes = 0
        self._recent: OrderedDict[str, Any] = OrderedDict()

    def put(self, digest: str, value: Any) -> None:
        self._bytes += memoryview(value).nbytes
        if digest in self._recent:
            self._bytes -= memoryview(self._recent.pop(digest)).nbytes
        self._recent[digest] = value
        while len(self._recent) > self._most or self._bytes > self._most_bytes:
            self._bytes -= memoryview(self._recent.popitem(last=False)[1]).nbytes

    def found(self, digest: str, what: str) -> Any:
        """The value with a digest; raises NotRecorded."""
        if digest not in self._recent:
            raise NotRecorded(what)
        return self._recent[digest]


def _part(data: Any, name: str) -> str:
    if not isinstance(data, dict) or not isinstance(data.get(name), str):
        raise Misshapen(f"a value without its {name}")
    return str(data[name])


def unpacked(data: Any) -> bytes:
    """The bytes in a message of `VALUES`, or in a value of a message; raises Misshapen."""
    try:
        return b64decode(_part(data, "bytes"), validate=True)
    except ValueError as error:
        raise Misshapen(f"no bytes: {error}") from None


_STEP: dict[str, tuple[type, ...]] = {
    "stamp": (int,),
    "time": (float, int),
    "state": (str,),
    "transition": (str,),
    "conditions": (dict,),
    "x": (dict,),
    "fresh": (dict,),
}


def simulated_s(report: Mapping[str, str]) -> float | None:
    """The simulated duration in a report; None if it cannot be read or is none of a run."""
    try:
        found = float(loaded(report["report"].encode())["simulated_s"])
        return found if 0 <= found < LATEST_S else None
    except (KeyError, TypeError, ValueError, OverflowError, Misshapen):
        return None


def report_of(metadata: Mapping[str, str]) -> Mapping[str, Any]:
    """The report of a run in metadata; empty if it cannot be read."""
    try:
        report = loaded(str(metadata.get("report", "{}")).encode())
    except Misshapen:
        return {}
    return report if isinstance(report, dict) else {}


def entries_of(
    report: Mapping[str, Any], key: str, texts: Sequence[str], time: str = "time_s"
) -> list[tuple[float, Mapping[str, Any]]]:
    """The entries of a list in a report that have a time and these texts."""
    entries = report.get(key)
    return [
        (float(entry[time]), entry)
        for entry in (entries if isinstance(entries, list) else ())
        if isinstance(entry, dict)
        and type(entry.get(time)) in (int, float)
        and abs(entry[time]) < LATEST_S
        and all(type(entry.get(name)) is str for name in texts)
    ]


def first_of(about: Mapping[str, Any]) -> int:
    """The stamp of a step, or of the first period that was skipped before it. Raises Misshapen."""
    stamp, skipped = about.get("stamp"), about.get("skipped", 0)
    if type(stamp) is not int or type(skipped) is not int or not 0 <= skipped <= stamp:
        raise Misshapen("a message without the number of its period")
    return stamp - skipped


def step_of(text: bytes) -> dict[str, Any]:
    """The content of the message of a step; raises Misshapen."""
    message = loaded(text)
    if not isinstance(message, dict) or not _STEP.keys() <= message.keys():
        raise Misshapen("a message without what every step has")
    if not all(type(message[name]) in kinds for name, kinds in _STEP.items()):
        raise Misshapen("a message with values of other types than a step has")
    if not abs(message["time"]) < LATEST_S:
        raise Misshapen("a step at a time that no run reaches")
    return message


class Beginning(NamedTuple):
    """The beginning of the message of a step: stamp, state, state before, row and its text.

    `first` is the stamp of the first period that was skipped before it, or its own.
    """

    stamp: int
    first: int
    state: str
    before: str
    row: int
    transition: str


_BEGINNING = re.compile(
    rb'\{"stamp":(\d{1,15}),(?:"skipped":(\d{1,15}),"visible":[^,]{1,30},)?'
    rb'"time":[^,]{1,30},"before":"([^"\\]*)","state":"([^"\\]+)",'
    rb'"cause":"[^"\\]*","row":(-?\d{1,9}),"transition":"([^"\\]*)",'
)


def beginning_of(text: bytes, place: int = 0, end: int = maxsize) -> Beginning:
    """Read the beginning of the message of a step without decoding the rest. Raises Misshapen.

    The message is the part of the text from a place to an end.
    """
    found = _BEGINNING.match(text, place, end)
    if found is None:
        raise Misshapen("a message that does not begin as that of a step")
    stamp, skipped, before, state, row, transition = found.groups()
    before, state, transition = (t.decode(errors="replace") for t in (before, state, transition))
    first = int(stamp) - int(skipped or 0)
    return Beginning(int(stamp), first, state, before, int(row), transition)


def within(data: Any, element: Element) -> Any:
    """The data of an element in the data of a buffer or memory; `NOTHING` if it is missing."""
    for name in element.name:
        if not isinstance(data, dict) or name not in data:
            return NOTHING
        data = data[name]
    return data


def about(file: Path) -> Mapping[str, str]:
    """The metadata of a recorded run: spec, seed, set, exact. Raises Unusable."""
    return recorded(file)[0]


def followed_the_clock(about: Mapping[str, str]) -> bool:
    """Whether a run with these metadata was one in real time."""
    try:
        options = loaded(about.get("options", "{}").encode())
    except Misshapen:
        return False
    return isinstance(options, dict) and options.get("real_time") is True


def recorded(file: Path, budget: Budget | None = None) -> tuple[Mapping[str, str], dict[str, str]]:
    """The metadata (`about`), and the specification with the files it uses. Raises Unusable."""
    about: Mapping[str, str] = {}
    texts: dict[str, str] = {}
    reading = RecordFile(file, budget=budget)
    for record in reading:
        if isinstance(record, Attachment):
            texts.pop(record.name, None)  # the copies at the end are in the right order
            texts[record.name] = record.data.decode(errors="replace")
        elif isinstance(record, Metadata) and record.name == "specc":
            about = record.metadata
        elif isinstance(record, Message) and not reading.damaged:
            break  # else copies of damaged records come at the end
    if not about:
        is_bag = profile_of(file) == "ros2"
        hint = "; it is a bag of ROS 2, for `specc replay SPEC --bag`" if is_bag else ""
        raise Unusable(f"{file} is no recording of specc{hint}")
    if about.get("format") != FORMAT:
        raise Unusable(f"{file} was recorded by another version of specc")
    return about, texts


def steps_of(
    file: Path | RecordFile, shelf: Shelved, *, images: bool = True
) -> Iterator[tuple[str, float, bytes]]:
    """Topic, time and text of every step, in the order of the file.

    The ground truth of the plant is among them. `shelf` receives the values stored aside.

    Raises Unusable.
    """
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    reading = RecordFile(file) if isinstance(file, Path) else file
    for record in reading:
        if isinstance(record, Schema):
            schemas[record.id] = record.name
        elif isinstance(record, Channel):
            channels[record.id] = record.topic, schemas.get(record.schema_id, "")
        elif isinstance(record, Metadata) and record.name == "report":
            shelf.report = record.metadata
        elif isinstance(record, Message):
            topic, schema = channels.get(record.channel_id, ("", ""))
            if schema.startswith(STEP_SCHEMA) or schema == TRUTH_SCHEMA:
                yield topic, record.log_time / 1e9, record.data
            elif schema == VALUE_SCHEMA or (schema in (RAW, DEPTH) and images):
                reading.budget.aside(len(record.data))
                try:
                    _shelve(record.data, schema, shelf)
                except Misshapen as error:
                    raise Unusable(f"{reading.path}: {topic}: {error}") from None


def _shelve(message: bytes, schema: str, shelf: Shelved) -> None:
    if schema == VALUE_SCHEMA:
        data = unpacked(loaded(message))
        shelf.put(digest_of(data), data)
    else:
        image = image_of(message, schema)
        shelf.put(digest_of(image.tobytes()), image)


def image_of(message: bytes, schema: str) -> Any:
    """The image of a message of an exact recording, read-only; raises Misshapen."""
    return read_depth(message) if schema == DEPTH else read_raw(loaded(message))
