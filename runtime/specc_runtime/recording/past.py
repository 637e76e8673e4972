"""Going on from a recording: until a moment, subsystems do what was recorded, then they compute.

Plant, sensors, buffers and judge go through that past as in any run, so nothing of their state has
to be kept: the commands are those of the recorded run, and random numbers follow from its seed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from math import inf
from pathlib import Path
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
            self._shelf = Shelved(inf)
            self._texts: dict[str, list[bytes]] = {}
            last_s = 0.0
            for topic, time_s, text in steps_of(file, self._shelf, images=False):
                last_s = max(last_s, time_s)
                if time_s < until_s - _EARLIER_S and topic != topic_of(PLANT):
                    self._texts.setdefault(topic, []).append(text)
        except (Unusable, Misshapen) as error:
            raise UsageError(str(error)) from error
        if until_s > last_s + _EARLIER_S:
            raise UsageError(f"{file} ends at {last_s:g} s, before {until_s:g} s")
        seed = told.get("seed", "")
        if not seed.isdecimal() or len(seed) > _MOST_DIGITS:
            raise UsageError(f"{file} does not say with which seed it was recorded")
        self.seed = int(seed)
        self.lost: list[str] = []
        if told.get("set") != dumped(dict(built_with or {})).decode():
            self.lost.append(f"the recorded run had other constants set: {told.get('set')}")

    def enter(self, system: System) -> None:
        """Have the subsystems do what they did; they are at their beginning.

        Raises UsageError for a state that a subsystem was in and does not have.
        """
        layouts = load_layouts(system)
        for scheduled in system.subsystems:
            subsystem = scheduled.subsystem
            texts = self._texts.pop(topic_of(subsystem.name), [])
            puppet = _Puppet(subsystem, layouts[subsystem.name], texts, self._shelf)
            try:
                self.lost += puppet.lost()
            except Misshapen as error:
                raise UsageError(f"the recording cannot be used: {error}") from error
        self.lost += [f"{topic[1:]}: there is no such subsystem" for topic in self._texts]


class _Puppet:
    """A subsystem that does what was recorded until that is over."""

    def __init__(
        self, subsystem: Subsystem, layout: Layout, texts: list[bytes], shelf: Shelved
    ) -> None:
        self._subsystem = subsystem
        self._layout = layout
        self._texts = texts
        self._shelf = shelf
        self._rows = {str(row): index for index, row in enumerate(subsystem.transitions)}
        self._step = subsystem.step
        self._stamp = 0
        self._entered = 0
        self._last: dict[Element, Any] = {}
        vars(subsystem)["step"] = self._made

    def lost(self) -> Iterator[str]:
        """What the specification does not have any more, or has anew, when the past is over."""
        name = self._subsystem.name
        told: dict[str, Any] = {}
        for index, text in enumerate(self._texts):
            step = step_of(text)
            if "fault" in step:
                del self._texts[index:]  # it is met again
                break
            told = step
            if told["state"] not in self._layout.ends:
                raise UsageError(f"{name} was in {told['state']}, which is no state of it")
            if "y" not in told or "memory" not in told:
                raise Misshapen(f"{name} has a step without outputs or memory")
            missing = self._unsent(told["y"])
            if missing:
                self._texts.clear()
                yield f"{name}: is computed from the beginning: y.{missing} was not recorded"
                return
        if not told:
            return
        known = {element.name[0]: element for element in self._layout.memory}
        yield from (f"{name}: there is no memory {m}" for m in told["memory"].keys() - known.keys())
        for item, element in known.items():
            found = within(told["memory"], element)
            try:
                if found is NOTHING:
                    raise NotRecorded("there was none")
                element.form.value(found, self._shelf)
            except (NotRecorded, Misshapen) as why:
                yield f"{name}: memory {item} is as at the beginning: {why}"

    def _unsent(self, data: Any) -> str:
        """The name of what was sent and cannot be sent again; empty if there is nothing."""
        for element in self._layout.y:
            found = NOTHING if element.form.is_plain else within(data, element)
            if found is not NOTHING:
                try:
                    element.form.value(found, self._shelf)
                except NotRecorded:
                    return ".".join(element.name)
        return ""

    def _made(self) -> int:
        """In the place of the subsystem's own step."""
        stamp, self._stamp = self._stamp, self._stamp + 1
        if stamp < len(self._texts):
            if stamp == 0:  # what is not recorded, and never changes, comes from here
                self._step()
            return self._recorded(step_of(self._texts[stamp]), stamp)
        if stamp == len(self._texts) and stamp:
            state = self._subsystem.state
            stepper = Stepper(self._subsystem)
            stepper.place(state, self._layout.ends[state][2])
            stepper.lasted(stamp - self._entered)
        return self._step()

    def _recorded(self, told: Mapping[str, Any], stamp: int) -> int:
        if told["stamp"] != stamp:
            raise Misshapen(f"the step of stamp {stamp} was not recorded")
        subsystem = self._subsystem
        for element in self._layout.y:
            self._put(subsystem.y, element, told["y"])
        for element in self._layout.memory:
            with suppress(NotRecorded, Misshapen):  # see `lost`
                self._put(subsystem.memory, element, told["memory"])
        subsystem.state = told["state"]
        if told["transition"]:
            self._entered = stamp
        return self._rows.get(told["transition"], -1)

    def _put(self, buffer: Any, element: Element, data: Any) -> None:
        """Give an element its recorded value, if it has one that is new."""
        found = within(data, element)
        if found is not NOTHING and self._last.get(element, NOTHING) != found:
            setattr(buffer, element.attribute, element.form.value(found, self._shelf))
            self._last[element] = found
