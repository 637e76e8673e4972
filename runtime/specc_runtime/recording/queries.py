"""What a recording says besides steps: marks, verdicts, poses, pictures, values over time.

Files come from strangers: what is not as a run writes it is left out, or raises Unusable.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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


def marks(index: Index, required: Sequence[str] = ()) -> list[dict[str, Any]]:
    """What happened, each with `time_s`, `kind` and `text`, in the order of time.

    `required` are the texts of the requirements, for a file without a report.
    """
    found = [*islice(_marks(index, required), _MOST_MARKS)]
    until_s = index.end_s + EARLIER_S  # a report may be there although its last steps are lost
    return sorted(
        (mark for mark in found if mark["time_s"] <= until_s), key=lambda m: float(m["time_s"])
    )


def _marks(index: Index, required: Sequence[str]) -> Iterator[dict[str, Any]]:
    report = index.report
    faults = [
        (time_s, f"{entry['culprit'][:_LONGEST]}: {entry['message']}")
        for time_s, entry in entries_of(report, "faults", ("culprit", "message"))
    ]
    for time_s, text in faults or index.faults:
        yield _mark(time_s, "fault", text)
    for number, final in enumerate(_final(index)):
        if final["verdict"] == "violated" and final["time_s"] is not None:
            names = [final["that"], *required[number : number + 1], f"requirement {number + 1}"]
            yield _mark(final["time_s"], "violation", next(filter(None, names)))
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

    What is violated in the end is violated from the first moment on that makes it so, as the marks
    say. Before, and of what is not violated, the verdicts over time tell how it was.
    """
    is_over = index.end_s <= time_s + EARLIER_S
    found = []
    for final, then in zip_longest(_final(index), _during(index, time_s)):
        is_final = is_over or (final is not None and _is_violated(final, time_s))
        found.append(_verdict(final if final and is_final else then or _OPEN))
    return found


def _final(index: Index) -> list[dict[str, Any]]:
    """The verdict of each requirement as far as the file goes, with its text if that is known.

    The report says it, and without one, or where the last steps are lost, the last message does.
    """
    entries = index.report.get("requirements")
    reported = entries if isinstance(entries, list) else []
    found = []
    for entry, last in zip_longest(reported, _during(index, index.end_s)):
        final = entry if isinstance(entry, dict) else {}
        is_known = not index.has_losses or _is_violated(final, index.end_s)
        source = final if final and is_known else last
        found.append({**_verdict(source or _OPEN), "that": str(final.get("that", ""))})
    return found


def _is_violated(verdict: Mapping[str, Any], time_s: float) -> bool:
    """Whether that is a requirement that is violated by then."""
    since_s = _number(verdict.get("time_s"))
    is_violated = verdict.get("verdict") == "violated"
    return is_violated and since_s is not None and since_s <= time_s + EARLIER_S


def _during(index: Index, time_s: float) -> list[Any]:
    """The verdicts over time, as they were then; empty for a recording without them."""
    data = _data(index, REQUIREMENTS, time_s)
    verdicts = data.get("requirements") if isinstance(data, dict) else None
    return verdicts if isinstance(verdicts, list) else []


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
