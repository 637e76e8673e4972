"""What a run counts, begins with and goes through; it never influences an agent."""

from __future__ import annotations

from specc.frozen import frozen
from specc.model.expr import Expr
from specc.model.requirement import Requirement
from specc.model.units import DIMENSIONLESS, Unit
from specc.source import Place


@frozen
class Draw:
    """A number that the seed of a run decides: one of `values`, or anywhere `between` two of them.

    Values have their units, and `texts` are the expressions that they come from. `name` says of
    what it is: `at`, or a joint, which is followed by `.x`, `.y`, `.z` or `.yaw` if it is free.
    """

    name: str
    values: tuple[tuple[float, Unit], ...]
    texts: tuple[Expr, ...]
    between: bool
    place: Place

    def misfit(self, wanted: Unit) -> Unit | None:
        """The unit of a value that is not in `wanted`, if there is one; 0 is in any unit."""
        units = (unit for value, unit in self.values if value or unit != DIMENSIONLESS)
        return next((unit for unit in units if unit != wanted), None)


Errors = tuple[tuple[str, tuple[Draw, ...], Place], ...]


@frozen
class Disturbance:
    """What happens to the plant while a run goes on, from a time on or once `when` holds then.

    Times are in s; `every` is the time to the next repetition. Moves and shifts say where joints
    are put, and how far they are moved. Scales and biases have elements of devices, with one number
    for all that is measured, or one for each.
    """

    because: str
    at: Draw | None
    when: Requirement | None
    every: Draw | None
    probability: Draw | None
    lasts: Draw | None
    moves: tuple[Draw, ...]
    shifts: tuple[Draw, ...]
    pushes: tuple[tuple[str, tuple[Draw, ...], Place], ...]
    """Bodies, with the force on each along x, y and z of the world, N."""
    blocked: tuple[tuple[str, Place], ...]
    """Joints."""
    silent: tuple[tuple[str, Place], ...]
    """Elements of devices, `agent.R.device.element`."""
    scales: Errors
    biases: Errors
    place: Place

    @property
    def subject(self) -> str:
        """What it does to what: `block elbow, shift box.x`."""
        done = {
            "move": [draw.name for draw in self.moves],
            "shift": [draw.name for draw in self.shifts],
            "push": [body for body, _, _ in self.pushes],
            "block": [joint for joint, _ in self.blocked],
            "silent": [element for element, _ in self.silent],
            "scale": [element for element, _, _ in self.scales],
            "bias": [element for element, _, _ in self.biases],
        }
        return ", ".join(sorted(f"{verb} {name}" for verb in done for name in done[verb]))

    @property
    def numbers(self) -> tuple[Draw, ...]:
        """All that is drawn for it."""
        several = (*self.pushes, *self.scales, *self.biases)
        parts = tuple(part for _, draws, _ in several for part in draws)
        return (*self.times, *self.moves, *self.shifts, *parts)

    @property
    def times(self) -> tuple[Draw, ...]:
        """When it happens, how often and for how long."""
        drawn = self.at, self.every, self.probability, self.lasts
        return tuple(draw for draw in drawn if draw is not None)


@frozen
class Task:
    """What `specc run` counts and judges; it never influences an agent."""

    subsystem: str
    source: str
    target: str
    scene: str
    judge: str
    watch: tuple[str, ...]
    """Memory elements of `subsystem` that step records carry for the judge."""
    place: Place
    starts: tuple[Draw, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()
