"""What is in a recording whose specification cannot be read: the data of its messages as it is."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

from specc.diagnostics.phrases import truncate
from specc.model.bindings import PLANT
from specc.refusal import Refused
from specc.tools.page.messages import Message
from specc.tools.page.moments import decimated, part_of
from specc.tools.page.recorded import Recording, SeenSteps, line_of
from specc.tools.why import Steps

_LONGEST_VALUE = 120
_MOST_SIGNALS, _MOST_COMPONENTS = 2000, 12
_LARGEST = 1e100
_WITHOUT = "the specification in the file cannot be read: why is not known"


class RawContent:
    """What is in the messages, as it is there."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._signals: dict[str, tuple[str, tuple[str, ...]]] = {}
        self._states: dict[str, list[str]] = {}

    def _look(self) -> None:
        """Find the names of signals and states in what is read of the file."""
        recording, index = self._recording, self._recording.index
        try:
            steps = recording.steps(index.end_s)
        except Refused:
            steps = {}
        plant = recording.ask("observed_at", index.end_s) or {}
        every = (*_of_steps(steps), *((f"{PLANT}.{n}", PLANT, ("y", n)) for n in plant))
        self._signals = {name: (owner, path) for name, owner, path in islice(every, _MOST_SIGNALS)}
        self._states = {
            name: list(dict.fromkeys(state for *_, state in spans))
            for name, spans in recording.spans().items()
        }

    def message(self) -> Message:
        """See `RecordedContent`."""
        self._look()
        entries = self._recording.index.report.get("requirements")
        required = entries if isinstance(entries, list) else []
        name = self._recording.about.get("system", "")
        return {
            "title": name,
            "system": name,
            "machines": [_machine(*item) for item in self._states.items()],
            "structure": None,
            "parts": {},
            "signals": [*map(_state_signal, self._states), *map(_signal, self._signals)],
            "usual": [],
            "requirements": [
                {
                    "that": str(r.get("that")),
                    "because": str(r.get("because")),
                    "place": None,
                    "constants": {},
                }
                for r in required
                if isinstance(r, dict)
            ],
            "frames": [],
            "poses": [],
            "constants": [],
        }

    def values(
        self, steps: SeenSteps, plant: Mapping[str, Any], names: Sequence[str] | None
    ) -> dict[str, str]:
        """See `RecordedContent`."""
        found = {}
        for name in [*self._states, *self._signals] if names is None else names:
            if name in self._states and name in steps:
                found[name] = str(steps[name].step["state"])
            elif name in self._signals:
                owner, path = self._signals[name]
                step = {"y": plant} if owner == PLANT else getattr(steps.get(owner), "step", None)
                data = part_of(step, path)
                found[name] = "" if data is None else truncate(json.dumps(data), _LONGEST_VALUE)
        return found

    def frames(
        self, steps: SeenSteps, plant: Mapping[str, Any], names: Sequence[str] | None
    ) -> dict[str, Sequence[float]]:
        """See `RecordedContent`."""
        return {}

    def flow(self, steps: SeenSteps) -> list[str]:
        """See `RecordedContent`."""
        return []

    def owner(self, name: str) -> str:
        """See `RecordedContent`."""
        return name if name in self._states else self._signals.get(name, ("",))[0]

    def series(self, name: str, points: Iterable[tuple[float, Any]]) -> Message:
        """See `RecordedContent`."""
        times: list[float] = []
        rows: list[Sequence[float]] = []
        words = self._states.get(name, [])
        path = ("state",) if words else self._signals[name][1]
        for time_s, message in points:
            data = part_of(message, path)
            times.append(time_s)
            rows.append([_index(words, data)] if words else _numbers(data))
        width = max(map(len, rows), default=0)
        columns = [[row[i] if i < len(row) else math.nan for row in rows] for i in range(width)]
        thin_times, thin = decimated(times, columns)
        return {"t": thin_times, "lines": thin, "words": words}

    def violation(self, that: str, since_s: float, steps: Steps) -> list[str]:
        """See `RecordedContent`."""
        return []

    def why(self, one: Any) -> list[Message]:
        """See `RecordedContent`."""
        step = one.step
        since = "" if one.since_s is None else f" since {one.since_s:g} s"
        lines = [
            line_of(f"{one.name} at {step['time']:g} s: in {step['state']}{since}", 0, "state")
        ]
        lines += [line_of(f"by {one.row}", 1, "row")] if one.row else []
        if fault := step.get("fault"):
            lines.append(line_of(f"fault in this step: {fault}", 1, "fault"))
        for name, truth in step["conditions"].items():
            is_truth = isinstance(truth, bool)
            lines.append(line_of(name, 1, "condition", truth if is_truth else None))
        return [*lines, line_of(_WITHOUT, 1)]


def _of_steps(steps: SeenSteps) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """The elements of buffers and memory: name, owner, and where they are in a step."""
    for owner, one in steps.items():
        for part in ("x", "y"):
            for peer, elements in _items(one.step.get(part)):
                for name, _ in _items(elements):
                    yield f"{owner}.{part}.{peer}.{name}", owner, (part, peer, name)
        for name, _ in _items(one.step.get("memory")):
            yield f"{owner}.{name}", owner, ("memory", name)


def _items(data: Any) -> Iterable[tuple[str, Any]]:
    return data.items() if isinstance(data, dict) else ()


def _machine(name: str, states: Sequence[str]) -> Message:
    """A machine of which only the states are known."""
    known: list[Message] = [
        {"name": s, "title": "", "id": None, "is_error": False, "modes": [], "place": None}
        for s in states
    ]
    return {"name": name, "title": "", "period_s": None, "svg": None, "states": known,
            "rows": [], "modes": []}  # fmt: skip


def _state_signal(name: str) -> Message:
    return {**_signal(name), "kind": "state"}


def _signal(name: str) -> Message:
    return {"name": name, "title": "", "unit": "", "kind": "numbers", "components": []}


def _index(words: Sequence[str], data: Any) -> float:
    return float(words.index(data)) if data in words else math.nan


def _numbers(data: Any) -> list[float]:
    """The numbers of a value or of a short list; NaN for what is none."""
    items = data if isinstance(data, list) else [data]
    return [
        float(item) if isinstance(item, int | float) and abs(item) < _LARGEST else math.nan
        for item in items[:_MOST_COMPONENTS]
    ]
