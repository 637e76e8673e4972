"""A device that blocks: a thread waits for its values, a plant takes the newest one."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from specc_runtime.plant import NO_SAMPLE
from specc_runtime.plants.errors import PlantError


class Latest:
    """The newest value of `read`, a function that blocks until a device has one.

    A thread calls it again and again; values that nobody took in time are lost. The thread is a
    daemon: a `read` that never returns does not keep the process alive.
    """

    def __init__(self, read: Callable[[], Any]) -> None:
        """Starts the thread."""
        self._read = read
        self._value: Any = NO_SAMPLE
        self._error: BaseException | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="specc-device", daemon=True)
        self._thread.start()

    def wait(self, timeout_s: float) -> None:
        """Wait until there is a value to take; raises PlantError if none comes in time."""
        with self._changed:
            self._changed.wait_for(self._is_there, timeout_s)
            if not self._is_there():
                raise PlantError(f"no value came within {timeout_s:g} s")

    def take(self) -> Any:
        """The newest value, once; `NO_SAMPLE` if none has come since. Raises what `read` raised."""
        with self._changed:
            if self._error is not None:
                raise self._error
            value, self._value = self._value, NO_SAMPLE
            return value

    def close(self, timeout_s: float = 1.0) -> None:
        """Ask the thread to end and wait for it, but not for long."""
        self._closed = True
        self._thread.join(timeout_s)

    def _is_there(self) -> bool:
        return self._value is not NO_SAMPLE or self._error is not None

    def _run(self) -> None:
        while not self._closed:
            try:
                value, error = self._read(), None
            except BaseException as raised:  # noqa: BLE001  # it is raised again by `take`
                value, error = NO_SAMPLE, raised
            with self._changed:
                self._value, self._error = value, error
                self._changed.notify_all()
            if error is not None:
                return
