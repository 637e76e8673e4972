"""The manipulator's virtual effector, written by hand from 4.5 (eqs 4 to 31, Tables 3 and 4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from specc_runtime.builtins import near_pose, vector
from specc_runtime.operators.dynamics import Arm
from specc_runtime.operators.dynamics import gravity_feedforward as GF
from specc_runtime.operators.dynamics import load_arm as LA
from specc_runtime.operators.force_control import angle_axis_to_pose as AA
from specc_runtime.operators.force_control import eliminate_gravity as GE
from specc_runtime.operators.force_control import position_force as PF
from specc_runtime.operators.interpolation import motor_interpolation as MI
from specc_runtime.operators.kinematics import direct_kinematics as DK
from specc_runtime.operators.kinematics import inverse_kinematics as IK
from specc_runtime.operators.motors import initial_regulator_state as MR0
from specc_runtime.operators.motors import joint_to_motor as JM
from specc_runtime.operators.motors import motor_regulator as MR
from specc_runtime.operators.motors import motor_to_joint as MJ
from specc_runtime.operators.regulator import RegulatorState
from specc_runtime.values import Pose, Spatial, Vector

PERIOD = 0.002  # s
RATE = 500  # Hz
POSITION_TOLERANCE = 0.001  # m
ROTATION_TOLERANCE = 0.01  # rad
TOOL_WEIGHT = 13.18  # N
P_S_COM = vector(0.0, 0.004, 0.04)  # m
AT_REST = vector(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # m/s, rad/s


class Inputs:
    __slots__ = (
        "E_F_m", "E_m_m", "c_D_d", "c_F_d", "c_I_d", "c_T_d", "c_V_d", "c_b",
        "fresh_c_T_d", "fresh_c_b",
    )  # fmt: skip

    E_F_m: Spatial
    E_m_m: Vector
    c_D_d: Spatial
    c_F_d: Spatial
    c_I_d: Spatial
    c_T_d: Pose
    c_V_d: Spatial
    c_b: tuple[str, ...]
    fresh_c_T_d: bool
    fresh_c_b: bool


class Outputs:
    __slots__ = ("E_c_d", "c_F_c", "c_T_c")

    E_c_d: Vector
    c_F_c: Spatial
    c_T_c: Pose


class Memory:
    __slots__ = ("R_p", "T_g", "arm", "m_d", "m_g", "m_s", "q_p", "r_p")

    R_p: RegulatorState
    T_g: Pose
    arm: Arm
    m_d: Vector
    m_g: Vector
    m_s: Vector
    q_p: Vector
    r_p: Spatial


class Manipulator:
    """S0 idles, S1 executes a point-to-point motion, S2 position-force control."""

    def __init__(self, files: Mapping[str, str]) -> None:
        self.x = Inputs()
        self.y = Outputs()
        self.memory = Memory()
        self.state = ""
        self.violations: tuple[int, ...] = ()
        self._arm_file = files["irp6"]
        self._periods = 0
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        x = self.x
        if x.fresh_c_T_d and x.fresh_c_b:
            self.violations = (*self.violations, 0)
        return self._work()

    def _start(self) -> int:
        memory, m_m = self.memory, self.x.E_m_m
        q_c = MJ(m_m)
        T_c = DK(q_c)
        memory.m_d = memory.m_s = memory.m_g = m_m
        memory.q_p = q_c
        memory.T_g = T_c
        memory.r_p = AT_REST
        memory.R_p = MR0()
        memory.arm = LA(self._arm_file)
        self.state, self._work = "S0", self._in_s0
        self._idle(q_c, T_c)
        return -1

    def _in_s0(self) -> int:
        x = self.x
        q_c = MJ(x.E_m_m)
        T_c = DK(q_c)
        if x.fresh_c_T_d:  # eq. 4
            self.state, self._work = "S1", self._in_s1
            self._begin_motion()
            self._p2p(q_c, T_c)
            return 1
        if x.fresh_c_b and "s" not in x.c_b:  # eq. 7
            self.state, self._work = "S2", self._in_s2
            self._position_force(q_c, T_c)
            return 2
        self._idle(q_c, T_c)  # eq. 10
        return 0

    def _in_s1(self) -> int:
        x, T_g = self.x, self.memory.T_g
        q_c = MJ(x.E_m_m)
        T_c = DK(q_c)
        if not near_pose(T_c, T_g, POSITION_TOLERANCE, ROTATION_TOLERANCE) and near_pose(
            x.c_T_d, T_g, POSITION_TOLERANCE, ROTATION_TOLERANCE
        ):  # eq. 5
            self._periods += 1
            self._p2p(q_c, T_c)
            return -1
        if x.fresh_c_T_d:
            self._begin_motion()
            self._p2p(q_c, T_c)
            return 4
        if x.fresh_c_b and "s" not in x.c_b:
            self.state, self._work = "S2", self._in_s2
            self._position_force(q_c, T_c)
            return 5
        self.state, self._work = "S0", self._in_s0
        self._idle(q_c, T_c)
        return 3

    def _in_s2(self) -> int:
        x = self.x
        q_c = MJ(x.E_m_m)
        T_c = DK(q_c)
        if x.fresh_c_T_d:  # eq. 8
            self.state, self._work = "S1", self._in_s1
            self._begin_motion()
            self._p2p(q_c, T_c)
            return 7
        if x.fresh_c_b:
            if "s" not in x.c_b:
                self._position_force(q_c, T_c)
                return 8
            self.state, self._work = "S0", self._in_s0
            self._idle(q_c, T_c)
            return 6
        self._position_force(q_c, T_c)
        return -1

    def _idle(self, q_c: Vector, T_c: Pose) -> None:
        x, y, memory = self.x, self.y, self.memory
        drive = MR(memory.m_d - x.E_m_m, memory.R_p, GF(q_c, memory.arm))
        y.E_c_d = drive.c_d  # eq. 14
        y.c_T_c = T_c  # eq. 15
        y.c_F_c = GE(x.E_F_m, T_c, TOOL_WEIGHT, P_S_COM)
        memory.R_p = drive.state
        memory.r_p = AT_REST

    def _begin_motion(self) -> None:
        memory, T_d = self.memory, self.x.c_T_d
        memory.m_s = memory.m_d
        memory.m_g = JM(IK(T_d, memory.q_p))
        memory.T_g = T_d
        self._periods = 0

    def _p2p(self, q_c: Vector, T_c: Pose) -> None:
        x, y, memory = self.x, self.y, self.memory
        m_d = MI(memory.m_s, memory.m_g, self._periods / RATE)
        drive = MR(m_d - x.E_m_m, memory.R_p, GF(q_c, memory.arm))
        y.E_c_d = drive.c_d  # eq. 17
        y.c_T_c = T_c  # eq. 18
        y.c_F_c = GE(x.E_F_m, T_c, TOOL_WEIGHT, P_S_COM)
        memory.R_p = drive.state
        memory.q_p = MJ(m_d)  # eq. 20
        memory.m_d = m_d  # eq. 21
        memory.r_p = AT_REST

    def _position_force(self, q_c: Vector, T_c: Pose) -> None:
        x, y, memory = self.x, self.y, self.memory
        q_p = memory.q_p
        F_c = GE(x.E_F_m, T_c, TOOL_WEIGHT, P_S_COM)  # eq. 25
        r_d = PF(x.c_F_d, x.c_V_d, x.c_D_d, x.c_I_d, x.c_b, memory.r_p, F_c, PERIOD)  # eq. 26
        q_d = IK(DK(q_p) @ AA(r_d * PERIOD), q_p)
        m_d = JM(q_d)
        drive = MR(m_d - x.E_m_m, memory.R_p, GF(q_c, memory.arm))
        y.E_c_d = drive.c_d  # eq. 27
        y.c_T_c = T_c  # eq. 24
        y.c_F_c = F_c
        memory.R_p = drive.state
        memory.r_p = r_d  # eq. 29
        memory.q_p = q_d  # eq. 30
        memory.m_d = m_d  # eq. 31
