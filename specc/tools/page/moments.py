"""What the page shows of a moment, from the messages of the last steps; live and recorded alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from specc.lang.values import Floats
from specc.model.bindings import PLANT
from specc.tools.page.description import Description
from specc.tools.page.messages import Message
from specc.tools.plot import ListedSignal
from specc.tools.plot.signals import unwrap_rotations
from specc.tools.why import Explainer, NotKnown, SeenStep, WhyLine, value_of, value_text

MOST_POINTS = 600
"""Of one line of a series."""
NO_LINES: dict[str, Any] = {"t": [], "lines": [], "words": []}
_LONGEST_NAME = 300


@dataclass(frozen=True, slots=True)
class LastStep:
    """The last step of a subsystem, with the names that `recording.moment.Seen` has for it."""

    name: str
    step: Mapping[str, Any]
    memory: Mapping[str, Any] | None
    entered_s: float | None
    since_s: float | None
    row: str
    recent: Sequence[tuple[float, float, int, str]] = ()
    known_from: int = -1


LastSteps = Mapping[str, Any]
"""The last step of each subsystem, each a `LastStep` or what the runtime has for it."""


def states_of(steps: LastSteps) -> dict[str, Message]:
    """The state of each machine, since when, and by which row."""
    return {
        name: {
            "state": str(one.step.get("state"))[:_LONGEST_NAME],
            "since_s": one.since_s,
            "row": str(one.row)[:_LONGEST_NAME],
        }
        for name, one in steps.items()
    }


def flow_of(description: Description, steps: LastSteps) -> list[str]:
    """The arcs of the structure on which something went in these steps."""
    found: dict[str, None] = {}
    for name, one in steps.items():
        subsystem = description.subsystems.get(name)
        for port in subsystem.ports if subsystem else ():
            if port.direction == "y":
                has_news = bool(part_of(one.step, ("y", port.peer)))
            else:
                names = (f"{port.peer}.{element.name}" for element in port.elements)
                has_news = any(part_of(one.step, ("fresh", name)) is True for name in names)
            if has_news and (arc := description.arcs.get((name, port.direction, port.peer))):
                found[arc] = None
    return list(found)


def part_of(data: Any, path: Sequence[str]) -> Any:
    """What is below these names; None if there is nothing."""
    for name in path:
        data = data.get(name) if isinstance(data, dict) else None
    return data


def message_of(signal: ListedSignal, steps: LastSteps, plant: Mapping[str, Any] | None) -> Any:
    """The message in which a signal is; `plant` has what is observed of it."""
    if signal.owner == PLANT:
        return {"y": plant}
    one = steps.get(signal.owner)
    return one.step if one is not None else None


def values_of(
    description: Description,
    steps: LastSteps,
    plant: Mapping[str, Any] | None,
    names: Sequence[str] | None,
) -> dict[str, str]:
    """The values of these signals, or of all, as texts with units; states as their names."""
    found = {}
    for name in [*description.subsystems, *description.signals] if names is None else names:
        if name in description.subsystems and name in steps:
            found[name] = str(steps[name].step.get("state"))[:_LONGEST_NAME]
        elif (signal := description.signals.get(name)) is not None:
            data = part_of(message_of(signal, steps, plant), signal.path)
            found[name] = "" if data is None else _value_text(signal, data)
    return found


def frames_of(
    description: Description,
    steps: LastSteps,
    plant: Mapping[str, Any] | None,
    names: Sequence[str] | None,
) -> dict[str, Sequence[float]]:
    """The poses among these signals, or all: x, y, z in m, and an axis times an angle in rad."""
    found: dict[str, Sequence[float]] = {}
    for name in description.signals if names is None else names:
        listed = description.signals.get(name)
        if listed is None or listed.signal is None or not listed.signal.is_pose:
            continue
        data = part_of(message_of(listed, steps, plant), listed.signal.path)
        with suppress(NotKnown):
            if data is not None:
                found[name] = listed.signal.numbers(data)
    return found


def _value_text(signal: ListedSignal, data: Any) -> str:
    try:
        return value_text(signal.type, value_of(signal.type, data))
    except NotKnown as reason:
        return str(reason)


def why_of(explainer: Explainer, one: SeenStep | None) -> list[Message]:
    """The lines of `why` about the last step of a subsystem."""
    if one is None:
        return [_as_data(WhyLine("no step of it is known at this time", 0, "state"))]
    return [_as_data(line) for line in explainer.lines(one)]


def unsent_of(machine: str, since_s: float, state: str, row: str) -> list[Message]:
    """The lines about a state of which the run sent no step: nobody had the page open."""
    since = f"{since_s:.6g} s"
    lines = (
        WhyLine(f"{machine} at {since}: in {state} since {since}, entered then", 0, "state"),
        *([WhyLine(f"by {row}", 1, "row")] if row else []),
        WhyLine("why is not known: no page was open, so few steps were sent", 1, "condition"),
    )
    return [_as_data(line) for line in lines]


def _as_data(line: WhyLine) -> Message:
    return {
        "text": line.text,
        "depth": line.depth,
        "role": line.role,
        "truth": line.truth,
        "place": line.place or None,
        "name": line.name or None,
    }


# Series of numbers over time.


@dataclass(frozen=True, slots=True)
class DrawnSignal:
    """A signal or a machine as lines: what `read` finds in a message of its owner."""

    owner: str
    read: Callable[[Any], Floats]
    words: Sequence[str]
    is_pose: bool = False


def drawn_signal(description: Description, name: str) -> DrawnSignal | None:
    """How a signal is drawn, or the state of a subsystem; None if it cannot be."""
    if subsystem := description.subsystems.get(name):
        names = [state.name for state in subsystem.states]
        number = {name: float(index) for index, name in enumerate(names)}

        def state(message: Any) -> Floats:
            return (number.get(str(part_of(message, ("state",))), math.nan),)

        return DrawnSignal(name, state, names)
    listed = description.signals.get(name)
    if listed is None or (signal := listed.signal) is None:
        return None
    blank = (math.nan,) * len(signal.components)

    def numbers(message: Any) -> Floats:
        data = part_of(message, signal.path)
        try:
            return blank if data is None else signal.numbers(data)
        except NotKnown:
            return blank

    words = signal.components[0].words if signal.components else ()
    return DrawnSignal(listed.owner, numbers, words, signal.is_pose)


def series_of(
    description: Description, name: str, points: Iterable[tuple[float, Any]]
) -> dict[str, Any]:
    """`t`, `lines` and `words` of a signal: `points` are times and the messages of its owner."""
    drawn = drawn_signal(description, name)
    if drawn is None:
        return NO_LINES
    found = [(time_s, drawn.read(message)) for time_s, message in points]
    return lines_of(drawn, [time_s for time_s, _ in found], [row for _, row in found])


def lines_of(drawn: DrawnSignal, times: Sequence[float], rows: Sequence[Floats]) -> dict[str, Any]:
    """`t`, `lines` and `words` of what was read at these times."""
    if drawn.is_pose:
        turned = unwrap_rotations([row[3:] for row in rows])
        rows = [(*row[:3], *turn) for row, turn in zip(rows, turned, strict=True)]
    columns = [list(column) for column in zip(*rows, strict=True)]
    thin_times, thin = decimated(times, columns)
    return {"t": thin_times, "lines": thin, "words": list(drawn.words)}


def decimated(
    times: Sequence[float], columns: Sequence[Sequence[float]]
) -> tuple[Sequence[float], Sequence[Sequence[float]]]:
    """At most `MOST_POINTS` of each column: of more, the least and the greatest of each stretch."""
    count = len(times)
    if count <= MOST_POINTS:
        return times, columns
    stretches = MOST_POINTS // 2
    cuts = [count * number // stretches for number in range(stretches + 1)]
    pieces = [slice(begin, end) for begin, end in pairwise(cuts)]
    thin_times = [times[at] for piece in pieces for at in (piece.start, piece.stop - 1)]
    return thin_times, [
        [value for piece in pieces for value in _extremes(column[piece])] for column in columns
    ]


def _extremes(values: Sequence[float]) -> Iterator[float]:
    """The least and the greatest number, in their order; NaN if there is none."""
    known = [(value, at) for at, value in enumerate(values) if not math.isnan(value)]
    if not known:
        yield from (math.nan, math.nan)
        return
    ends = min(known), max(known, key=lambda pair: pair[0])
    yield from (value for value, _ in sorted(ends, key=lambda pair: pair[1]))
