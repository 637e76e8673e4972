"""The values of a run as plain data and back: what subsystems have in buffers and remember.

Between two ticks, when nothing is under way, these and what the parts of a run say of themselves
(`saved`) are all that the run goes on from: a snapshot.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial
from types import SimpleNamespace
from typing import Any

from specc_runtime.buffers import FRESH, Sent, setter
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

        If it `is_lenient`, another system is to go on: samples are kept although new ones follow,
        and a plant or a judge that cannot tell what it remembers is left out.
        """
        self.is_lenient = is_lenient
        self.lost: list[str] = []
        """What of the data that was asked for has no place in the system, and why."""
        self._layouts = layouts
        self._aside: Any = aside
        self._forms: dict[tuple[str, str], tuple[Form, str]] = dict(_forms(system, layouts))
        self._last: dict[tuple[str, Element], tuple[Any, Any]] = {}
        plant = system.plant
        self._sensed = {(i.subsystem, i.element): i.sensor for i in plant.inputs} if plant else {}

    def __contains__(self, subsystem: object) -> bool:
        """Whether there is such a subsystem."""
        return subsystem in self._layouts

    def encoded(self, kind: str, name: str, value: Any) -> Any:
        """The data of a value of a `sensor`, an `actuator` or a reading; raises NotRecorded."""
        if type(value) is Deferred:
            value = value.value()
        form, shown = self._forms[kind, name]
        try:
            return form.data(value, self._aside)
        except NotRecorded as why:
            raise NotRecorded(f"{shown}, {why}") from None

    def read(self, of: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """The data of sensors, actuators, or what requirements or triggers read, by names."""
        return {name: self.encoded(of, name, value) for name, value in values.items()}

    def found(self, of: str, data: Mapping[str, Any]) -> dict[str, Any]:
        """The values of that which there are in this system; others of its own are `lost`."""
        values = {}
        for name, item in data.items():
            if (of, name) not in self._forms:
                continue
            form, shown = self._forms[of, name]
            try:
                values[name] = form.value(item, self._aside)
            except (Misshapen, NotRecorded) as why:
                self.lost.append(f"the last value of {shown} is not taken over: {why}")
        return values

    def of_sent(self, subsystem: Subsystem, sent: Sent) -> dict[str, Any]:
        """The data of what it sent; raises NotRecorded."""
        layout, buffer = self._layouts[subsystem.name], SimpleNamespace(**dict(sent))
        return self._elements(subsystem, layout.y, buffer)

    def sent(self, subsystem: str, data: Mapping[str, Any]) -> Sent:
        """The values of that, as far as it sends them now."""
        return tuple(self._found(self._layouts[subsystem].y, data)[0].items())

    def of_subsystem(
        self, subsystem: Subsystem, x: Any, entered_s: float, renewed: Collection[tuple[str, str]]
    ) -> dict[str, Any]:
        """Where it is and what it knows; inputs from sensors that are `renewed` are left out.

        They are not where that `is_lenient`: in another system they may not be due.

        `x` are the inputs of its next step, `entered_s` is when it entered its state, `renewed`
        names subsystems with sensors.

        Raises NotRecorded.
        """
        layout = self._layouts[subsystem.name]
        sensed = self._sensed
        inputs = [
            element
            for element in layout.x
            if self.is_lenient
            or (subsystem.name, sensed.get((subsystem.name, element.attribute))) not in renewed
        ]
        there = self._elements(subsystem, inputs, x)
        names = {e.attribute: ".".join(e.name) for e in layout.x}
        flags = {n: getattr(x, FRESH + attribute, None) for attribute, n in names.items()}
        return {
            "state": subsystem.state,
            "entered": entered_s,
            "memory": self._elements(subsystem, layout.memory, subsystem.memory),
            "x": there,
            "awaited": [name for name in names.values() if name not in there],
            "fresh": {name: flag for name, flag in flags.items() if flag is not None},
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
                    name = ".".join(element.name)
                    raise NotRecorded(f"{name} of {subsystem.name}, {why}") from None
                self._last[subsystem.name, element] = last
            found[".".join(element.name)] = last[1]
        return found

    def place(self, subsystem: Subsystem, saved: Mapping[str, Any], stamp: int) -> Iterator[str]:
        """Put it where a snapshot says, after the step of a stamp; gives what has no place there.

        Raises Misshapen for a state that it does not have, and KeyError, TypeError, ValueError.
        """
        name, layout = subsystem.name, self._layouts[subsystem.name]
        state = saved["state"]
        if state and state not in layout.ends:
            raise Misshapen(f"{name} was in {state}, which is no state of it")
        yield from self._place_inputs(subsystem, saved)
        if not state:
            return  # its first step is still to come
        memory, missing = self._found(layout.memory, saved["memory"])
        periods = stamp + 1 - round(saved["entered"] / subsystem.period_s)
        place = partial(_place, subsystem, memory, state, layout.ends[state][2], periods)
        if missing:
            _remember(subsystem, memory, state)
            _begin_anew(subsystem, place)
        else:
            place()
        yield from (f"{name}: memory {n} is as at the beginning: {w}" for n, w in missing.items())
        known = {".".join(e.name) for e in layout.memory}
        yield from (f"{name}: there is no memory {n}" for n in saved["memory"] if n not in known)

    def _place_inputs(self, subsystem: Subsystem, saved: Mapping[str, Any]) -> Iterator[str]:
        """What has no value in the snapshot stays as it is at the beginning of a run."""
        name, x, elements = subsystem.name, subsystem.x, self._layouts[subsystem.name].x
        found, missing = self._found(elements, saved["x"])
        for element in elements:
            shown, flag = ".".join(element.name), FRESH + element.attribute
            if element.attribute in found:
                setter(x, element.attribute)(found[element.attribute])
                if hasattr(x, flag):
                    setattr(x, flag, saved["fresh"].get(shown, False))
                    if shown not in saved["fresh"]:
                        yield f"{name}: whether input {shown} is fresh was not asked: it is not"
            elif shown not in saved["awaited"]:
                yield f"{name}: input {shown} is as at the beginning: {missing[shown]}"

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
    _remember(subsystem, memory, state)
    stepper = Stepper(subsystem)
    stepper.place(state, method)
    stepper.lasted(periods)
    stepper.settle()


def _remember(subsystem: Subsystem, memory: Mapping[str, Any], state: str) -> None:
    subsystem.state = state
    for attribute, value in memory.items():
        setattr(subsystem.memory, attribute, value)


def _begin_anew(subsystem: Subsystem, place: Callable[[], None]) -> None:
    """Let the first period precede the next step, for the memory that has no other value."""
    start = getattr(subsystem, "_start")  # noqa: B009  # of the generated class
    others = subsystem.step

    def step() -> int:  # before assumptions, which may be about memory, are looked at
        start()
        place()
        vars(subsystem)["step"] = others
        return others()

    vars(subsystem)["step"] = step


def _forms(
    system: System, layouts: Mapping[str, Layout]
) -> Iterator[tuple[tuple[str, str], tuple[Form, str]]]:
    """Forms by where they are, each with what it is called."""
    plant = system.plant
    for item in plant.inputs if plant else ():
        element = _element(layouts[item.subsystem].x, item.element)
        yield ("sensor", item.sensor), (element.form, item.sensor)
    for output in plant.outputs if plant else ():
        element = _element(layouts[output.subsystem].y, output.element)
        yield ("actuator", output.actuator), (element.form, output.actuator)
    for of, followers in (("requirements", system.requirements), ("triggers", system.triggers)):
        for reading in followers.readings if followers else ():
            yield (of, reading.attribute), _form_of(reading, layouts)


def _form_of(reading: Reading, layouts: Mapping[str, Layout]) -> tuple[Form, str]:
    if reading.asks_presence:
        return TRUTH, reading.attribute
    if reading.kind == "state":
        return TEXT, f"the state of {reading.subsystem}"
    part = getattr(layouts[reading.subsystem], PART[reading.kind])
    element = _element(part, reading.element)
    return element.form, f"{'.'.join(element.name)} of {reading.subsystem}"


def _element(elements: Iterable[Element], attribute: str) -> Element:
    return next(element for element in elements if element.attribute == attribute)
