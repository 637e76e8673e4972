"""Operators of a subsystem in a process of its own, one of which may misbehave."""

from __future__ import annotations

import os
import signal
import stat
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from specc_runtime.processes import channel

MISDEED, FIRST = "SPECC_TEST_MISDEED", 20
"""What an operator does once it is given a number from there on."""


@dataclass(frozen=True)
class Blob:
    data: bytes

    def __reduce__(self) -> Any:
        raise TypeError("blobs cross by their codec")


def encode(blob: Blob) -> tuple[Any, ...]:
    return (np.frombuffer(blob.data, np.uint8),)


def decode(packed: tuple[Any, ...]) -> Blob:
    return Blob(packed[0].tobytes())


def act(n: int) -> int:
    if n >= FIRST:
        _MISDEEDS[os.environ.get(MISDEED, "")]()
    return n


def _raise() -> None:
    raise ValueError("no solution")


def _interrupt() -> None:
    raise KeyboardInterrupt


def _hang() -> None:
    while True:
        time.sleep(0.001)


def _persist() -> None:
    while True:
        with suppress(BaseException):
            time.sleep(0.001)


def _hold() -> None:
    print("holding", file=sys.stderr, flush=True)
    sum(range(10**12))  # nobody else gets the interpreter


def _recurse() -> None:
    _recurse()


def _crowd() -> None:
    channel.LARGEST_BYTES = 1000


BABBLE = (
    b"garbage",
    b"i",
    b"i\x80\x04K\x01.",
    b"igarbage",
    b"b",
    b"b" + (1 << 60).to_bytes(8, "little"),
    b"b" + (1 << 63).to_bytes(8, "little"),
    b"b" + (64).to_bytes(8, "little"),
)
"""What is no message, as a whole or after a head that is one's."""


def _babble(words: bytes) -> None:
    """Write to all sockets that the process has, and go on."""
    for name in os.listdir("/proc/self/fd"):
        with suppress(OSError):
            if stat.S_ISSOCK(os.fstat(int(name)).st_mode):
                os.write(int(name), words)


_MISDEEDS = {
    "": lambda: None,
    **{f"babble {number}": partial(_babble, words) for number, words in enumerate(BABBLE)},
    "raise": _raise,
    "exit": lambda: sys.exit("enough"),
    "interrupt": _interrupt,
    "leave": lambda: os._exit(3),
    "hang": _hang,
    "persist": _persist,
    "slow": lambda: time.sleep(0.15),
    "sleep": lambda: time.sleep(1000),
    "hold": _hold,
    "die": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "segfault": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "print": lambda: print("from an operator"),
    "ask": lambda: input(),
    "recurse": _recurse,
    "crowd": _crowd,
}


def blob(n: int) -> Blob:
    return Blob(bytes([n % 251]) * (7000 if n % 2 else 7))


def wide(n: int) -> Any:
    return np.arange(1000.0) * n


def size(blob: Blob, v: Any) -> int:
    return (len(blob.data) + int(v[7]) + blob.data[0]) % 17


def listed(n: int, kept: Blob) -> Any:
    return kept, blob(n), kept
