"""The architectures of section 5: how long each takes, and what has to be noticed in each: a fault
that exploring finds, and a failure of the task that a run shows.

What each fault needs can be had by trying measurements. No search turns a planner round, so none of
them rests on what a way planned by an operator looks like.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.scenarios.runs import SPECS, Change

FOLDER = SPECS / "architectures"


@dataclass(frozen=True)
class Figure:
    """A number of each run that the page gives the bounds of.

    `of` is how a requirement begins: the number is `limit` and `factor` times its margin. Of none,
    it is how long the first cycle took, in s.
    """

    said: str
    """A pattern of the page with the bounds as groups: the least, the most, or both."""
    of: str = ""
    limit: float = 0.0
    factor: float = 1.0


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
    failure: tuple[Change, ...]
    """Likewise, so that the task goes wrong."""
    violates: tuple[str, ...]
    """How the requirements begin that a run of seed 0 then violates."""
    fault_in: str = ""
    """File below `specs` that has the fault, if it is another one."""
    failure_in: str = ""
    """Likewise for the failure."""
    failure_s: int = 0
    """Simulated time after which it is seen, if that is before the end."""
    failure_seed: int = 0
    runs: int = 3
    """How many runs of the ten that the page tells of the long tests repeat; bench/architectures.py
    makes all."""
    figures: tuple[Figure, ...] = ()
    """What the page says of its runs."""

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
        failure=(("min(gain * (x.ring.ahead - near_by), cruise)", "cruise"),),
        violates=("always(historically(reaction",),
    ),
    Architecture(
        "subsumption",
        60,
        fault=(("[resting, terminal, always, roaming]", "[resting, terminal, always, resting]"),),
        finds="W1004",
        failure=(("is: seek if seek is not None else low", "is: low"),),
        violates=("within(59[s], plant.taken[1]",),
    ),
    Architecture(
        "teleoperation",
        58,
        fault=(
            (
                "[halting,  terminal, always,    resting]",
                "[halting,  terminal, always,    halting]",
            ),
        ),
        finds="W1001",
        failure=(("or elapsed > 0.3[s]", "or elapsed > 30[s]"),),
        failure_seed=1,  # in some runs the arm stands when the stick fails
        violates=("always(console.stick.since > 1.1[s]",),
        figures=(
            Figure("tip at most (?P<most>[0-9.]+) mm past", "always(plant.tip.y", 2, -1000),
            Figure("(?P<most>[0-9.]+) m/s where", "always(norm(plant.v)", 0.24, -1),
            Figure("limit, (?P<most>[0-9.]+) N", "always(plant.F", 30, -1),
        ),
    ),
    Architecture(
        "syndicate",
        57,
        fault=(("all(s.stage >= stage for", "all(s.stage > stage for"),),
        finds="W1002",
        failure=(("trouble == stage", "trouble > 0"),),
        violates=("within(55[s], state(planners_1.c) == finished",),
        figures=(
            Figure("done after (?P<least>[0-9.]+) to (?P<most>[0-9.]+) s"),
            Figure("plank at most (?P<most>[0-9.]+) mm", "within(55[s]", 30, -1000),
            Figure("rovers at most (?P<most>[0-9.]+) mm", "always(all(state(r.c)", 40, -1000),
        ),
    ),
    Architecture(
        "blackboard",
        52,
        fault=(
            ("title: Blackboard\n      rate: 20 Hz", "title: Blackboard\n      rate: 5 Hz"),
            ("[posting,  terminal, always, watching]", "[posting,  terminal, always, posting]"),
        ),
        finds="W1005",
        failure=(("e.sigma <= post_{i}.sigma", "e.sigma < 0"),),
        violates=("always(len(board.c.entries)",),
        figures=(Figure("and never more than (?P<most>[0-9.]+) entries", "always(len(", 17, -1),),
    ),
    Architecture(
        "three_tier",
        60,
        fault=(
            (
                "when: fresh(x.rover.done) or fresh(x.rover.failed)",
                "when: fresh(x.rover.done)",
            ),
        ),
        finds="W1002",
        failure=(('"obstacles + [x.rover.failed]"', '"obstacles"'),),
        violates=("within(59[s], norm(plant.rover_at - blue)",),
        figures=(Figure("after (?P<least>[0-9.]+) to (?P<most>[0-9.]+) s"),),
    ),
    Architecture(
        "two_tier",
        60,
        fault=(
            (
                "[[noting, putting_off],  terminal, always,     routing]",
                "[noting, terminal, always, routing]\n"
                "        - [putting_off, terminal, always, putting_off]",
            ),
        ),
        finds="W1005",
        failure=(('stop: {is: "0.4[m]"', 'stop: {is: "1[mm]"'),),
        violates=("always(norm(plant.boulder_v)",),
        figures=(Figure("after (?P<least>[0-9.]+) to (?P<most>[0-9.]+) s"),),
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
        failure=(('stop: {is: "0.42[m]"', 'stop: {is: "1[mm]"'),),
        violates=("always(plant.touched",),
        figures=(Figure("after (?P<least>[0-9.]+) to (?P<most>[0-9.]+) s"),),
    ),
    Architecture(
        "services",
        59,
        fault=(("answer: {functions: [answer], terminal: always}", "answer: {terminal: always}"),),
        finds="W1002",
        failure=(("carry if x.platform.knows else nothing", "inspect"),),
        failure_in="parts/carrier.yaml",
        violates=("within(58[s], norm(plant.table",),
        figures=(
            Figure("table within (?P<most>[0-9.]+) mm", "within(58[s], state(composer", 80, -1000),
        ),
    ),
    Architecture(
        "recovering_picking",
        60,
        fault=(
            (
                '[{y.m.T_d: X_BEs, O_c: "[]"}, follow]',
                '[command_approach, {y.m.T_d: X_BEs, O_c: "[]"}, follow]',
            ),
        ),
        finds="W1006",
        failure=(
            ('blindness: {is: "1[s]"', 'blindness: {is: "60[s]"'),
            (
                "[[S7, R2],           terminal,       always, S8]",
                "[S7, terminal, always, S8]\n        - [R2, terminal, always, R2]",
            ),
        ),
        violates=(
            "within(30[s], state(irp.c) == S1 and once(0.1[s], state(irp.c) == S2",
            "within(59[s], state(irp.c) == S9",
        ),
        runs=1,  # half a minute each
        figures=(
            Figure(
                "at least (?P<least>[0-9.]+) cm above", "within(59[s], state(irp.c) == S9", 0, 100
            ),
        ),
    ),
    Architecture(
        "two_cells",
        60,
        fault=(
            (
                '[{y.m.T_d: X_BEs, O_c: "[]"}, ask]',
                '[command_approach, {y.m.T_d: X_BEs, O_c: "[]"}, ask]',
            ),
        ),
        finds="W1006",
        failure=(
            (
                "[asking,      terminal, otherwise, looking]",
                "[asking,      terminal, otherwise, going]",
            ),
        ),
        failure_in="parts/irp_at_table.yaml",
        failure_s=12,
        violates=("always(norm(plant.hand_1",),
        fault_in="parts/irp_at_table.yaml",
        runs=1,  # half a minute each
        figures=(Figure("than (?P<least>[0-9.]+) m, and no box", "always(norm(plant.hand_1", 0.3),),
    ),
)
