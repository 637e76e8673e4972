"""What devices report, as it comes, into shared memory."""

from __future__ import annotations

import math
import reprlib
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from specc_runtime.hosting.devices import DeviceError, Devices, words
from specc_runtime.hosting.memory import Memory
from specc_runtime.hosting.wire import parts_of

POLL_S = 0.1
PAUSE_S = 5e-5
"""The least pause after a `poll`, so that devices that never wait do not keep the interpreter."""
_SHARE = 0.5
"""The pause of devices that keep the processor busy, as a part of the time that they do."""


class Reader:
    """Polls the devices in a thread of its own. What they fail to do is told once an element."""

    def __init__(
        self,
        devices: Devices,
        elements: Sequence[str],
        memory: Memory,
        failed: Callable[[str, str], None],
    ) -> None:
        """`failed` is called with an element, or an empty text for all, and why it has no value."""
        self._devices = devices
        self._numbers = {name: index for index, name in enumerate(elements)}
        self._memory = memory
        self._failed = failed
        self._is_over = False
        self._thread = threading.Thread(target=self._run, name="specc-reader", daemon=True)
        self._thread.start()

    def close(self, timeout_s: float) -> None:
        """Poll no more; waits for the last one, but not for long."""
        self._is_over = True
        self._thread.join(timeout_s)

    def _run(self) -> None:
        while not self._is_over:
            begin_s = time.thread_time()
            try:
                self._write(self._devices.poll(POLL_S))
            except BaseException as error:  # noqa: BLE001  # whatever the devices raise
                self._failed(str(getattr(error, "element", "")), words(error))
                return
            time.sleep(max(PAUSE_S, _SHARE * (time.thread_time() - begin_s)))

    def _write(self, samples: Any) -> None:
        newest = {}
        for sample in samples:
            name, value, measured_s = sample
            if name not in self._numbers:
                raise DeviceError(f"a value came for {name!r}, which is no element that is read")
            newest[name] = value, measured_s
        for name, (value, measured_s) in newest.items():
            try:
                self._put(name, value, measured_s)
            except Exception as error:  # noqa: BLE001  # other elements have their values
                self._failed(name, words(error))

    def _put(self, name: str, value: Any, measured_s: float) -> None:
        if isinstance(value, BaseException):
            raise value
        if not _is_time(measured_s):
            text = reprlib.repr(measured_s)
            raise DeviceError(f"the sample was measured at {text}, which is no time in s")
        kind, parts = parts_of(value)
        self._memory.write(self._numbers[name], measured_s, kind, *parts)


def _is_time(told_s: Any) -> bool:
    try:
        return math.isfinite(told_s)
    except (TypeError, OverflowError):
        return False
