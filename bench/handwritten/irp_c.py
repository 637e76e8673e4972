"""The control subsystem, written by hand from 4.8 (eqs 52 to 88, Tables 9 to 12)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import nan

from specc_runtime.builtins import (
    argmax,
    identity,
    inverse,
    near_pose,
    norm,
    pose,
    position,
    read_only,
    translation,
    vector,
)
from specc_runtime.operators.grasping import grasp_pose as GC
from specc_runtime.operators.grasping import left_right_grasp as LR
from specc_runtime.operators.kinematics import direct_kinematics as DK
from specc_runtime.operators.scene import graspable_objects as GO
from specc_runtime.operators.scene import transform_objects as TO
from specc_runtime.operators.scene import update_scene as US
from specc_runtime.operators.vision.values import Object
from specc_runtime.values import Pose, Spatial

POSITION_TOLERANCE = 0.001  # m
ROTATION_TOLERANCE = 0.01  # rad
FINGER_TOLERANCE = 0.001  # m
GRASP_TOLERANCE = 0.003  # m
CONTACT_FORCE = 2.0  # N
Q_START = vector(0.0, -1.570796, 0.0, 0.0, 4.712389, -1.570796)  # rad
X_BK = read_only(
    pose(vector(0.88317, -0.21239, 2.0291), vector(0.70462, -0.70437, -0.04336, 0.0741))
)
X_PG = read_only(translation(0.0, 0.0, 0.2))
X_GP = read_only(inverse(X_PG))
X_EF = identity()
APPROACH = ("u", "u", "g", "u", "u", "u")  # eq. 76
CLOSE = ("c", "c", "u", "u", "u", "u")  # eq. 83
NO_FORCE = vector(nan, nan, nan, nan, nan, nan)  # eq. 77
YIELDING = vector(0.0, 0.0, nan, nan, nan, nan)  # eq. 84
STANDING = vector(nan, nan, 0.0, 0.0, 0.0, 0.0)  # eq. 85
SLOWLY = vector(0.0, 0.0, 0.01, 0.0, 0.0, 0.0)  # eq. 78
DAMPED_Z = vector(nan, nan, 400.0, nan, nan, nan)  # eq. 79
INERT_Z = vector(nan, nan, 20.0, nan, nan, nan)  # eq. 80
DAMPED_XY = vector(400.0, 400.0, nan, nan, nan, nan)  # eq. 86
INERT_XY = vector(20.0, 20.0, nan, nan, nan, nan)  # eq. 87
OPEN = 0.09  # m
TIGHT = 0.1  # A


class Inputs:
    __slots__ = ("fresh_k_O_c", "g_c_c", "g_d_c", "k_O_c", "m_F_c", "m_T_c")

    fresh_k_O_c: bool
    g_c_c: float
    g_d_c: float
    k_O_c: tuple[Object, ...]
    m_F_c: Spatial
    m_T_c: Pose


class Outputs:
    __slots__ = ("g_d_d", "m_D_d", "m_F_d", "m_I_d", "m_T_d", "m_V_d", "m_b")

    g_d_d: float
    m_D_d: Spatial
    m_F_d: Spatial
    m_I_d: Spatial
    m_T_d: Pose
    m_V_d: Spatial
    m_b: tuple[str, ...]


class Memory:
    __slots__ = ("O_c", "O_s", "X_BEg", "X_BEp", "d_o")

    O_c: tuple[Object, ...]
    O_s: tuple[Object, ...]
    X_BEg: Pose
    X_BEp: Pose
    d_o: float


class Picking:
    """States S1 to S9 follow one another (Table 10)."""

    def __init__(self, files: Mapping[str, str]) -> None:
        self.x = Inputs()
        self.y = Outputs()
        self.memory = Memory()
        self.state = ""
        self._work: Callable[[], int] = self._start
        self.X_BEs = DK(Q_START)

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        memory = self.memory
        memory.O_c = memory.O_s = ()
        memory.X_BEg = memory.X_BEp = self.X_BEs
        memory.d_o = 0.0
        self.state, self._work = "S1", self._in_s1
        self._move_to_initial_pose()
        return -1

    def _in_s1(self) -> int:
        T_c, X_BEs = self.x.m_T_c, self.X_BEs
        if near_pose(T_c, X_BEs, POSITION_TOLERANCE, ROTATION_TOLERANCE):  # eq. 52
            self.state, self._work = "S2", self._in_s2
            self._recognise_objects()
            return 0
        self._move_to_initial_pose()
        return -1

    def _in_s2(self) -> int:
        memory = self.memory
        graspable = GO(memory.O_c, X_EF, X_PG, Q_START)
        if graspable:  # eq. 53
            self.state, self._work = "S3", self._in_s3
            self._generate_grasp_parameters(graspable)
            return 1
        self._recognise_objects()
        return -1

    def _in_s3(self) -> int:
        self.state, self._work = "S4", self._in_s4  # eq. 54
        self._move_to_pregrasp_pose()
        return 2

    def _in_s4(self) -> int:
        T_c, X_BEp = self.x.m_T_c, self.memory.X_BEp
        if near_pose(T_c, X_BEp, POSITION_TOLERANCE, ROTATION_TOLERANCE):  # eq. 55
            self.state, self._work = "S5", self._in_s5
            self._open_gripper()
            return 3
        self._move_to_pregrasp_pose()
        return -1

    def _in_s5(self) -> int:
        if abs(self.x.g_d_c - OPEN) <= FINGER_TOLERANCE:  # eq. 56
            self.state, self._work = "S6", self._in_s6
            self._move_to_grasp_pose()
            return 4
        self._open_gripper()
        return -1

    def _in_s6(self) -> int:
        x = self.x
        if (
            near_pose(x.m_T_c, self.memory.X_BEg, GRASP_TOLERANCE, ROTATION_TOLERANCE)
            or x.m_F_c.item(2) > CONTACT_FORCE
        ):  # eq. 57
            self.state, self._work = "S7", self._in_s7
            self._close_gripper()
            return 5
        self._move_to_grasp_pose()
        return -1

    def _in_s7(self) -> int:
        x, memory = self.x, self.memory
        if abs(x.g_d_c - memory.d_o) <= FINGER_TOLERANCE or x.g_c_c >= TIGHT:  # eq. 58
            self.state, self._work = "S8", self._in_s8
            self._move_to_pregrasp_pose()
            return 6
        self._close_gripper()
        return -1

    def _in_s8(self) -> int:
        T_c, X_BEp = self.x.m_T_c, self.memory.X_BEp
        if near_pose(T_c, X_BEp, POSITION_TOLERANCE, ROTATION_TOLERANCE):
            self.state, self._work = "S9", self._in_s9
            self._open_gripper()
            return 7
        self._move_to_pregrasp_pose()
        return -1

    def _in_s9(self) -> int:
        if abs(self.x.g_d_c - OPEN) <= FINGER_TOLERANCE:
            self.state, self._work = "S1", self._in_s1
            self._move_to_initial_pose()
            return 8
        self._open_gripper()
        return -1

    def _move_to_initial_pose(self) -> None:
        self.y.m_T_d = self.X_BEs  # eq. 62
        self.memory.O_c = ()

    def _recognise_objects(self) -> None:
        x, memory = self.x, self.memory
        if x.fresh_k_O_c:
            memory.O_c = US(memory.O_c, TO(X_BK, x.k_O_c))  # eq. 64

    def _generate_grasp_parameters(self, graspable: tuple[Object, ...]) -> None:
        memory = self.memory
        selected = argmax((each.confidence, each) for each in graspable)
        fingers = LR(selected)
        grasp = GC(fingers, X_EF)
        memory.d_o = norm(position(fingers.X_Bl) - position(fingers.X_Br))  # eq. 67
        memory.X_BEg = grasp  # eq. 68
        memory.X_BEp = grasp @ X_GP  # eq. 69
        memory.O_s = (selected,)

    def _move_to_pregrasp_pose(self) -> None:
        self.y.m_T_d = self.memory.X_BEp  # eq. 71

    def _open_gripper(self) -> None:
        self.y.g_d_d = OPEN  # eq. 73

    def _move_to_grasp_pose(self) -> None:
        y = self.y
        y.m_b = APPROACH
        y.m_F_d = NO_FORCE
        y.m_V_d = SLOWLY
        y.m_D_d = DAMPED_Z
        y.m_I_d = INERT_Z

    def _close_gripper(self) -> None:
        y = self.y
        y.m_b = CLOSE
        y.m_F_d = YIELDING
        y.m_V_d = STANDING
        y.m_D_d = DAMPED_XY
        y.m_I_d = INERT_XY
        y.g_d_d = self.memory.d_o  # eq. 88
