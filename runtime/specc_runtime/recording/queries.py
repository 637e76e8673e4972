"""What a recording says besides steps: marks, verdicts, poses, pictures, values over time.

Files come from strangers: what is not as a run writes it is left out, or raises Unusable.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import islice, zip_longest
from math import inf
from typing import Any

from specc_runtime.forms import Misshapen
from specc_runtime.recording.budget import Budget, Unusable
from specc_runtime.recording.depth import DEPTH
from specc_runtime.recording.index import EARLIER_S, Index, Last
from specc_runtime.recording.messages import LATEST_S, entries_of
from specc_runtime.recording.pictures import COMPRESSED, RAW, shown_message
from specc_runtime.recording.scene import POSES, SHAPES, poses_of
from specc_runtime.recording.snapshots import CHANGES, PANEL
from specc_runtime.recording.steps import topic_of
from specc_runtime.recording.text import loaded
from specc_runtime.recording.verdicts import REQUIREMENTS
from specc_runtime.sampling import PLANT

_IMAGES = COMPRESSED, RAW, DEPTH
_MOST_MARKS = 5000
_LONGEST = 300
_FINAL = {"met": "holds"}
_VERDICTS = {"holds", "violated", "open", "unknown"}
_OPEN = {"verdict": "open", "margin": None, "time_s": None}


@contextmanager
def _unusable(index: Index, topic: str) -> Iterator[None]:
    """Turn Misshapen into Unusable."""
    try:
        yield
    except Misshapen as error:
        raise Unusable(f"{index.path}: {topic}: {error}") from None


def _last(index: Index, topic: str, time_s: float) -> Last | None:
    return index.last([topic], time_s, Budget(index.path)).get(topic)


def _data(index: Index, topic: str, time_s: float) -> Any:
    """The data of the last message of a topic until then; None if there is none."""
    last = _last(index, topic, time_s)
    if last is None:
        return None
    with _unusable(index, topic):
        Budget(index.path).decode(last.text)
        return loaded(last.text)


# Over time.


def window(
    index: Index, name: str, begin_s: float, end_s: float, most: int
) -> list[tuple[float, Any]]:
    """Times and messages of a subsystem or the plant, with the last one before; at most `most`.

    Of more every second one is left out, or three of four, and so on. Raises Unusable.
    """
    topic, budget, every, texts = topic_of(name), Budget(index.path), 1, list[tuple[float, bytes]]()
    before = index.last([topic], begin_s, budget).get(topic)
    for number, found in enumerate(index.messages(topic, begin_s, end_s, budget)):
        if number % every == 0:
            texts.append(found)
        if len(texts) > most:
            texts, every = texts[::2], 2 * every
    if before is not None and (not texts or texts[0][0] > before.time_s):
        texts.insert(0, (before.time_s, before.text))
    with _unusable(index, topic):
        for _, text in texts:
            budget.decode(text)
        return [(time_s, loaded(text)) for time_s, text in texts]


def marks(index: Index) -> list[dict[str, Any]]:
    """What happened, each with `time_s`, `kind` and `text`, in the order of time."""
    found = [*islice(_marks(index), _MOST_MARKS)]
    return sorted(found, key=lambda mark: float(mark["time_s"]))


def _marks(index: Index) -> Iterator[dict[str, Any]]:
    report = index.report
    faults = [
        (time_s, f"{entry['culprit'][:_LONGEST]}: {entry['message']}")
        for time_s, entry in entries_of(report, "faults", ("culprit", "message"))
    ]
    for time_s, text in faults or index.faults:
        yield _mark(time_s, "fault", text)
    for time_s, entry in entries_of(report, "requirements", ("that", "verdict")):
        if entry["verdict"] == "violated":
            yield _mark(time_s, "violation", entry["that"])
    for time_s, entry in entries_of(report, "disturbances", ("because",), "began_s"):
        times = entry.get("times")
        more = f" ({times} times)" if type(times) is int and times > 1 else ""
        yield _mark(time_s, "disturbance", f"{entry['because'][:_LONGEST]}{more}")
    for topic, kind, name in ((CHANGES, "change", "constant"), (PANEL, "panel", "element")):
        for time_s, data in _every(index, topic):
            words = f"{data.get(name)} = {data.get('value')}, by {data.get('by')}"
            yield _mark(time_s, kind, words)
    time_s = min(index.begin_s, index.end_s)
    cycles = entries_of(report, "cycles", ("ended",), "simulated_s")
    for number, (length_s, entry) in enumerate(cycles, start=1):
        time_s += length_s
        yield _mark(time_s, "cycle", f"cycle {number} {entry['ended']}")


def _every(index: Index, topic: str) -> Iterator[tuple[float, Mapping[str, Any]]]:
    """The messages of a topic that are objects, up to the first that cannot be read."""
    budget = Budget(index.path)
    try:
        for time_s, text in index.messages(topic, -inf, inf, budget):
            budget.decode(text)
            if isinstance(data := loaded(text), dict):
                yield time_s, data
    except (Misshapen, Unusable):
        return


def _mark(time_s: float, kind: str, text: object) -> dict[str, Any]:
    return {"time_s": time_s, "kind": kind, "text": str(text)[:_LONGEST]}


# At a moment.


def observed_at(index: Index, time_s: float) -> dict[str, Any]:
    """What was observed of the plant. Raises Unusable."""
    data = _data(index, topic_of(PLANT), time_s)
    observed = data.get("y") if isinstance(data, dict) else None
    return observed if isinstance(observed, dict) else {}


def requirements_at(index: Index, time_s: float) -> list[dict[str, Any]]:
    """`verdict`, `margin` and `time_s` of each requirement until then. Raises Unusable.

    It is violated once that is decided, as the verdicts over time say. Of a recording without them
    the report tells the first moment that makes the verdict.
    """
    data = _data(index, REQUIREMENTS, time_s)
    during = data.get("requirements") if isinstance(data, dict) else None
    verdicts = during if isinstance(during, list) else []
    entries = index.report.get("requirements")
    reported = entries if isinstance(entries, list) else []
    has_verdicts, is_over = REQUIREMENTS in index.topics, index.end_s <= time_s + EARLIER_S
    found = []
    for entry, verdict in zip_longest(reported, verdicts):
        is_final = is_over or (not has_verdicts and _is_violated(entry, time_s))
        so_far = entry if is_final and entry is not None else verdict
        found.append(_verdict(so_far) if so_far is not None else dict(_OPEN))
    return found


def _is_violated(entry: Any, time_s: float) -> bool:
    """Whether a requirement is violated by then, as the report says."""
    final = _verdict(entry)
    since_s = final["time_s"]
    return final["verdict"] == "violated" and since_s is not None and since_s <= time_s + EARLIER_S


def _verdict(data: Any) -> dict[str, Any]:
    found = data if isinstance(data, dict) else {}
    verdict = str(found.get("verdict"))
    verdict = _FINAL.get(verdict, verdict)
    return {
        "verdict": verdict if verdict in _VERDICTS else "unknown",
        "margin": _number(found.get("margin")),
        "time_s": _number(found.get("time_s")),
    }


def _number(value: Any) -> float | None:
    is_number = type(value) in (float, int) and abs(value) < LATEST_S
    return float(value) if is_number else None


def poses_at(index: Index, time_s: float) -> dict[str, list[float]]:
    """The poses of bodies by name; see `poses_of`. Raises Unusable."""
    last = _last(index, POSES, time_s)
    if last is None:
        return {}
    with _unusable(index, POSES):
        Budget(index.path).decode(last.text)
        return poses_of(last.text)


def shapes_of(index: Index) -> bytes:
    """The message with the shapes of bodies; empty if there is none. Raises Unusable."""
    budget = Budget(index.path)
    _, text = next(index.messages(SHAPES, budget=budget), (0.0, b""))
    with _unusable(index, SHAPES):
        budget.decode(text)
        return text if text and isinstance(loaded(text), dict) else b""


def pictured(index: Index) -> dict[str, str]:
    """The topics of images, by the names of the elements."""
    topics = index.topics.values()
    return {t.name[1:].replace("/", "."): t.name for t in topics if t.schema in _IMAGES}


def picture_at(index: Index, topic: str, time_s: float) -> tuple[float, bytes] | None:
    """The last picture of a topic until then, and its time. Raises Unusable."""
    last = _last(index, topic, time_s)
    if last is None:
        return None
    budget = Budget(index.path)
    with _unusable(index, topic):
        budget.aside(len(last.text))
        picture = shown_message(last.text, index.topics[topic].schema)
    return (last.time_s, picture) if picture else None
