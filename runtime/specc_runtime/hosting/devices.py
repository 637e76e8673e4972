"""What the host asks of devices, and what they may give: the seam for everybody who writes some.

Only the standard library, Python 3.10: the host may run in another Python than the agent.
"""

from __future__ import annotations

import importlib
import traceback
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol


class Array(NamedTuple):
    """An array as bytes: `data` is C-contiguous, `dtype` a text for `numpy.dtype`, as `<f8`."""

    dtype: str
    shape: tuple[int, ...]
    data: Any


class DeviceError(Exception):
    """A device cannot be opened, read or driven; `element` is its name, where it is known."""

    def __init__(self, message: str, element: str = "") -> None:
        super().__init__(message)
        self.element = element


Measured = tuple[str, Any, float]
"""The name of an element, its value, and when it was measured by `time.monotonic()`."""


class Devices(Protocol):
    """All devices of a run. `open` and `close` are called once, each in a thread of its own.

    `poll` is called by one thread again and again. `send` is called by other threads, one for each
    device, while `poll` may be under way. Values are plain data: numbers, texts, bytes, `None`,
    lists, tuples and dictionaries of them, or an `Array`.

    `send_last(name, value)` may be there as well: it is called in the place of `send` for the last
    will, and must not wait for a `poll` or a `send` that hangs.
    """

    def open(self, config: dict[str, Any]) -> None:
        """Connect; raises `DeviceError` for what cannot be."""

    def poll(self, timeout_s: float) -> Sequence[Measured]:
        """What was measured since the last call; waits at most that long for the first value.

        The newest value of an element counts. A value that is an exception is the fault of its
        element; an exception that is raised is that of `element`, of all devices if it is empty.
        """

    def send(self, name: str, value: Any) -> None:
        """Give an element its new value."""

    def close(self) -> None:
        """Give up the connection; also called when `open` raised."""


def made(named: str) -> Devices:
    """The devices that `module:factory` makes, called without arguments; raises `DeviceError`."""
    module, _, name = named.partition(":")
    try:
        devices: Devices = getattr(importlib.import_module(module), name)()
    except DeviceError:
        raise
    except BaseException as error:
        raise DeviceError(f"cannot load {named}: {words(error)}") from error
    return devices


_LONGEST = 2000


def words(error: BaseException) -> str:
    """What an exception says; its kind and place as well, unless it is a `DeviceError`."""
    try:
        text = str(error)
    except BaseException as raised:  # noqa: BLE001  # it must not hide what it tells of
        text = f"(its message raises {type(raised).__name__})"
    if isinstance(error, DeviceError):
        return text[:_LONGEST]
    frames = traceback.extract_tb(error.__traceback__)
    at = f" ({frames[-1].name}, {frames[-1].filename}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {text[:_LONGEST]}".removesuffix(": ") + at
