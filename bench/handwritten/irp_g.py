"""The gripper's virtual effector, written by hand (4.6; its tables are those of the YAML file)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from specc_runtime.operators.gripper import distance_to_motor as DM
from specc_runtime.operators.gripper import gripper_interpolation as GI
from specc_runtime.operators.gripper import gripper_regulator as GM
from specc_runtime.operators.gripper import initial_gripper_regulator_state as GM0
from specc_runtime.operators.gripper import motor_to_distance as MD
from specc_runtime.operators.regulator import RegulatorState

RATE = 500  # Hz
TOLERANCE = 0.001  # m


class Inputs:
    __slots__ = ("E_c_m", "E_m_m", "c_d_d", "fresh_c_d_d")

    E_c_m: float
    E_m_m: float
    c_d_d: float
    fresh_c_d_d: bool


class Outputs:
    __slots__ = ("E_c_d", "c_c_c", "c_d_c")

    E_c_d: float
    c_c_c: float
    c_d_c: float


class Memory:
    __slots__ = ("R_p", "d_g", "d_p", "d_s")

    R_p: RegulatorState
    d_g: float
    d_p: float
    d_s: float


class Gripper:
    """S0 holds the fingers, S1 moves them to the commanded distance."""

    def __init__(self, files: Mapping[str, str]) -> None:
        self.x = Inputs()
        self.y = Outputs()
        self.memory = Memory()
        self.state = ""
        self._periods = 0
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        memory = self.memory
        d_c = MD(self.x.E_m_m)
        memory.d_p = memory.d_s = memory.d_g = d_c
        memory.R_p = GM0()
        self.state, self._work = "S0", self._in_s0
        self._hold(d_c)
        return -1

    def _in_s0(self) -> int:
        d_c = MD(self.x.E_m_m)
        if self.x.fresh_c_d_d:
            self.state, self._work = "S1", self._in_s1
            self._begin_motion()
            self._move(d_c)
            return 0
        self._hold(d_c)
        return 2

    def _in_s1(self) -> int:
        x, d_g = self.x, self.memory.d_g
        d_c = MD(x.E_m_m)
        if abs(d_c - d_g) <= TOLERANCE or not abs(x.c_d_d - d_g) <= TOLERANCE:
            if x.fresh_c_d_d:
                self._begin_motion()
                self._move(d_c)
                return 1
            self.state, self._work = "S0", self._in_s0
            self._hold(d_c)
            return 3
        self._periods += 1
        self._move(d_c)
        return -1

    def _hold(self, d_c: float) -> None:
        x, y, memory = self.x, self.y, self.memory
        drive = GM(DM(memory.d_p) - x.E_m_m, memory.R_p)
        memory.R_p = drive.state
        y.E_c_d = drive.c_d
        y.c_d_c = d_c
        y.c_c_c = x.E_c_m

    def _begin_motion(self) -> None:
        memory = self.memory
        memory.d_s, memory.d_g = memory.d_p, self.x.c_d_d
        self._periods = 0

    def _move(self, d_c: float) -> None:
        x, y, memory = self.x, self.y, self.memory
        memory.d_p = d_i = GI(memory.d_s, memory.d_g, self._periods / RATE)
        drive = GM(DM(d_i) - x.E_m_m, memory.R_p)
        memory.R_p = drive.state
        y.E_c_d = drive.c_d
        y.c_d_c = d_c
        y.c_c_c = x.E_c_m
