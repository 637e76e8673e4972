"""The operator's panel: its elements, their values while a system runs, and who gives them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any, Literal

from specc_runtime.changes import KEYS, PAGE, PROGRAM, TASK, Event, EventQueue, number_within
from specc_runtime.clock import WallClock

PanelKind = Literal["button", "switch", "slider", "choice", "number"]
PanelValue = bool | float | str
"""Of a choice, the name of a member."""

DEAD_MAN_S = 0.2
"""Wall time after its last sign of life in which a button that is held stays pressed."""
LATEST_S = 0.5
"""Wall time that a sign of life may be on its way; a paused run shows its time every 0.25 s."""


@dataclass(frozen=True, slots=True)
class PanelElement:
    """One element of the panel, as its specification declares it; numbers are in SI units.

    Attributes:
        name: of the binding, e.g. "desk.R.buttons.start".
        kind: what the operator sees.
        initial: the value until the operator changes it: a bool of a button or a switch, the name
            of a member of a choice, a number of a slider, and of a number, an int if it is whole.
        least: the least value of a slider or a number.
        greatest: the greatest value of a slider or a number.
        choices: the names of the members of a choice.
        hold: whether a button is true while it is held, and not once after it was pressed.
        key: the key of a terminal that operates it; empty if none is given.
        unit: of a slider or a number, e.g. "m/s"; empty if it has none.
        title: the words of the specification for the element; empty if there are none.
    """

    name: str
    kind: PanelKind
    initial: bool | float | str = False
    least: float | None = None
    greatest: float | None = None
    choices: tuple[str, ...] = ()
    hold: bool = False
    key: str = ""
    unit: str = ""
    title: str = ""

    def checked(self, value: Any) -> PanelValue:
        """A value that the operator may give it; raises ValueError for any other one."""
        if self.least is not None and self.greatest is not None:
            least, greatest = self.least, self.greatest
            whole = self.is_whole
            return number_within(self.name, value, least, greatest, self.unit, whole=whole)
        if self.kind == "choice":
            if type(value) is not str or value not in self.choices:
                among = ", ".join(self.choices)
                raise ValueError(f"{self.name} is not {value!r}: it is one of {among}")
            return value
        if type(value) is not bool:
            raise ValueError(f"{self.name} is true or false, and not {value!r}")
        if self.is_event and value is False:
            raise ValueError(f"{self.name} is a button that can only be pressed: true")
        return value

    @property
    def is_whole(self) -> bool:
        """Whether it is a whole number."""
        return type(self.initial) is int

    @property
    def is_event(self) -> bool:
        """Whether it is a button that is pressed, and not held."""
        return self.kind == "button" and not self.hold

    def of_number(self, number: float) -> Any:
        """The value that a number of a task stands for: of a choice, the one that it counts."""
        if self.kind == "choice":
            return self.choices[round(number)]
        if self.kind in ("button", "switch"):
            return bool(number)
        return round(number) if self.is_whole else number


@dataclass(frozen=True, slots=True)
class Operation(Event):
    """What an element is from a base tick on, and who did that; a button is pressed there."""

    element: str
    value: PanelValue
    by: str


class Panel:
    """The panel of a run; all who read it see an operation at the same base tick.

    `values` are those of now, by names. A button is true from the tick on at which it is pressed
    until its reader has read it, however often it is pressed meanwhile.
    """

    def __init__(self, elements: Iterable[PanelElement], clock: WallClock) -> None:
        """The clock tells how old signs of life are."""
        self.elements = {element.name: element for element in elements}
        self.values: dict[str, PanelValue] = {
            name: element.initial for name, element in self.elements.items()
        }
        self.requests = dict(self.values)
        """What was asked for last, which may not be so yet."""
        self._clock = clock
        self._queue = EventQueue[Operation]()
        self._lock = Lock()
        self._signs: dict[str, float] = {}
        """When the last sign of life came of each button that the page holds."""
        self._locked: set[str] = set()
        """Buttons that have to be let go before the page may hold them again."""
        self._task_holds: set[str] = set()

    def operate(self, name: str, value: Any, by: str = PROGRAM, tick: int = 0) -> None:
        """Give an element a value, or press a button, at that base tick, or else at the next one.

        Raises ValueError for an unknown name, a value that the element does not take, and a button
        that has to be held by signs of life.
        """
        element = self._element(name)
        if element.hold and by in (PAGE, KEYS):
            raise ValueError(f"{name} has to be held")
        self.requests[name] = valid = element.checked(value)
        self._queue.ask(Operation(tick, name, valid, by))

    def hold(self, name: str, seen_s: float) -> None:
        """A sign of life of a button that is held in the page, which presses it if it is not.

        `seen_s` is the newest time of the run's clock that the page knew when it sent the sign. One
        that waited longer than `LATEST_S` on its way, as in a server that was stopped, is none.

        `DEAD_MAN_S` after the last sign the button is released. From then on there has to be a
        `release` before it can be pressed again: signs that come late press nothing.

        Raises ValueError for what is no button to hold.
        """
        self._button(name)
        with self._lock:
            if name in self._locked or self._clock.now_s() - seen_s > LATEST_S:
                return
            if name not in self._signs:
                self._queue.ask(Operation(0, name, True, PAGE))
            self._signs[name] = self._clock.now_s()

    def release(self, name: str) -> None:
        """The button is not held any more. Raises ValueError for what is no button to hold."""
        self._button(name)
        with self._lock:
            self._locked.discard(name)
            if self._signs.pop(name, None) is not None or self.values[name]:
                self._queue.ask(Operation(0, name, False, PAGE))

    def hold_by_task(self, name: str, is_held: bool) -> None:
        """Hold a button from now on, or not any more; nothing for what is no button to hold."""
        if not self._element(name).hold or is_held == (name in self._task_holds):
            return
        (self._task_holds.add if is_held else self._task_holds.discard)(name)
        self._queue.ask(Operation(0, name, is_held, TASK))

    def _element(self, name: str) -> PanelElement:
        if name not in self.elements:
            known = ", ".join(self.elements) or "none"
            raise ValueError(f"{name} is no element of the panel; there are: {known}")
        return self.elements[name]

    def _button(self, name: str) -> None:
        if not self._element(name).hold:
            raise ValueError(f"{name} is no button that is held")

    def begin(self, tick: int) -> list[Operation]:
        """Make the operations that are asked for by this base tick, and return them."""
        if self._signs:
            self._release_the_dead()
        made = self._queue.begin(tick)
        for operation in made:
            self.values[operation.element] = operation.value
        return made

    def _release_the_dead(self) -> None:
        with self._lock:
            now_s = self._clock.now_s()
            for name in [n for n, sign_s in self._signs.items() if now_s - sign_s > DEAD_MAN_S]:
                del self._signs[name]
                self._locked.add(name)
                self._queue.ask(Operation(0, name, False, PAGE))

    def sample(self, name: str) -> PanelValue:
        """The value of now; see `specc_runtime.plant.Plant`."""
        return self.values[name]

    def was_read(self, button: str) -> None:
        """A step has read a button."""
        self.values[button] = False

    @property
    def operations(self) -> list[Operation]:
        """Those that were made."""
        return self._queue.history

    def schedule(self, operations: Iterable[Operation], tick: int) -> None:
        """Make operations of a recorded run again, at their ticks; others are left out.

        At the base tick with which the run goes on by itself, nobody holds what the page held.
        """
        last = {operation.element: operation for operation in self.operations}
        for operation in operations:
            with suppress(ValueError):  # of another specification
                value = self._element(operation.element).checked(operation.value)
                self.requests[operation.element] = value
                self._queue.ask(replace(operation, value=value))
                last[operation.element] = operation
        for name, operation in last.items():
            is_held = name in self.elements and self.elements[name].hold and operation.value
            if is_held and operation.by == PAGE:
                self._queue.ask(Operation(tick, name, False, PAGE))

    def saved(self) -> dict[str, Any]:
        """The values and the operations until now, as plain data."""
        operations = [operation.as_data() for operation in self.operations]
        return {"values": dict(self.values), "operations": operations}

    def restore(self, saved: Mapping[str, Any]) -> list[str]:
        """Go on from there; gives what of it has no place. Raises KeyError, TypeError, ValueError
        for other data.
        """
        lost = []
        for name, value in saved["values"].items():
            try:
                element = self._element(name)
                self.values[name] = value if value is element.initial else element.checked(value)
            except ValueError as error:
                lost.append(str(error))
        self.requests |= self.values
        self.operations[:] = [operation_of(each) for each in saved["operations"]]
        last = {operation.element: operation for operation in self.operations}
        by_task = {n for n, each in last.items() if each.by == TASK and each.value is True}
        self._task_holds = {n for n in by_task if n in self.elements and self.elements[n].hold}
        return lost


def operation_of(data: Mapping[str, Any]) -> Operation:
    """The operation of plain data; raises KeyError, TypeError, ValueError for other data."""
    value = data["value"]
    if not isinstance(value, bool | int | float | str):
        raise TypeError("an operation with a value that no element has")
    return Operation(int(data["tick"]), str(data["element"]), value, str(data["by"]))
