"""Starts a device host and waits until its devices are open."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import time
import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from specc_runtime.blocks import Block, anonymous_file
from specc_runtime.faults import error_text
from specc_runtime.hosting.memory import Memory
from specc_runtime.hosting.wire import HostChannel, NotPlain, garbled
from specc_runtime.options import UsageError
from specc_runtime.plants.errors import PlantError

HOST = Path(__file__).with_name("host.py")
_TAIL = 2000
_ENDED_S = 5.0
"""How long a host has for its end once it has closed its devices."""
_SEEN_S = 0.2
"""How long is waited for how a host ended that closed its connection."""


class Host:
    """A host that was started: `channel` has its messages, `memory` the samples of its elements."""

    def __init__(self, python: str, elements: int) -> None:
        """Raises UsageError if there is no such program as `python`, by default the own one."""
        ours, theirs = socket.socketpair()
        self.memory = Memory(Block.of_bytes(Memory.size(elements)), elements)
        self._errors = anonymous_file()
        people = os.dup(2) if _is_open(2) else os.open(os.devnull, os.O_WRONLY)
        passed = (theirs.fileno(), self.memory.block.descriptor, people)
        try:
            self._process = subprocess.Popen(
                [python or sys.executable, str(HOST), *map(str, passed)],
                stdin=subprocess.DEVNULL,
                stderr=self._errors,
                pass_fds=passed,
                # A stop or a signal of the terminal is for the agent alone, which may not answer.
                start_new_session=True,
            )
        except (OSError, ValueError) as error:  # a text with a zero in it is no path
            ours.close()
            self.memory.close()
            os.close(self._errors)
            raise UsageError(
                f"cannot start {python or sys.executable}: {error_text(error)}"
            ) from None
        finally:
            theirs.close()
            os.close(people)
        self.channel = HostChannel(ours)
        # A copy of this end in another process would hide from the host that this one is gone.
        forget = weakref.WeakMethod(self.channel.close)
        os.register_at_fork(after_in_child=lambda: (close := forget()) and close())

    def open(self, wanted: Mapping[str, Any], until_s: float) -> bool:
        """Have the devices opened; raises PlantError if they are not by then.

        Returns whether the host may run before ordinary processes.
        """
        self.channel.send("open", {"agent": os.getpid(), **wanted})
        while True:
            if not self.wait(until_s):
                raise PlantError(f"the devices are not open in time{self.tail()}")
            try:
                for kind, *data in self.channel.received():
                    if kind == "opened":
                        return bool(data[0])
                    if kind == "refused":
                        raise PlantError(f"cannot open the devices: {data[0]}{self.tail()}")
            except (NotPlain, LookupError) as error:
                raise PlantError(garbled(error)) from error
            if self.channel.is_over:
                raise PlantError(f"the device host ended before it began: {self.ending()}")

    def wait(self, until_s: float) -> bool:
        """Wait for messages, or until a time of `time.monotonic()`; whether some came."""
        self.channel.flush()
        left_s = max(0.0, until_s - time.monotonic())
        return bool(select.select([self.channel], [], [], left_s)[0])

    def ending(self) -> str:
        """How the process ended, and what it said last."""
        try:
            code = self._process.wait(_SEEN_S)
        except subprocess.TimeoutExpired:
            return "it closed its connection"
        how = f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"
        return how + self.tail()

    def tail(self) -> str:
        """The end of what the host wrote on standard error before the devices were open."""
        size = os.fstat(self._errors).st_size
        text = os.pread(self._errors, _TAIL, max(0, size - _TAIL))
        output = text.decode(errors="replace").strip()
        return f"; it said: {output}" if output else ""

    def close(self) -> None:
        """End the process, if need be by force."""
        self.channel.close()
        try:
            self._process.wait(_ENDED_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._errors)
        self.memory.close()


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True
