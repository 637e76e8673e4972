"""What goes on in the process that computes the steps of one subsystem.

Its main thread makes the steps. Another one tells what that is doing when the run asks, and ends
the process when the run is gone.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import socket
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

from specc_runtime.blocks import Block
from specc_runtime.buffers import freeze
from specc_runtime.environment import decoders
from specc_runtime.faults import Fault, StepFailed
from specc_runtime.forms import Layout
from specc_runtime.hosting.memory import Extent
from specc_runtime.hosting.views import Views
from specc_runtime.interruption import Abandoned
from specc_runtime.loading import load_layouts, load_system
from specc_runtime.options import UsageError
from specc_runtime.processes.channel import Gone, ProcessChannel, TooLarge
from specc_runtime.processes.crossing import Changes, Receiver, Sender
from specc_runtime.processes.fault_data import FaultData, fault_data
from specc_runtime.scheduling import PROCESSES, take, take_for_others
from specc_runtime.stepping import Stepper
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System
from specc_runtime.track import Outcome, outcome_of
from specc_runtime.watchdog import left, steps_under_way

LEFT, UNDER_WAY = "left", "under way"
"""What may be asked while a step is computed."""
_PR_SET_PDEATHSIG = 1


@dataclass(frozen=True, slots=True)
class Assignment:
    """The subsystem to compute: how the generated package is loaded, and its name."""

    directory: str
    base: str
    name: str
    check_operators: bool = False
    is_prompt: bool = False
    """Whether its steps go before ordinary processes where that is permitted."""


@dataclass(frozen=True, slots=True)
class ResumePoint:
    """Where a subsystem is that goes on from a snapshot."""

    state: str
    periods: int | None
    memory: Changes


@dataclass(frozen=True, slots=True)
class Order:
    """A step: what has changed of the inputs, and the own periods that were skipped before it.

    `views` says where samples are that are in the memory of the device host, whose descriptor
    comes with the first of them. `remembered` has the memory elements that are to be told from now
    on, if that has changed.
    """

    x: Changes
    views: Mapping[str, Extent]
    skipped: int = 0
    remembered: tuple[str, ...] | None = None
    place: ResumePoint | None = None


@dataclass(frozen=True, slots=True)
class Left:
    """All that a step leaves behind: changes of outputs and memory, `busy_s` of wall time.

    `extents_in_use` says where samples are that are still in use.
    """

    outcome: int | FaultData
    state: str
    violations: tuple[int, ...]
    periods: int | None
    y: Changes
    memory: Changes
    busy_s: float
    extents_in_use: tuple[Extent, ...] = ()


def main(arguments: Sequence[str]) -> None:
    """Compute what the run orders until it is gone.

    `arguments` are the run's process and descriptors: of two sockets and of the blocks of both.
    """
    parent, orders, questions, written, read = map(int, arguments)
    end_with(parent)
    channel = ProcessChannel(socket.socket(fileno=orders), Block(written), Block(read))
    with suppress(Gone):
        assignment = channel.receive()
        try:
            system, layout = _loaded(assignment)
        except UsageError as error:
            return channel.send(str(error))
        except Fault as fault:
            return channel.send(fault_data(fault))
        if assignment.is_prompt:
            _take_priority()
        subsystem = system.scheduled(assignment.name).subsystem
        question_socket = socket.socket(fileno=questions)
        threading.Thread(target=_answer, args=(question_socket, subsystem), daemon=True).start()
        channel.send(None)
        _Worker(system, subsystem, layout, channel).serve()


def end_with(parent: int) -> None:
    """Have the kernel end this process with its parent, whatever holds the interpreter then."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _take_priority() -> None:
    """For all threads that there are and to come."""
    with suppress(AttributeError, OSError):
        take_for_others(PROCESSES)
        take(PROCESSES, inherited=True)


def _loaded(assignment: Assignment) -> tuple[System, Layout]:
    """Raises UsageError, StepFailed."""
    examined = assignment.check_operators
    system = load_system(assignment.directory, assignment.base, check_operators=examined)
    return system, load_layouts(system)[assignment.name]


def _answer(question_socket: socket.socket, subsystem: Subsystem) -> None:
    """Tell what the main thread is doing; end the process with the run."""
    with suppress(OSError):
        while data := question_socket.recv(1024):
            number, question = pickle.loads(data)
            answer: Any = steps_under_way()
            if question == LEFT:
                answer = fault_data(left(subsystem, Abandoned("")))
            question_socket.send(pickle.dumps((number, answer)))
    os._exit(1)


class _Worker:
    """Makes the steps of a subsystem as they are ordered."""

    def __init__(
        self, system: System, subsystem: Subsystem, layout: Layout, channel: ProcessChannel
    ) -> None:
        self._system = system
        self._subsystem = subsystem
        self._layout = layout
        self._channel = channel
        self._views: Views | None = None
        self._stepper = Stepper(subsystem)
        self._x, self._given = Receiver(layout.x), Receiver(layout.memory)
        self._y, self._memory = Sender(layout.y), Sender(layout.memory)
        self._remembered: tuple[str, ...] = ()

    def serve(self) -> None:
        """Raises Gone, at the latest when the run is over."""
        while True:
            order: Order = self._channel.receive()
            left_behind = self._left(order)
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError, AttributeError):
                    stream.flush()
            self._send(left_behind)

    def _send(self, left_behind: Left) -> None:
        """Tell what a step left behind; a fault in its place if that is too large."""
        try:
            self._channel.send(left_behind)
        except TooLarge as error:
            subsystem = self._subsystem
            fault = StepFailed(subsystem.name, subsystem.state, error)
            fault.message = (
                f"what the step leaves behind is too large for a process of its own ({error}): "
                "let it send less at once, or give it no `budget`"
            )
            self._channel.send(replace(left_behind, outcome=fault_data(fault), y={}, memory={}))

    def _left(self, order: Order) -> Left:
        subsystem, given = self._subsystem, order
        if order.remembered is not None:
            self._remembered = order.remembered
        begin_s = perf_counter()
        outcome = outcome_of(subsystem, (), lambda: self._step(given))
        busy_s = perf_counter() - begin_s
        y: Changes = {}
        memory: Changes = {}
        if not isinstance(outcome, Fault):
            outcome = outcome_of(subsystem, (), lambda: self._tell(outcome, y, memory))
        return Left(
            fault_data(outcome) if isinstance(outcome, Fault) else outcome,
            subsystem.state,
            subsystem.violations,
            vars(subsystem).get("_periods"),
            y,
            memory,
            busy_s,
            () if self._views is None else self._views.extents_in_use(),
        )

    def _step(self, order: Order) -> int:
        subsystem = self._subsystem
        self._x.take(subsystem.x, order.x)
        self._look(order.views)
        if order.place is not None:
            self._go_on(order.place)
        if order.skipped:
            subsystem.skip(order.skipped)
        return subsystem.step()

    def _look(self, extents: Mapping[str, Extent]) -> None:
        """Take the samples there as inputs; raises DeviceFailed for those that are none."""
        for element, extent in extents.items():
            if self._views is None:
                descriptor = self._channel.descriptors.pop()
                spec = self._system.plant
                assert spec is not None, "there is a device host"
                self._views = Views(spec, self._subsystem.name, decoders(spec), descriptor)
            setattr(self._subsystem.x, element, self._views.value(element, extent))

    def _tell(self, outcome: Outcome, y: Changes, memory: Changes) -> Outcome:
        """What others may see of a step; what codecs raise is raised."""
        subsystem = self._subsystem
        elements = subsystem.sends[subsystem.state]
        for element in elements:
            freeze(getattr(subsystem.y, element))
        y |= self._y.changes(subsystem.y, elements)
        memory |= self._memory.changes(subsystem.memory, self._remembered)
        return outcome

    def _go_on(self, place: ResumePoint) -> None:
        subsystem = self._subsystem
        self._given.take(subsystem.memory, place.memory)
        self._stepper.place(place.state, self._layout.ends[place.state][2])
        if place.periods is not None:
            vars(subsystem)["_periods"] = place.periods
        self._stepper.settle()
