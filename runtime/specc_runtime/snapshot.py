"""The values of a run as plain data and back: what subsystems have in buffers and remember.

Between two ticks, when nothing is under way, these and what the parts of a run say of themselves
(`saved`) are all that the run goes on from: a snapshot.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

from specc_runtime.buffers import FRESH, PRESENT, setter
from specc_runtime.forms import (
    TEXT,
    TRUTH,
    Aside,
    Element,
    Fetch,
    Form,
    Layout,
    Misshapen,
    NotRecorded,
)
from specc_runtime.plant import Deferred
from specc_runtime.requirements import Reading
from specc_runtime.stepping import Stepper
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System

PART = {"memory": "memory", "reported": "x", "sent": "y", "observed": "y"}
"""The part of a layout, or of a message, that has what a reading of requirements asks for."""
_NOTHING = object()


class Values:
    """The forms of all values of a system, by where they are."""

    def __init__(
        self,
        system: System,
        layouts: Mapping[str, Layout],
        aside: Aside | Fetch,
        *,
        is_lenient: bool = False,
    ) -> None:
        """`aside` takes or has what does not stand in a snapshot itself.

        What cannot be kept is left out if that `is_lenient`.
        """
        self.is_lenient = is_lenient
        self._layouts = layouts
        self._aside: Any = aside
        self._forms: dict[tuple[str, str], Form] = dict(_forms(system, layouts))
        self._last: dict[tuple[str, Element], tuple[Any, Any]] = {}
        plant = system.plant
        self._sensed = {(i.subsystem, i.element): i.sensor for i in plant.inputs} if plant else {}

    def __contains__(self, subsystem: object) -> bool:
        """Whether there is such a subsystem."""
        return subsystem in self._layouts

    def has(self, kind: str, name: str) -> bool:
        """Whether there is such a sensor, actuator or reading."""
        return (kind, name) in self._forms

    def told(self, kind: str, name: str, value: Any) -> Any:
        """The data of a value of a `sensor`, an `actuator` or a reading; raises NotRecorded."""
        if type(value) is Deferred:
            value = value.value()
        return self._forms[kind, name].data(value, self._aside)

    def value(self, kind: str, name: str, data: Any) -> Any:
        """The value of the data; raises LookupError, Misshapen, NotRecorded."""
        return self._forms[kind, name].value(data, self._aside)

    def read(self, of: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """The data of what requirements or triggers read, by attributes."""
        return {name: self.told(of, name, value) for name, value in values.items()}

    def values_read(self, of: str, data: Mapping[str, Any]) -> dict[str, Any]:
        """The values of that, as far as anything reads them now."""
        return {n: self.value(of, n, item) for n, item in data.items() if (of, n) in self._forms}

    def of_subsystem(
        self, subsystem: Subsystem, x: Any, renewed: Collection[str]
    ) -> dict[str, Any]:
        """Where it is and what it knows; inputs from sensors that are `renewed` are left out.

        They are not where that `is_lenient`: in another system they may not be due.

        `x` are the inputs of its next step.

        Raises NotRecorded.
        """
        layout = self._layouts[subsystem.name]
        sensed = self._sensed
        inputs = [
            element
            for element in layout.x
            if self.is_lenient or sensed.get((subsystem.name, element.attribute)) not in renewed
        ]
        return {
            "state": subsystem.state,
            "periods": vars(subsystem).get("_periods", 0),
            "memory": self._elements(subsystem, layout.memory, subsystem.memory),
            "x": self._elements(subsystem, inputs, x),
            "fresh": [e.name for e in layout.x if getattr(x, FRESH + e.attribute, False)],
            "present": [e.name for e in layout.x if getattr(x, PRESENT + e.attribute, False)],
        }

    def _elements(
        self, subsystem: Subsystem, elements: Iterable[Element], buffer: Any
    ) -> dict[str, Any]:
        found = {}
        for element in elements:
            value = getattr(buffer, element.attribute, _NOTHING)
            if value is _NOTHING:
                continue
            if type(value) is Deferred:
                value = value.value()
            last = self._last.get((subsystem.name, element))
            if last is None or last[0] is not value:
                try:
                    last = value, element.form.data(value, self._aside)
                except NotRecorded as why:
                    if self.is_lenient:
                        continue
                    name = ".".join(element.name)
                    raise NotRecorded(f"{name} of {subsystem.name}, {why}") from None
                self._last[subsystem.name, element] = last
            found[".".join(element.name)] = last[1]
        return found

    def place(self, subsystem: Subsystem, saved: Mapping[str, Any]) -> Iterator[str]:
        """Put it where a snapshot says; gives what of it has no place there.

        Raises Misshapen for a state that it does not have, and KeyError, TypeError, ValueError.
        """
        name, layout = subsystem.name, self._layouts[subsystem.name]
        state = saved["state"]
        if state not in layout.ends:
            raise Misshapen(f"{name} was in {state}, which is no state of it")
        x = subsystem.x
        for attribute, value in self._found(layout.x, saved["x"])[0].items():
            setter(x, attribute)(value)
        for element in layout.x:
            for prefix, raised in ((FRESH, saved["fresh"]), (PRESENT, saved["present"])):
                if hasattr(x, prefix + element.attribute):
                    setattr(x, prefix + element.attribute, list(element.name) in raised)
        memory, missing = self._found(layout.memory, saved["memory"])
        method, periods = layout.ends[state][2], int(saved["periods"]) + 1
        _place(subsystem, memory, state, method, periods)
        if missing:
            _begin_anew(subsystem, partial(_place, subsystem, memory, state, method, periods))
        yield from (f"{name}: memory {n} is as at the beginning: {w}" for n, w in missing.items())
        known = {".".join(e.name) for e in layout.memory}
        yield from (f"{name}: there is no memory {n}" for n in saved["memory"] if n not in known)

    def _found(
        self, elements: Iterable[Element], data: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, str]]:
        """The values of elements by attributes, and why there is none of the others, by names."""
        found: dict[str, Any] = {}
        missing: dict[str, str] = {}
        for element in elements:
            name = ".".join(element.name)
            try:
                found[element.attribute] = element.form.value(data[name], self._aside)
            except KeyError:
                missing[name] = "there was none"
            except (Misshapen, NotRecorded) as why:
                missing[name] = str(why)
        return found, missing


def _place(
    subsystem: Subsystem, memory: Mapping[str, Any], state: str, method: str, periods: int
) -> None:
    for attribute, value in memory.items():
        setattr(subsystem.memory, attribute, value)
    stepper = Stepper(subsystem)
    stepper.place(state, method)
    stepper.lasted(periods)


def _begin_anew(subsystem: Subsystem, place: Callable[[], None]) -> None:
    """Let the first period precede the next step, for the memory that has no other value."""
    start = getattr(subsystem, "_start")  # noqa: B009  # of the generated class

    def work() -> int:
        start()
        place()
        return int(vars(subsystem)["_work"]())

    vars(subsystem)["_work"] = work


def _forms(system: System, layouts: Mapping[str, Layout]) -> Iterator[tuple[tuple[str, str], Form]]:
    plant = system.plant
    for item in plant.inputs if plant else ():
        yield ("sensor", item.sensor), _form(layouts[item.subsystem].x, item.element)
    for output in plant.outputs if plant else ():
        yield ("actuator", output.actuator), _form(layouts[output.subsystem].y, output.element)
    for of, followers in (("requirements", system.requirements), ("triggers", system.triggers)):
        for reading in followers.readings if followers else ():
            yield (of, reading.attribute), _form_of(reading, layouts)


def _form_of(reading: Reading, layouts: Mapping[str, Layout]) -> Form:
    if reading.asks_presence:
        return TRUTH
    if reading.kind == "state":
        return TEXT
    return _form(getattr(layouts[reading.subsystem], PART[reading.kind]), reading.element)


def _form(elements: Iterable[Element], attribute: str) -> Form:
    return next(element.form for element in elements if element.attribute == attribute)
