"""The processes that compute steps for a run: how they begin, what they are asked, how they end.

A process begins as a new interpreter, not as a copy of this one (fork): a copy would have the locks
of threads that it has not (recording, watchdog, workers) and the simulator's graphics. It is not
begun by `multiprocessing` either, which executes the main module of a user's program again, and
keeps shared memory under names that outlive who is killed.
"""

from __future__ import annotations

import json
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import chain
from threading import Lock

from specc_runtime.blocks import Block
from specc_runtime.forms import Element, Layout
from specc_runtime.loading import load_layouts
from specc_runtime.options import Options, UsageError
from specc_runtime.processes.channel import Garbled, Gone, ProcessChannel
from specc_runtime.processes.child import LEFT, UNDER_WAY, Assignment
from specc_runtime.processes.crossing import uncodable
from specc_runtime.processes.fault_data import FaultData, fault_of
from specc_runtime.scheduling import class_of
from specc_runtime.system import System
from specc_runtime.workers import Workers

BLOCK_BYTES = 4 << 20
"""Memory of each direction to begin with; it grows to twice of what does not fit."""
ANSWER_S = 0.15
"""How long an answer about a step under way is waited for."""
_BEGIN = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop(1)); "
    "from specc_runtime.processes.child import main; main(sys.argv[1:])"
)


class Worker:
    """One process, for one subsystem.

    `remembered` are the memory elements that the run reads, `observed` the inputs.
    """

    def __init__(
        self,
        assignment: Assignment,
        layout: Layout,
        remembered: tuple[str, ...],
        observed: Collection[str],
    ) -> None:
        """Begin it; it loads what it needs meanwhile."""
        self.name = assignment.name
        self.layout = layout
        self.remembered = remembered
        self.observed = observed
        blocks = Block.of_bytes(BLOCK_BYTES), Block.of_bytes(BLOCK_BYTES)
        (orders, theirs), (self._questions, others) = (
            socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(2)
        )
        given = theirs.fileno(), others.fileno(), *(b.descriptor for b in reversed(blocks))
        self.channel = ProcessChannel(orders, *blocks)
        self._asking = Lock()  # the watchdog is a thread of its own
        self._question_count = 0
        with theirs, others:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _BEGIN, json.dumps(sys.path), str(os.getpid()),
                 *map(str, given)],
                stdin=subprocess.DEVNULL, pass_fds=given, start_new_session=True,
            )  # fmt: skip
        with suppress(Gone):
            self.channel.send(assignment)

    @cached_property
    def feeder(self) -> Workers:
        """A thread that computes the samples of its steps."""
        return Workers(1, "specc-samples")

    @property
    def scheduling(self) -> str:
        """Its scheduling class, in words."""
        return class_of(self._process.pid)

    def wait(self) -> None:
        """Wait until it can make steps. Raises UsageError, StepFailed if it cannot."""
        try:
            answer = self.channel.receive()
        except Gone:
            answer = self.why_ended()
        except Garbled as garbled:
            answer = self.ended_for(garbled)
        if isinstance(answer, FaultData):
            raise fault_of(answer, {})
        if answer is not None:
            raise UsageError(f"the process of {self.name}: {answer}")

    def under_way(self) -> list[str]:
        """What it computes, in words; nothing if it does not answer."""
        answer = self._answer(UNDER_WAY)
        return answer if isinstance(answer, list) else []

    def where(self) -> FaultData | None:
        """The step that it computes, as a fault; None if it does not answer."""
        answer = self._answer(LEFT)
        return answer if isinstance(answer, FaultData) else None

    def _answer(self, question: str) -> object:
        """None while something outside of Python holds its interpreter, or if it has ended."""
        with self._asking, suppress(OSError):
            self._question_count += 1
            self._questions.send(pickle.dumps((self._question_count, question)))
            while select.select([self._questions], (), (), ANSWER_S)[0]:
                if not (data := self._questions.recv(65_536)):
                    return None
                with suppress(Exception):  # something else has written to the socket
                    number, answer = pickle.loads(data)
                    if number == self._question_count:  # else it came too late
                        return answer
        return None

    def why_ended(self) -> str:
        """How it ended, in words."""
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "its process does not answer any more"
        if code >= 0:
            return f"its process ended with exit code {code}"
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        why = ", as the system does when memory is short" if -code == signal.SIGKILL else ""
        return f"its process was ended by {name}{why}"

    def ended_for(self, garbled: Garbled) -> str:
        """End it, since what it sends cannot be understood; how that came, in words."""
        self.kill()
        return (
            f"its process was ended: it sent what is no message ({garbled}); "
            "an operator has written to a socket that is not its own"
        )

    def kill(self) -> None:
        """End it, and what it has begun, in whatever it does. Nothing of it is waited for."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)

    def close(self) -> None:
        """Wait for its end and give up what it had."""
        self._process.wait()
        self._questions.close()
        self.channel.close()
        if "feeder" in vars(self):
            self.feeder.close()


class Processes:
    """The processes of a run, one for each subsystem that computes in one; none to begin with."""

    def __init__(self) -> None:
        self._workers: dict[str, Worker] = {}

    def begin(self, system: System, options: Options, *, is_shown: bool = False) -> None:
        """Begin those that the options ask for; `wait` says when they can be used.

        A run that is shown has what a `glimpse` of its subsystems has.

        Raises UsageError for subsystems whose values cannot cross.
        """
        if not options.apart:
            return
        layouts = load_layouts(system)
        assigned = {}
        for name in options.apart:
            layout = layouts[name]
            looked_at = Layout((), (), (), {})
            if options.record is not None:
                looked_at = layout
            elif is_shown:
                looked_at = glimpse(layout)
            remembered = _remembered(system, name, layout.memory, looked_at.memory)
            _check(name, layout, remembered)
            order = Assignment(*_places(options), name, options.check_operators, options.real_time)
            reported = _read(system, name, "reported")
            seen = reported | {e.attribute for e in looked_at.x}
            assigned[name] = order, layout, remembered, seen
        for name, given in assigned.items():
            self._workers[name] = Worker(*given)

    def get(self, name: str) -> Worker | None:
        """The process of a subsystem, if it has one."""
        return self._workers.get(name)

    def wait(self) -> None:
        """Wait until all can make steps. Raises UsageError, and Fault, if one cannot."""
        for worker in self._workers.values():
            worker.wait()

    @property
    def scheduling(self) -> dict[str, str]:
        """The scheduling class of each, in words."""
        return {name: worker.scheduling for name, worker in self._workers.items()}

    def under_way(self) -> list[str]:
        """What they compute, in words."""
        return [text for worker in self._workers.values() for text in worker.under_way()]

    def close(self) -> None:
        """End them all, in whatever they do."""
        workers = list(self._workers.values())
        self._workers.clear()
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.close()


def glimpse(layout: Layout) -> Layout:
    """What a page sees of a subsystem in a process of its own: no images, no opaque memory."""
    x = [element for element in layout.x if not element.form.has_image]
    memory = [e for e in layout.memory if not (e.form.has_image or e.form.is_opaque)]
    return replace(layout, x=x, memory=memory)


def _places(options: Options) -> tuple[str, str]:
    """The folders of the package and of the specification, for a process that starts elsewhere."""
    base = str(options.base)
    return os.path.abspath(options.directory), os.path.abspath(base) if base else ""


def _remembered(
    system: System, name: str, memory: Iterable[Element], looked_at: Sequence[Element]
) -> tuple[str, ...]:
    """Attributes of the memory that somebody looks at, or needs; what cannot cross is left out."""
    task = system.task
    read_elsewhere = set(task.watch) if task is not None and task.subsystem == name else set()
    read_elsewhere |= _read(system, name, "memory")
    return tuple(
        element.attribute
        for element in memory
        if element.attribute in read_elsewhere
        or (element in looked_at and not any(uncodable([element])))
    )


def _read(system: System, name: str, kind: str) -> set[str]:
    """Elements of a subsystem that requirements and triggers read."""
    followers = [f for f in (system.requirements, system.triggers) if f is not None]
    readings = chain.from_iterable(each.readings for each in followers)
    return {r.element for r in readings if (r.kind, r.subsystem) == (kind, name)}


def _check(name: str, layout: Layout, remembered: Collection[str]) -> None:
    crossing = [*layout.x, *layout.y, *(e for e in layout.memory if e.attribute in remembered)]
    if missing := dict.fromkeys(uncodable(crossing)):
        which = ", ".join(f"{element} ({kind})" for element, kind in missing)
        raise UsageError(
            f"{name} cannot compute in a process of its own: {which} would have to cross, of "
            "a type without a codec; give the type a `codec`, or the subsystem no `budget`"
        )
