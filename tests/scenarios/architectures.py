"""The architectures of section 5: how long each takes, and a fault that exploring it finds.

What each fault needs can be had by trying measurements. No search turns a planner round, so none of
them rests on what a way planned by an operator looks like.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.scenarios.runs import SPECS, Change

FOLDER = SPECS / "architectures"


@dataclass(frozen=True)
class Architecture:
    """`specs/architectures/NAME.yaml`."""

    name: str
    duration_s: int
    """Simulated time in which all requirements have to be met, at most 60."""
    fault: tuple[Change, ...]
    """Texts that each occur once, and what stands in their place."""
    finds: str
    """The code that `specc explore` reports for the fault."""
    fault_in: str = ""
    """File below `specs` that has the fault, if it is another one."""
    budget: int = 700_000
    """Steps of exploring; with fewer than it needs it ends at this bound."""

    @property
    def path(self) -> Path:
        return FOLDER / f"{self.name}.yaml"


ARCHITECTURES = (
    Architecture(
        "reactive",
        40,
        fault=(
            ("stand: {functions: [stand, report]", "stand: {functions: [stand]"),
            ("wait: {functions: [stand], ", "wait: {"),
        ),
        finds="W1002",
    ),
    Architecture(
        "subsumption",
        60,
        fault=(("[resting, terminal, always, roaming]", "[resting, terminal, always, resting]"),),
        finds="W1004",
    ),
    Architecture(
        "teleoperation",
        58,
        fault=(("[halting,  terminal, always, resting]", "[halting,  terminal, always, halting]"),),
        finds="W1001",
    ),
    Architecture(
        "syndicate",
        57,
        fault=(("all(s.stage >= stage for", "all(s.stage > stage for"),),
        finds="W1002",
    ),
    Architecture(
        "blackboard",
        52,
        fault=(
            ("title: Blackboard\n      rate: 20 Hz", "title: Blackboard\n      rate: 5 Hz"),
            ("[posting,  terminal, always, watching]", "[posting,  terminal, always, posting]"),
        ),
        finds="W1005",
    ),
    Architecture(
        "three_tier",
        60,
        fault=(
            (
                "answered: fresh(x.rover.done) or fresh(x.rover.failed)",
                "answered: fresh(x.rover.done)",
            ),
        ),
        finds="W1002",
        budget=60_000,
    ),
    Architecture(
        "two_tier",
        60,
        fault=(
            (
                "[putting_off, terminal, always,     routing]",
                "[putting_off, terminal, always, putting_off]",
            ),
        ),
        finds="W1005",
        budget=60_000,
    ),
    Architecture(
        "sense_plan_act",
        60,
        fault=(
            (
                "asked: fresh(x.rover.scan)",
                "asked: fresh(x.rover.scan) and len(x.rover.scan) > 0",
            ),
        ),
        finds="W1002",
        budget=60_000,
    ),
    Architecture(
        "services",
        59,
        fault=(("answer: {functions: [answer], terminal: always}", "answer: {terminal: always}"),),
        finds="W1002",
    ),
    Architecture(
        "recovering_picking",
        60,
        fault=(
            (
                "[command_initial_pose, forget_scene, follow]",
                "[command_initial_pose, command_stop, forget_scene, follow]",
            ),
        ),
        finds="W1006",
        budget=200_000,
    ),
    Architecture(
        "two_cells",
        60,
        fault=(
            (
                "[command_waiting_pose, forget_scene, ask]",
                "[command_waiting_pose, command_approach, forget_scene, ask]",
            ),
        ),
        finds="W1006",
        fault_in="lib/irp_at_table.yaml",
        budget=150_000,
    ),
)
