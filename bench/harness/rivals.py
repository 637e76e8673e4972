"""Subsystems that do the same, stepped through the same inputs and timed in turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter, process_time
from types import FunctionType
from typing import Any

from bench.harness.timing import undisturbed

BLOCK_STEPS = 500
"""Steps that one rival makes before it is the turn of the next."""
FEWEST, MOST = 3, 101
"""Passes over all inputs."""

Loop = Callable[[Any, Sequence[Any]], None]
"""Hands a subsystem its inputs, one by one."""

Blocks = list[list[float]]
"""Seconds by rival and block of steps."""


@dataclass(frozen=True, slots=True)
class Rival:
    """`make` gives a subsystem that has not started; `inputs` are its buffers, one for a step."""

    name: str
    make: Callable[[], Any]
    inputs: Sequence[Any]


@dataclass(frozen=True, slots=True)
class Cost:
    """CPU time of a step, without what it takes to hand it its inputs, and against the first rival.

    `low` and `high` are quartiles of the ratio over the passes.
    """

    name: str
    step_ns: float
    ratio: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.ratio:.2f} ({self.low:.2f}-{self.high:.2f})"


def costs(rivals: Sequence[Rival], budget_s: float) -> list[Cost]:
    """What the steps of each rival cost; the passes over the inputs take about `budget_s`."""
    passes: list[Blocks] = []
    begin = perf_counter()
    while len(passes) < FEWEST or (len(passes) < MOST and perf_counter() - begin < budget_s):
        passes.append(_one_pass(rivals, backwards=len(passes) % 2 == 1))
    # The median of each block over the passes forgets what disturbed a few of them.
    blocks = [
        [median(times) for times in zip(*column, strict=True)]
        for column in zip(*passes, strict=True)
    ]
    net = [sum(column) - sum(blocks[-1]) for column in blocks[:-1]]
    totals = [[sum(block) for block in one] for one in passes]
    steps = max(1, len(rivals[0].inputs) - 1)
    found = []
    for index, rival in enumerate(rivals):
        each = sorted((t[index] - t[-1]) / max(t[0] - t[-1], 1e-9) for t in totals)
        low, high = each[len(each) // 4], each[(3 * len(each)) // 4]
        found.append(Cost(rival.name, 1e9 * net[index] / steps, net[index] / net[0], low, high))
    return found


def copied(kind: type, buffer: Any) -> Any:
    """A buffer of class `kind` with the values of another one that has the same elements."""
    copy = kind()
    for name in kind.__slots__:  # type: ignore[attr-defined]  # every class of buffers has them
        if hasattr(buffer, name):
            setattr(copy, name, getattr(buffer, name))
    return copy


def _one_pass(rivals: Sequence[Rival], *, backwards: bool) -> Blocks:
    """CPU seconds of all steps but the first; the last column is handing over the inputs alone."""
    machines = [rival.make() for rival in rivals]
    for rival, machine in zip(rivals, machines, strict=True):
        _step(machine, rival.inputs[:1])  # starting loads files
    work = [(_own(_step), *pair) for pair in zip(rivals, machines, strict=True)]
    work.append((_own(_feed), rivals[0], rivals[0].make()))
    taken: Blocks = [[] for _ in work]
    order = list(range(len(work)))
    if backwards:
        order.reverse()
    with undisturbed():
        for first in range(1, len(rivals[0].inputs), BLOCK_STEPS):
            for index in order:
                run, rival, machine = work[index]
                inputs = rival.inputs[first : first + BLOCK_STEPS]
                begin = process_time()
                run(machine, inputs)
                taken[index].append(process_time() - begin)
            order.reverse()
    return taken


def _step(machine: Any, inputs: Sequence[Any]) -> None:
    for machine.x in inputs:
        machine.step()


def _feed(machine: Any, inputs: Sequence[Any]) -> None:
    for machine.x in inputs:
        pass


def _own(loop: Loop) -> Loop:
    """The loop with code of its own: the interpreter adapts code to the class that it meets."""
    assert isinstance(loop, FunctionType)
    return FunctionType(loop.__code__.replace(), loop.__globals__)
