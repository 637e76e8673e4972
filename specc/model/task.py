"""What a run counts, begins with and goes through; it never influences an agent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from specc.model.expr import Expr
from specc.model.requirement import Requirement
from specc.model.units import DIMENSIONLESS, NEWTON, Unit
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Draw:
    """A number that the seed of a run decides: one of `values`, or anywhere `between` two of them.

    Values have their units, and `texts` are the expressions that they come from. `name` says of
    what it is: `at`, or a joint, which is followed by `.x`, `.y`, `.z` or `.yaw` if it is free.
    """

    name: str
    values: tuple[tuple[float, Unit], ...]
    texts: tuple[Expr, ...]
    is_range: bool
    place: Place

    def first_other_unit(self, wanted: Unit) -> Unit | None:
        """The unit of a value that is not in `wanted`, if there is one; 0 is in any unit."""
        units = (unit for value, unit in self.values if value or unit != DIMENSIONLESS)
        return next((unit for unit in units if unit != wanted), None)


Subject = Literal[
    "coordinate", "distance", "body", "joint", "samples", "measurement", "constant", "button",
    "control",
]  # fmt: skip
"""A coordinate of a joint, and how far from there; a body, a joint; an element of a device; a
constant that may change; a button of the panel, and what else there is on it.
"""


OF_PANEL: tuple[Subject, ...] = ("button", "control")
"""Subjects that are on the operator's panel."""
OF_ELEMENTS: tuple[Subject, ...] = ("samples", "measurement", *OF_PANEL)
"""Subjects that are elements of devices."""


@dataclass(frozen=True, slots=True)
class Verb:
    """What a disturbance can do: once, or over time if it `has_duration`.

    Its numbers have a unit, that of the subject if `unit` is None. With all numbers equal to the
    `neutral` one, which comes with words and a way out, it has no effect; nor has it one while a
    verb of `spoiled_by` acts on the same subject.
    """

    name: str
    participle: str
    subject: Subject
    numbers: Literal["none", "one", "force", "each"]
    """None, one, those along x, y and z, or one for all or each number that is measured."""
    description: str
    has_duration: bool = True
    unit: Unit | None = None
    neutral: tuple[float, str, str] | None = None
    spoiled_by: tuple[str, ...] = ()


_WRONG = "say how wrong the measurement is, or leave it out"
_ROWS = (
    Verb("move", "moved", "coordinate", "one",
        "Joints, with the positions that they are put at.", has_duration=False,
        spoiled_by=("block",)),
    Verb("shift", "shifted", "distance", "one",
        "Joints, with how far they are moved from where they are.", has_duration=False,
        neutral=(0, "by nothing", "say how far it is moved from where it is"),
        spoiled_by=("block", "move")),
    Verb("push", "pushed", "body", "force",
        "Bodies, with the force on each along x, y and z of the world.", unit=NEWTON,
        neutral=(0, "by no force", "say with which force, e.g. `[0, 0, 20[N]]`")),
    Verb("block", "blocked", "joint", "none", "Joints that do not move."),
    Verb("silent", "silenced", "samples", "none",
        "Elements of sporadic devices that have no samples."),
    Verb("scale", "scaled", "measurement", "each",
        "Elements of devices, with the factors of what is measured: one, or one a number.",
        unit=DIMENSIONLESS, neutral=(1, "by 1", _WRONG), spoiled_by=("silent",)),
    Verb("bias", "biased", "measurement", "each",
        "Elements of devices, with what is added to what is measured: one, or one a number.",
        neutral=(0, "by nothing", _WRONG), spoiled_by=("silent",)),
    Verb("adjust", "adjusted", "constant", "one",
        "Constants that are `live`, with the values that they get.", has_duration=False),
    Verb("press", "pressed", "button", "none",
        "Buttons of the panel: pressed once, or held if they are `hold`."),
    Verb("turn", "turned", "control", "one",
        "Elements of the panel, with the values that the operator gives them.",
        has_duration=False),
)  # fmt: skip
VERBS = {row.name: row for row in _ROWS}
"""All that disturbances can do, in the order of their keys; runs have
`specc_runtime.disturbances.VERBS`.
"""


@dataclass(frozen=True, slots=True)
class DisturbanceAction:
    """A verb and the name of its subject: a joint, a body, or `agent.R.device.element`.

    It goes on for the duration of the disturbance if it `has_duration`.
    """

    verb: str
    name: str
    numbers: tuple[Draw, ...]
    place: Place
    has_duration: bool


@dataclass(frozen=True, slots=True)
class Disturbance:
    """What happens to the plant while a run goes on, from a time on or once `when` holds then.

    Times are in s; `delay` is the time from then until it begins, `every` that to the next
    repetition.
    """

    because: str
    at: Draw | None
    when: Requirement | None
    every: Draw | None
    probability: Draw | None
    duration: Draw | None
    actions: tuple[DisturbanceAction, ...]
    place: Place
    delay: Draw | None = None

    def actions_on(self, *subjects: Subject) -> Iterator[tuple[Verb, DisturbanceAction]]:
        """The actions on some kinds of subjects, or all actions if none are given."""
        for action in self.actions:
            verb = VERBS[action.verb]
            if not subjects or verb.subject in subjects:
                yield verb, action

    @property
    def subject(self) -> str:
        """The verbs with their subjects: `block elbow, shift box.x`."""
        return ", ".join(sorted(f"{action.verb} {action.name}" for action in self.actions))

    @property
    def numbers(self) -> tuple[Draw, ...]:
        """All draws of the disturbance."""
        return (*self.times, *(draw for action in self.actions for draw in action.numbers))

    @property
    def times(self) -> tuple[Draw, ...]:
        """The draws that say when it happens, how often and for how long."""
        drawn = self.at, self.delay, self.every, self.probability, self.duration
        return tuple(draw for draw in drawn if draw is not None)


@dataclass(frozen=True, slots=True)
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
