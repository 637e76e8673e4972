"""What a run counts, begins with and goes through; it never influences an agent."""

from __future__ import annotations

from specc.frozen import frozen
from specc.model.expr import Expr
from specc.model.requirement import Requirement
from specc.model.units import Unit
from specc.source import Place


@frozen
class Start:
    """Where a joint is when a run begins: at one of `positions`, or anywhere between two of them.

    Positions are numbers with their units, and `texts` the expressions that they come from. `joint`
    is followed by `.x`, `.y`, `.z` or `.yaw` of a free one.
    """

    joint: str
    positions: tuple[tuple[float, Unit], ...]
    texts: tuple[Expr, ...]
    between: bool
    place: Place


@frozen
class Disturbance:
    """What happens to the plant while a run goes on, from a time on or once `when` holds then.

    Times are in s. Moves and shifts say where joints are put, and how far they are moved.
    """

    because: str
    at: Start | None
    when: Requirement | None
    lasts: Start | None
    moves: tuple[Start, ...]
    shifts: tuple[Start, ...]
    pushes: tuple[tuple[str, tuple[Start, ...], Place], ...]
    """Bodies, with the force on each along x, y and z of the world, N."""
    blocked: tuple[tuple[str, Place], ...]
    """Joints."""
    silent: tuple[tuple[str, Place], ...]
    """Elements of devices, `agent.R.device.element`."""
    place: Place

    @property
    def numbers(self) -> tuple[Start, ...]:
        """All that is drawn for it."""
        times = tuple(time for time in (self.at, self.lasts) if time is not None)
        forces = tuple(part for _, force, _ in self.pushes for part in force)
        return (*times, *self.moves, *self.shifts, *forces)


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
    starts: tuple[Start, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()
