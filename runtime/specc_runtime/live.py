"""Constants that may change while a system runs: their values now, and the changes of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from specc_runtime.changes import Event, EventQueue
from specc_runtime.system import LiveConstant


@dataclass(frozen=True, slots=True)
class Change(Event):
    """A value that a constant has from a base tick on, and who gave it."""

    constant: str
    value: float
    by: str


class LiveConstants:
    """The constants of a run that may change; all readers see a change at the same base tick."""

    def __init__(self, constants: Iterable[LiveConstant], inboxes: Mapping[str, Any]) -> None:
        """`inboxes` are the inputs of the next step of each subsystem."""
        self._constants = {constant.name: constant for constant in constants}
        self._inboxes = inboxes
        self.values = {name: constant.initial for name, constant in self._constants.items()}
        self._queue = EventQueue[Change]()
        self._due: dict[str, dict[str, float]] = {}
        """By subsystem and element, what its next step is to see."""

    def ask(self, name: str, value: float, by: str, tick: int = 0) -> None:
        """Have a constant change at that base tick, or at the next one if it is over.

        Raises ValueError for a constant that may not, and a value that is not within its range.
        """
        if name not in self._constants:
            known = ", ".join(self._constants) or "none"
            raise ValueError(f"{name} is no constant that may change; there are: {known}")
        self._queue.ask(Change(tick, name, self._constants[name].checked(value), by))

    def schedule(self, changes: Iterable[Change]) -> None:
        """Make changes of a recorded run again, at their ticks; others are left out."""
        for change in changes:
            with suppress(ValueError):  # of another specification
                self.ask(change.constant, change.value, change.by, change.tick)

    def whole(self, name: str, value: float) -> float:
        """A number as the constant has it: whole, if it is."""
        constant = self._constants.get(name)
        return round(value) if constant and type(constant.initial) is int else value

    def begin(self, tick: int) -> list[Change]:
        """Make the changes that are asked for by this base tick, and return them."""
        made = self._queue.begin(tick)
        for change in made:
            self._set(change.constant, change.value)
        return made

    @property
    def changes(self) -> list[Change]:
        """Those that were made."""
        return self._queue.history

    def deliver(self, subsystem: str) -> None:
        """Let a subsystem that is between two steps see the values of now."""
        for element, value in self._due.pop(subsystem, {}).items():
            setattr(self._inboxes[subsystem], element, value)

    def _set(self, name: str, value: float) -> None:
        self.values[name] = value
        for subsystem, element in self._constants[name].readers:
            self._due.setdefault(subsystem, {})[element] = value

    def saved(self) -> dict[str, Any]:
        """The values and the changes until now, as plain data."""
        return {"values": dict(self.values), "changes": [each.as_data() for each in self.changes]}

    def restore(self, saved: Mapping[str, Any]) -> list[str]:
        """Go on from there; gives what of it has no place. Raises KeyError, TypeError, ValueError
        for other data.
        """
        lost = []
        for name, value in saved["values"].items():
            try:
                self._set(name, self._constants[name].checked(value))
            except KeyError:
                lost.append(f"there is no constant {name} that may change")
            except ValueError as error:
                lost.append(f"{error}: it is as at the beginning")
        self.changes[:] = [change_of(each) for each in saved["changes"]]
        return lost


def change_of(data: Mapping[str, Any]) -> Change:
    """The change of plain data; raises KeyError, TypeError, ValueError for other data."""
    kind = float if type(data["value"]) is float else int
    by = str(data["by"])
    return Change(int(data["tick"]), str(data["constant"]), kind(data["value"]), by)
