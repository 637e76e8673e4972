"""What a device gets: the newest outputs of the agent, and at the end the last will."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from specc_runtime.hosting.devices import Devices, words

GRACE_S = 0.005
"""How long the last will waits for an output that is being sent."""

Will = Mapping[str, Sequence[tuple[str, Any]]]
"""By element: values with their names; the first that the device takes counts."""
Outcome = Mapping[str, tuple[str, str]]
"""By element: the name of the value that the device took, empty if none, and what went wrong."""


class Courier:
    """Sends the outputs of one device in a thread of its own, so that it may hang for itself.

    While an output is being sent, newer ones wait, of which the newest of each element counts.
    """

    def __init__(
        self, name: str, devices: Devices, confirm: Callable[[str, int, str], None]
    ) -> None:
        """`confirm` is called with an element, the number of its output, and why it was not taken,
        which is empty if it was.
        """
        self.name = name
        self.will: Will = {}
        self.given: threading.Event = threading.Event()
        self.outcome: Outcome = {}
        self.is_closed = False
        """Whether outputs of the agent are refused."""
        self._send = devices.send
        self._send_last = getattr(devices, "send_last", devices.send)
        self._confirm = confirm
        self._waiting: dict[str, tuple[Any, int]] = {}
        self._changed = threading.Condition()
        self._is_busy = False
        self._is_overtaken = False
        threading.Thread(target=self._run, name=f"specc-{name}", daemon=True).start()

    def post(self, element: str, value: Any, number: int) -> None:
        """Send this when the device is free."""
        with self._changed:
            if not self.is_closed:
                self._waiting[element] = value, number
                self._changed.notify_all()

    def reopen(self) -> None:
        """Take outputs again."""
        with self._changed:
            self.is_closed = self._is_overtaken = False

    def is_idle(self) -> bool:
        """Whether nothing is being sent or waits for it."""
        return not (self._is_busy or self._waiting)

    def wait(self, timeout_s: float) -> bool:
        """Wait until everything is sent; whether it is."""
        with self._changed:
            return self._changed.wait_for(self.is_idle, timeout_s)

    def give_will(self, report: Callable[[Courier], None]) -> None:
        """Give the device its last will, and nothing else until `reopen`; does not wait.

        `report` is called afterwards, from another thread.
        """
        with self._changed:
            self.is_closed = True
            self._waiting.clear()
            self.given.clear()
        threading.Thread(target=self._bequeath, args=(report,), daemon=True).start()

    def _bequeath(self, report: Callable[[Courier], None]) -> None:
        with self._changed:
            self._is_overtaken = not self._changed.wait_for(lambda: not self._is_busy, GRACE_S)
        self.outcome = self._executed()
        self.given.set()
        report(self)

    def _executed(self) -> Outcome:
        return {element: self._send_first(element, values) for element, values in self.will.items()}

    def _send_first(self, element: str, values: Sequence[tuple[str, Any]]) -> tuple[str, str]:
        problems = []
        for by, value in values:
            try:
                self._send_last(element, value)
            except BaseException as error:  # noqa: BLE001  # the next value may do
                problems.append(f"{by}: {words(error)}")
            else:
                return by, "; ".join(problems)
        return "", "; ".join(problems)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._waiting))
                element = next(iter(self._waiting))
                value, number = self._waiting.pop(element)
                self._is_busy = True
            try:
                self._send(element, value)
            except BaseException as error:  # noqa: BLE001  # whatever the device raises
                self._confirm(element, number, words(error))
            else:
                self._confirm(element, number, "")
            if self._is_overtaken:  # what has just been sent came after the last will
                self._executed()
            with self._changed:
                self._is_busy = self._is_overtaken = False
                self._changed.notify_all()
