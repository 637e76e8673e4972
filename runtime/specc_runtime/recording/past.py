"""Going on from a recording: until a moment, subsystems do what was recorded, then they compute.

Plant, sensors, buffers and judge go through that past as in any run, so nothing of their state has
to be kept: the commands are those of the recorded run, and random numbers follow from its seed. The
file is read twice, first to see what of it can be used; of its steps only those are in memory that
are about to be made.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from specc_runtime.forms import Element, Layout, Misshapen, NotRecorded
from specc_runtime.loading import load_layouts
from specc_runtime.options import UsageError
from specc_runtime.recording.messages import NOTHING, Shelved, about, step_of, steps_of, within
from specc_runtime.recording.reading import Unusable
from specc_runtime.recording.steps import topic_of
from specc_runtime.recording.text import dumped
from specc_runtime.sampling import PLANT
from specc_runtime.stepping import Stepper
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System

_EARLIER_S = 1e-6
_MOST_DIGITS = 4000
"""Of a seed; Python reads no more."""


class Past:
    """The steps of a recording that began before a moment.

    `seed` is that of the run; `lost` says what the specification has no place for.
    """

    def __init__(
        self, file: Path, until_s: float, built_with: Mapping[str, str] | None = None
    ) -> None:
        """Raises UsageError for a file that cannot be used, or does not reach that far."""
        try:
            told = about(file)
            if told.get("exact") != "true":
                raise Unusable(f"{file} was recorded without --record-exact, so nothing goes on")
        except Unusable as error:
            raise UsageError(str(error)) from error
        self._file = file
        self._until_s = until_s
        seed = told.get("seed", "")
        if not seed.isdecimal() or len(seed) > _MOST_DIGITS:
            raise UsageError(f"{file} does not say with which seed it was recorded")
        self.seed = int(seed)
        self.lost: list[str] = []
        if told.get("set") != dumped(dict(built_with or {})).decode():
            self.lost.append(f"the recorded run had other constants set: {told.get('set')}")

    def enter(self, system: System) -> None:
        """Have the subsystems do what they did; they are at their beginning.

        Raises UsageError for a file that cannot be used or does not reach that far, and for a state
        that a subsystem was in and does not have.
        """
        layouts = load_layouts(system)
        subsystems = {topic_of(s.subsystem.name): s.subsystem for s in system.subsystems}
        pasts = {topic: _Told(s, layouts[s.name]) for topic, s in subsystems.items()}
        try:
            last_s, others = self._seen(pasts)
        except (Unusable, Misshapen) as error:
            raise UsageError(f"the recording cannot be used: {error}") from error
        if self._until_s > last_s + _EARLIER_S:
            raise UsageError(f"{self._file} ends at {last_s:g} s, before {self._until_s:g} s")
        if others and not any(past.is_known for past in pasts.values()):
            raise UsageError(f"{self._file} is of another system: it has no step of {system.name}")
        for past in pasts.values():
            self.lost += past.lost()
        self.lost += [f"{topic[1:]}: there is no such subsystem" for topic in others]
        counts = {topic: past.count for topic, past in pasts.items() if past.count}
        again = {topic: _Told(s, layouts[s.name]) for topic, s in subsystems.items()}
        feed = _Feed(self._file, again, counts)
        for topic, count in counts.items():
            subsystem = subsystems[topic]
            _Puppet(subsystem, layouts[subsystem.name], feed, topic, count)

    def _seen(self, pasts: Mapping[str, _Told]) -> tuple[float, list[str]]:
        """Go through the file: its last simulated time in s, and topics that nobody has."""
        shelf = Shelved()
        last_s = 0.0
        others: dict[str, None] = {}
        for topic, time_s, text in steps_of(self._file, shelf, images=False):
            last_s = max(last_s, time_s)
            if topic == topic_of(PLANT) or time_s >= self._until_s - _EARLIER_S:
                continue
            if topic in pasts:
                pasts[topic].take(text, shelf)
            else:
                others[topic] = None
        return last_s, list(others)


@dataclass(frozen=True, slots=True)
class _Step:
    """What a step was: elements of `y` and `memory` that have a new value."""

    state: str
    transition: str
    y: Mapping[str, Any]
    memory: Mapping[str, Any]


class _Told:
    """What a recording says of a subsystem, step by step, as far as `count`."""

    def __init__(self, subsystem: Subsystem, layout: Layout) -> None:
        self.count = 0
        self.is_known = False
        self._name = subsystem.name
        self._layout = layout
        self._is_over = False
        self._unsent = ""
        self._known = {element.name[0] for element in layout.memory}
        self._foreign: list[str] = []
        self._why: dict[str, str] = {}
        self._last: dict[Element, Any] = {}

    def take(self, text: bytes, shelf: Shelved) -> _Step | None:
        """The next step, None if it is to be computed; raises Misshapen, UsageError."""
        self.is_known = True
        if self._is_over:
            return None
        told = step_of(text)
        if "fault" in told:  # it is met again
            self._is_over = True
            return None
        if told["stamp"] != self.count:
            raise Misshapen(f"{self._name}: the step of stamp {self.count} was not recorded")
        if told["state"] not in self._layout.ends:
            raise UsageError(f"{self._name} was in {told['state']}, which is no state of it")
        if type(told.get("y")) is not dict or type(told.get("memory")) is not dict:
            raise Misshapen(f"{self._name} has a step without outputs or memory")
        self._foreign = [name for name in told["memory"] if name not in self._known]
        y: dict[str, Any] = {}
        for element in self._layout.y:
            try:
                y |= self._new(element, told["y"], shelf)
            except NotRecorded:
                self._unsent, self._is_over, self.count = ".".join(element.name), True, 0
                return None
        memory: dict[str, Any] = {}
        for element in self._layout.memory:
            try:
                memory |= self._new(element, told["memory"], shelf)
            except (NotRecorded, Misshapen) as why:
                self._why[element.name[0]] = str(why)
        self.count += 1
        return _Step(told["state"], told["transition"], y, memory)

    def _new(self, element: Element, data: Any, shelf: Shelved) -> dict[str, Any]:
        """The value of an element by its attribute, if it has one that is not that of before."""
        found = within(data, element)
        if found is NOTHING or self._last.get(element, NOTHING) == found:
            return {}
        value = element.form.value(found, shelf)
        self._last[element] = found
        self._why.pop(element.name[0], "")
        return {element.attribute: value}

    def lost(self) -> Iterator[str]:
        """What the specification does not have any more, or has anew, when the past is over."""
        if self._unsent:
            why = f"y.{self._unsent} was not recorded"
            yield f"{self._name}: is computed from the beginning: {why}"
        if not self.count:
            return
        yield from (f"{self._name}: there is no memory {name}" for name in self._foreign)
        for element in self._layout.memory:
            name = element.name[0]
            why = self._why.get(name, "" if element in self._last else "there was none")
            if why:
                yield f"{self._name}: memory {name} is as at the beginning: {why}"


class _Feed:
    """The steps of a file as they are needed, which may be in several threads."""

    def __init__(self, file: Path, pasts: Mapping[str, _Told], counts: Mapping[str, int]) -> None:
        """The first steps of each subsystem, `counts` of them."""
        self._shelf = Shelved()
        self._steps = steps_of(file, self._shelf, images=False)
        self._pasts = pasts
        self._left = dict(counts)
        self._ahead: dict[str, deque[_Step]] = {topic: deque() for topic in counts}
        self._lock = Lock()

    def next(self, topic: str) -> _Step:
        """The next step of a subsystem; raises Misshapen if the file has changed meanwhile."""
        with self._lock:
            while not self._ahead[topic]:
                found, _, text = next(self._steps, ("", 0.0, b""))
                if not found:
                    raise Misshapen("the recording is not what it was")
                if self._left.get(found, 0):
                    self._left[found] -= 1
                    step = self._pasts[found].take(text, self._shelf)
                    if step is None:
                        raise Misshapen("the recording is not what it was")
                    self._ahead[found].append(step)
            return self._ahead[topic].popleft()


class _Puppet:
    """A subsystem that does what was recorded for a number of steps."""

    def __init__(
        self, subsystem: Subsystem, layout: Layout, feed: _Feed, topic: str, count: int
    ) -> None:
        self._subsystem = subsystem
        self._layout = layout
        self._feed = feed
        self._topic = topic
        self._count = count
        self._rows = {str(row): index for index, row in enumerate(subsystem.transitions)}
        self._step = subsystem.step
        self._stamp = 0
        self._entered = 0
        vars(subsystem)["step"] = self._made

    def _made(self) -> int:
        """In the place of the subsystem's own step."""
        stamp, self._stamp = self._stamp, self._stamp + 1
        if stamp < self._count:
            if stamp == 0:  # what is not recorded, and never changes, comes from here
                self._step()
            return self._recorded(self._feed.next(self._topic), stamp)
        if stamp == self._count:
            state = self._subsystem.state
            stepper = Stepper(self._subsystem)
            stepper.place(state, self._layout.ends[state][2])
            stepper.lasted(stamp - self._entered)
        return self._step()

    def _recorded(self, step: _Step, stamp: int) -> int:
        subsystem = self._subsystem
        for buffer, values in ((subsystem.y, step.y), (subsystem.memory, step.memory)):
            for attribute, value in values.items():
                setattr(buffer, attribute, value)
        subsystem.state = step.state
        if step.transition:
            self._entered = stamp
        return self._rows.get(step.transition, -1)
