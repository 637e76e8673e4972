"""Where two runs of one specification differ, in words."""

from __future__ import annotations

from collections.abc import Iterator

from tests.soundness.interpreter import Failure, Run, Step
from tests.soundness.values import same


def differences(expected: Run, found: Run, tolerance: float = 0.0) -> list[str]:
    """What the two runs do not have in common; empty if they are the same.

    The tolerance is for products of poses, which may be added up in any order; a pose in memory
    may have been multiplied at every stamp.
    """
    return [
        *_of_steps(expected, found, tolerance),
        *_of_failures(expected, found),
        *_of_commands(expected, found, tolerance),
    ]


def _of_steps(expected: Run, found: Run, tolerance: float) -> Iterator[str]:
    for name, steps in expected.steps.items():
        others = found.steps[name]
        if len(steps) != len(others):
            yield f"{name}: {len(steps)} steps expected, {len(others)} found"
        for a, b in zip(steps, others, strict=False):
            if not _same_step(a, b, tolerance * (1 + a.stamp)):
                yield f"{name}: expected {a}\n{' ' * len(name)}  found    {b}"
                break


def _same_step(a: Step, b: Step, tolerance: float) -> bool:
    head = (a.stamp, a.state, a.transition) == (b.stamp, b.state, b.transition)
    return head and same(a.sent, b.sent, tolerance) and same(a.memory, b.memory, tolerance)


def _of_failures(expected: Run, found: Run) -> Iterator[str]:
    a, b = (sorted(map(_said, run.failures)) for run in (expected, found))
    if a != b:
        yield f"faults expected {a}, found {b}"


def _said(failure: Failure) -> tuple[object, ...]:
    about = failure.about if failure.kind in ("UndecidedTransition", "AxiomViolated") else ()
    return failure.subsystem, failure.stamp, failure.state, failure.kind, about


def _of_commands(expected: Run, found: Run, tolerance: float) -> Iterator[str]:
    a, b = (sorted(run.commands, key=lambda c: c[:2]) for run in (expected, found))
    if len(a) != len(b):
        yield f"{len(a)} commands to devices expected, {len(b)} found"
    for one, other in zip(a, b, strict=False):
        if one[:2] != other[:2] or not same(one[2], other[2], tolerance * (1 + one[0])):
            yield f"command expected {one}, found {other}"
            break
