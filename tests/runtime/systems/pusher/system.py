"""Control, a motor of 500 Hz, and a slow receptor that estimates where the cart is."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.subsystem import Equations, Subsystem, Transition
from specc_runtime.system import (
    Connection,
    PlantInput,
    PlantOutput,
    PlantSpec,
    Scheduled,
    System,
    Task,
)


class Buffer:
    __slots__ = ()


class MotorInputs(Buffer):
    __slots__ = ("E_q", "c_goal", "present_c_goal")


class MotorOutputs(Buffer):
    __slots__ = ("E_force", "c_q")


class Motor(Subsystem):
    name = "a.m"
    period_s = 0.002
    initial_state = "S0"
    transitions = (Transition("S0", "terminal", "always", "S0"),)
    sends: ClassVar = {"S0": ("E_force", "c_q")}
    equations = Equations({"S0": (2,)}, {"S0": {"terminal": (1,), "error": (9,)}}, ((3,),))

    def __init__(self) -> None:
        self.x, self.y, self.memory = MotorInputs(), MotorOutputs(), None

    def step(self) -> int:
        first, self.state = not self.state, "S0"
        goal = self.x.c_goal if self.x.present_c_goal else 0.0
        self.y.E_force = 40.0 * (goal - self.x.E_q)
        self.y.c_q = self.x.E_q
        return -1 if first else 0


class EyeInputs(Buffer):
    __slots__ = ("R_image",)


class EyeOutputs(Buffer):
    __slots__ = ("c_redness",)


class Eye(Subsystem):
    name = "a.k"
    period_s = 0.1
    initial_state = "S0"
    transitions = (Transition("S0", "terminal", "always", "S0"),)
    sends: ClassVar = {"S0": ("c_redness",)}

    def __init__(self) -> None:
        self.x, self.y, self.memory = EyeInputs(), EyeOutputs(), None

    def step(self) -> int:
        first, self.state = not self.state, "S0"
        image = self.x.R_image.astype(np.int64)
        columns = np.arange(image.shape[1])
        red = np.clip(image[:, :, 0] - image[:, :, 1], 0, None)
        self.y.c_redness = float((red * columns).sum() / max(1, red.sum()))
        return -1 if first else 0


class ControlInputs(Buffer):
    __slots__ = ("k_redness", "m_q")


class ControlOutputs(Buffer):
    __slots__ = ("m_goal",)


class ControlMemory(Buffer):
    __slots__ = ("place",)


class Control(Subsystem):
    name = "a.c"
    period_s = 0.01
    initial_state = "S0"
    transitions = (
        Transition("S0", "terminal", "away", "S1"),
        Transition("S0", "terminal", "not_yet", "S0"),
        Transition("S1", "terminal", "home", "S0"),
        Transition("S1", "terminal", "not_yet", "S1"),
    )
    sends: ClassVar = {"S0": ("m_goal",), "S1": ("m_goal",)}
    equations = Equations({"S0": (10,), "S1": (11,)}, {}, ((20,), (21,), (22,), (23,)))

    def __init__(self) -> None:
        self.x, self.y, self.memory = ControlInputs(), ControlOutputs(), ControlMemory()

    def step(self) -> int:
        q = getattr(self.x, "m_q", 0.0)
        before, row = self.state, -1
        if before == "S0":
            row = 0 if q > 0.45 else 1
        elif before == "S1":
            row = 2 if q < 0.05 else 3
        self.state = self.transitions[row].target if row >= 0 else self.initial_state
        self.y.m_goal = 0.5 if self.state == "S0" else 0.0
        self.memory.place = q
        return row


def build(base: str) -> System:
    return System(
        "pusher",
        0.002,
        (Scheduled(Motor(), 1), Scheduled(Control(), 5), Scheduled(Eye(), 50)),
        (
            Connection("a.m", "c_q", "a.c", "m_q"),
            Connection("a.c", "m_goal", "a.m", "c_goal"),
            Connection("a.k", "c_redness", "a.c", "k_redness"),
        ),
        PlantSpec(
            "pusher.xml",
            (
                SensorBinding("a.E.m.q", joints=("rail",)),
                SensorBinding("a.R.k.image", camera="overview", image="rgb", rate_hz=10.0),
            ),
            (ActuatorBinding("a.E.m.force", ("push",)),),
            (PlantInput("a.E.m.q", "a.m", "E_q"), PlantInput("a.R.k.image", "a.k", "R_image")),
            (PlantOutput("a.m", "E_force", "a.E.m.force"),),
        ),
        Task(
            "a.c",
            "S1",
            "S0",
            "tests.runtime.systems.pusher.task:Somewhere",
            "tests.runtime.systems.pusher.task:Farthest",
            ("place",),
        ),
        "pusher.yaml",
    )
