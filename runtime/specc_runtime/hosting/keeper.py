"""The life of the host: open the devices, serve the agent, give the last will, close, end.

The thread that does this waits for nothing but the agent: whatever calls a device has a thread of
its own, and a bound on how long it is waited for.
"""

from __future__ import annotations

import math
import os
import selectors
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from specc_runtime.blocks import Block
from specc_runtime.hosting.agency import LOOK_S, Agent
from specc_runtime.hosting.courier import Courier
from specc_runtime.hosting.devices import Devices, made, words
from specc_runtime.hosting.memory import Memory
from specc_runtime.hosting.reader import Reader
from specc_runtime.hosting.wire import HostChannel
from specc_runtime.scheduling import HOST, take

WILL_S = 2.0
"""How long devices have to take the last will once nobody else will speak to them."""
CLOSE_S = 3.0
"""How long they have to close."""
LEAVE_S = 15.0
"""How long the agent has to end once it says that it does, or once the host is asked to end."""
_END_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
_IGNORED = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU, signal.SIGPIPE)


class Keeper:
    """One host, from the first message of its agent on."""

    def __init__(self, channel: HostChannel, memory_file: int, errors_file: int) -> None:
        self._channel = channel
        self._memory_file = memory_file
        self._errors_file = errors_file
        self._agent = Agent(os.getppid())
        self._is_prompt = _prompt()
        self._devices: Devices | None = None
        self._reader: Reader | None = None
        self._couriers: dict[str, Courier] = {}
        self._silence_s: dict[str, float] = {}
        self._since_s: dict[str, float] = {}
        """Devices that the agent has commanded, and since when."""
        self._until_s = math.inf
        self._opening: threading.Thread | None = None
        self._is_agent_gone = False
        self._is_ended = False
        self._failed: set[str] = set()

    def run(self) -> None:
        """To the end, whoever asks for it."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._channel, selectors.EVENT_READ)
            signals = _signals()
            selector.register(signals, selectors.EVENT_READ, lambda: self._forward_signals(signals))
            while not self._over():
                for key, _ in selector.select(self._patience_s()):
                    if key.data is not None:
                        key.data()
                self._listen()
                self._channel.flush()
                self._watch()
        self._leave()

    def _over(self) -> bool:
        return self._is_agent_gone or self._is_ended or time.monotonic() > self._until_s

    def _patience_s(self) -> float:
        """How long nothing has to be done, if nothing happens."""
        now_s, until_s = time.monotonic(), self._until_s
        for name in self._watched():
            until_s = min(until_s, self._heard_s(name) + self._silence_s[name])
        return min(max(until_s - now_s, 0.0) + 2e-4, LOOK_S if self._agent.is_watched else 1.0)

    # What the agent says.

    def _listen(self) -> None:
        for kind, *data in self._channel.received():
            if kind == "open":
                self._open(data[0])
            elif kind == "send":
                self._post(*data)
            elif kind == "will":
                self._courier(data[0]).will = data[1]
            elif kind == "leave":
                self._allow_to_leave()
            elif kind == "end":
                self._is_ended = True
        self._is_agent_gone |= self._channel.is_over or self._agent.has_ended()

    def _open(self, wanted: dict[str, Any]) -> None:
        self._agent = Agent(wanted["agent"])
        self._silence_s = dict(wanted["silence"])
        self._opening = threading.Thread(target=self._opened, args=(wanted,), daemon=True)
        self._opening.start()

    def _opened(self, wanted: dict[str, Any]) -> None:
        try:
            sys.path[:0] = wanted["path"]
            self._devices = devices = made(wanted["devices"])
            devices.open(wanted["config"])
            memory = Memory(Block(self._memory_file), len(wanted["elements"]))
        except BaseException as error:  # noqa: BLE001  # whatever the devices raise
            self._channel.send("refused", words(error))
            return
        with suppress(OSError):
            os.dup2(self._errors_file, 2)  # from now on for people
        self._memory = memory
        self._channel.send("opened", self._is_prompt)
        self._reader = Reader(devices, wanted["elements"], memory, self._fail)

    def _post(self, device: str, element: str, value: Any, number: int) -> None:
        self._since_s.setdefault(device, time.monotonic())
        self._courier(device).post(element, value, number)

    def _courier(self, device: str) -> Courier:
        if device not in self._couriers:
            assert self._devices is not None
            self._couriers[device] = Courier(device, self._devices, self._sent)
        return self._couriers[device]

    def _sent(self, element: str, number: int, why: str) -> None:
        """An output was taken or not: the agent waits for word of those with a number."""
        if number:
            self._channel.send("taken", number, why)
        elif why:
            self._fail(element, why)

    def _allow_to_leave(self) -> None:
        """The agent gives safe outputs itself; nobody counts its silence any more."""
        self._silence_s = dict.fromkeys(self._silence_s, math.inf)
        self._until_s = min(self._until_s, time.monotonic() + LEAVE_S)
        for courier in self._couriers.values():
            courier.reopen()

    # What makes the host give the last will.

    def _watched(self) -> Iterable[str]:
        return [
            name
            for name in self._since_s
            if self._couriers[name].will and not self._couriers[name].is_closed
        ]

    def _heard_s(self, device: str) -> float:
        return max(self._memory.beat_s, self._since_s[device])

    def _watch(self) -> None:
        for name in self._watched():
            silent_s = time.monotonic() - self._heard_s(name)
            if silent_s >= self._silence_s[name]:
                self._couriers[name].give_will(self._will_report(silent_s))

    def _will_report(self, silent_s: float) -> Any:
        def tell(courier: Courier) -> None:
            self._channel.send("willed", courier.name, silent_s, dict(courier.outcome))

        return tell

    def _forward_signals(self, signals: socket.socket) -> None:
        """A signal: the agent is told, and has time to end, since it may have got it as well."""
        for number in signals.recv(64):
            self._channel.send("asked", number)
        self._until_s = min(self._until_s, time.monotonic() + LEAVE_S)

    def _fail(self, element: str, why: str) -> None:
        """Tell the agent, once an element, that a device failed."""
        if element not in self._failed:
            self._failed.add(element)
            self._channel.send("failed", element, why)

    # The end.

    def _leave(self) -> None:
        until_s = time.monotonic() + WILL_S
        couriers = list(self._couriers.values())
        if not self._is_ended:
            for courier in couriers:
                if courier.will and not courier.is_closed:
                    courier.give_will(lambda _: None)
            for courier in couriers:
                if courier.will:
                    courier.given.wait(max(0.0, until_s - time.monotonic()))
        for courier in couriers:
            courier.wait(max(0.0, until_s - time.monotonic()))
        self._close()

    def _close(self) -> None:
        problems: list[str] = []
        closing = threading.Thread(target=self._closed, args=(problems,), daemon=True)
        closing.start()
        closing.join(CLOSE_S)
        if closing.is_alive():
            problems.append(f"still closing after {CLOSE_S:g} s")
        self._channel.send("closed", problems[0] if problems else "")
        until_s = time.monotonic() + CLOSE_S
        while not self._channel.flush() and time.monotonic() < until_s:
            time.sleep(0.001)

    def _closed(self, problems: list[str]) -> None:
        if self._opening is not None:
            self._opening.join(CLOSE_S)
        if self._reader is not None:
            self._reader.close(CLOSE_S / 2)
        try:
            if self._devices is not None:
                self._devices.close()
        except BaseException as error:  # noqa: BLE001  # as above
            problems.append(words(error))


def _prompt() -> bool:
    """Run before ordinary processes, all threads to come included; whether that is permitted."""
    try:
        take(HOST, inherited=True)
    except (AttributeError, OSError):
        return False
    return True


def _signals() -> socket.socket:
    """A socket that gets the number of every signal that asks the host to end."""
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    theirs.setblocking(False)
    signal.set_wakeup_fd(theirs.detach())
    for number in _END_SIGNALS:
        signal.signal(number, lambda *_: None)
    for number in _IGNORED:
        signal.signal(number, signal.SIG_IGN)
    return ours
