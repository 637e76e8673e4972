"""The control subsystem of a random specification with scripted inputs, interpreted and generated.

A script is what arrives in each period, and how many periods are skipped before it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

from specc_runtime.faults import UndecidedTransition
from specc_runtime.stepping import Stepper

from specc.lower import Proofs
from specc.model.system import System
from tests.soundness.evaluator import Key, Value
from tests.soundness.modes.hierarchical import Failure, Machine, Step, Tree, Written
from tests.soundness.modes.random_machines import COLOURS, SPORADIC, STEADY
from tests.soundness.running import built, memory_of
from tests.soundness.values import plain, same

NAME = "a.c"


@dataclass(frozen=True, slots=True)
class Period:
    """The elements that arrive, fresh, with their values."""

    arrives: dict[Key, Value]
    skipped: int = 0


def values(rng: Random, types: dict[str, str]) -> dict[str, Value]:
    """Values near those that conditions compare with."""
    of = {
        "bool": lambda: rng.random() < 0.5,
        "int": lambda: rng.choice((0, 1, 2, 3, -1)),
        "real[m]": lambda: rng.choice((0.0, 0.5, 0.625, 0.375, 1.0)),
        "Colour": lambda: rng.choice(COLOURS),
    }
    return {name: of[type_]() for name, type_ in types.items()}


def script(rng: Random, periods: int, skips: float = 0.0) -> list[Period]:
    """What the devices and the receptor can send: nothing is there to begin with.

    The effector sends in every period. The receptor decides for the first time in its second
    period, so that nothing of it arrives before the third one.
    """
    found, held = [], values(rng, STEADY)
    often = rng.random()
    for number in range(periods):
        arrives: dict[Key, Value] = {}
        if number:
            held = values(rng, STEADY) if rng.random() < often else held
            arrives = {("m", name): value for name, value in held.items()}
        if number > 1 and rng.random() < 0.4:
            arrives |= {("v", name): value for name, value in values(rng, SPORADIC).items()}
        skipped = rng.randrange(1, 4) if number and rng.random() < skips else 0
        found.append(Period(arrives, skipped))
    return found


def control_of(tree: Tree) -> Tree:
    """The subsystem with modes."""
    part: Tree = tree["agents"]["a"]["control"]
    return part


def interpreted(tree: Tree, periods: Sequence[Period]) -> Iterator[Step | Failure]:
    """The steps until something fails, by the interpreter of modes."""
    machine = Machine(Written(control_of(tree)))
    inputs = dict(initial_inputs())
    for period in periods:
        inputs |= period.arrives
        step = machine.step(inputs, period.arrives, period.skipped)
        yield step
        if isinstance(step, Failure):
            return


def initial_inputs() -> Iterator[tuple[Key, Value]]:
    """Those of the effector begin with a value."""
    begin = {"bool": False, "int": 0, "real[m]": 0.0, "Colour": "red"}
    for name, type_ in STEADY.items():
        yield ("m", name), begin[type_]


@dataclass(frozen=True, slots=True)
class Did:
    """What generated code did in a period; `failed` is empty, or how."""

    state: str
    cause: str
    sent: tuple[tuple[str, Value], ...] = ()
    memory: tuple[tuple[str, Value], ...] = ()
    failed: str = ""
    rows: int = 0


def generated(system: System, proofs: Proofs | None, periods: Sequence[Period]) -> Iterator[Did]:
    """The steps until something fails, by generated code; without proofs it tests all rows."""
    with built(system, proofs) as made:
        machine: Any = made.scheduled(NAME).subsystem
        stepper = Stepper(machine)
        for period in periods:
            if period.skipped:
                stepper.skip(period.skipped)
            arrives = {f"{peer}_{name}": value for (peer, name), value in period.arrives.items()}
            stepper.feed(arrives, {}, ())
            did = _did(machine, stepper)
            yield did
            if did.failed:
                return


def _did(machine: Any, stepper: Stepper) -> Did:
    try:
        row = stepper.step()
    except UndecidedTransition as fault:
        return Did(machine.state, fault.cause, failed="undecided", rows=len(fault.rows))
    except (AttributeError, ArithmeticError, TypeError, ValueError) as error:
        return Did(machine.state, "", failed=str(error))
    cause = machine.transitions[row].cause if row >= 0 else ""
    written = machine.sends.get(machine.state, ())
    sent = tuple(sorted((name, plain(getattr(machine.y, name))) for name in written))
    return Did(machine.state, cause, sent, memory_of(machine))


def difference(expected: Step | Failure, found: Did) -> str:
    """What generated code did that the interpreter did not; empty if they agree."""
    if isinstance(expected, Failure) or found.failed:
        return _of_failures(expected, found)
    # What the work cycle keeps for modes is memory, as it is at the next time stamp: one period
    # later, and no longer the first one.
    active = dict.fromkeys(expected.active, 1)
    clocks = {
        **{f"periods_{m}": periods + active.get(m, 0) for m, periods in expected.lasted},
        **{f"left_{m}": state for m, state in expected.left},
        **{f"entered_{m}": False for m, _ in expected.lasted},
    }
    known = clocks | dict(expected.memory)
    pairs = [
        ("state", expected.state, found.state),
        ("cause", expected.cause, found.cause),
        ("outputs", expected.sent, found.sent),
        *((name, known.get(name, value), value) for name, value in found.memory),
    ]
    wrong = [f"{what} {a!r}, not {b!r}" for what, a, b in pairs if not _agree(what, a, b)]
    return f"period {expected.stamp}, expected {', '.join(wrong)}: {expected}" if wrong else ""


def _agree(what: str, a: Value, b: Value) -> bool:
    if what == "cause" and b == "error":
        return a not in ("", "terminal")  # one condition that no row names
    return same(a, b)


def _of_failures(expected: Step | Failure, found: Did) -> str:
    if not isinstance(expected, Failure) or not found.failed:
        return f"period {expected.stamp}: expected {expected}, found {found}"
    undecided = expected.kind == "undecided"
    alike = undecided == (found.failed == "undecided")
    if not alike or (undecided and len(expected.rows) != found.rows):
        return f"period {expected.stamp}: expected {expected}, found {found}"
    return ""
