"""The virtual receptor of the RGB-D sensor, written by hand (4.7, eqs 36 to 51, Tables 7 and 8)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from specc_runtime.operators.vision.camera import Intrinsics
from specc_runtime.operators.vision.camera import kinect_intrinsics as KI
from specc_runtime.operators.vision.features import extract_features as FE
from specc_runtime.operators.vision.features import to_cartesian as IC
from specc_runtime.operators.vision.grouping import group_correspondences as CG
from specc_runtime.operators.vision.hypotheses import project_hypotheses as HP
from specc_runtime.operators.vision.matching import match_features as FM
from specc_runtime.operators.vision.models import load_models as LM
from specc_runtime.operators.vision.values import Object, ObjectModel
from specc_runtime.operators.vision.verification import verify_hypotheses as HV
from specc_runtime.values import Depth, Rgb


class Inputs:
    __slots__ = ("R_I_d", "R_I_rgb", "fresh_R_I_d", "fresh_R_I_rgb")

    R_I_d: Depth
    R_I_rgb: Rgb
    fresh_R_I_d: bool
    fresh_R_I_rgb: bool


class Outputs:
    __slots__ = ("c_O_c",)

    c_O_c: tuple[Object, ...]


class Memory:
    __slots__ = ("P", "models")

    P: Intrinsics
    models: tuple[ObjectModel, ...]


class ObjectRecognition:
    """S0 waits for images, S1 recognises objects in them."""

    def __init__(self, files: Mapping[str, str]) -> None:
        self.x = Inputs()
        self.y = Outputs()
        self.memory = Memory()
        self.state = ""
        self._models = files["objects"]
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        self.memory.models = LM(self._models)
        self.memory.P = KI()
        self.state, self._work = "S0", self._in_s0
        return -1

    def _in_s0(self) -> int:
        x = self.x
        if x.fresh_R_I_rgb and x.fresh_R_I_d:  # eq. 36
            self.state, self._work = "S1", self._in_s1
            self._recognise()
            return 1
        return 0

    def _in_s1(self) -> int:
        x = self.x
        if x.fresh_R_I_rgb and x.fresh_R_I_d:
            self._recognise()
            return 3
        self.state, self._work = "S0", self._in_s0
        return 2

    def _recognise(self) -> None:
        x, memory = self.x, self.memory
        models, P = memory.models, memory.P
        C_sift = IC(FE(x.R_I_rgb), x.R_I_d, P)  # eqs 44, 45
        T = CG(FM(C_sift, models), C_sift, models)  # eqs 46 to 48
        self.y.c_O_c = HV(HP(T, models), x.R_I_d, P)  # eqs 49 to 51
