"""The machines of two_machines.yaml by hand, each in three styles.

`...If` is one chain of ifs, `...Method` has a method for each state with the behaviours written
out in it, `...Behaviours` has a method for each state and for each behaviour.
"""

from __future__ import annotations

from collections.abc import Callable


class ArmInputs:
    __slots__ = ("E_arrived", "c_comply", "c_goal", "fresh_c_comply", "fresh_c_goal")

    E_arrived: bool
    c_comply: bool
    c_goal: int
    fresh_c_comply: bool
    fresh_c_goal: bool


class ArmOutputs:
    __slots__ = ("E_brake", "E_motion", "c_busy")

    E_brake: bool
    E_motion: str
    c_busy: bool


class ControlInputs:
    __slots__ = ("arm_busy", "eye_closed", "eye_contact", "eye_lost", "eye_opened", "eye_seen")

    arm_busy: bool
    eye_closed: bool
    eye_contact: bool
    eye_lost: bool
    eye_opened: bool
    eye_seen: bool


class ControlOutputs:
    __slots__ = ("arm_comply", "arm_goal")

    arm_comply: bool
    arm_goal: int


class NoMemory:
    __slots__ = ()


class ArmIf:
    Inputs = ArmInputs

    def __init__(self) -> None:
        self.x, self.y, self.memory, self.state = ArmInputs(), ArmOutputs(), NoMemory(), ""

    def step(self) -> int:  # the style that is measured here
        x, y, state = self.x, self.y, self.state
        if state == "S0":
            if x.fresh_c_goal:
                row = 1
            elif x.fresh_c_comply:
                row = 2
            else:
                y.E_motion, y.E_brake, y.c_busy = "held", True, False
                return 0
        elif state == "S1":
            if not (x.E_arrived or x.fresh_c_comply):
                y.E_motion, y.E_brake, y.c_busy = "moving", False, True
                return -1
            if x.fresh_c_goal:
                row = 4
            elif x.fresh_c_comply:
                row = 5
            else:
                self.state = "S0"
                y.E_motion, y.E_brake, y.c_busy = "held", True, False
                return 3
        elif state == "S2":
            if x.fresh_c_goal:
                row = 6
            else:
                y.E_motion, y.E_brake, y.c_busy = "yielding", False, True
                return 7 if x.fresh_c_comply else -1
        else:
            self.state = "S0"
            y.E_motion, y.E_brake, y.c_busy = "held", True, False
            return -1
        if row in (2, 5):
            self.state = "S2"
            y.E_motion, y.E_brake, y.c_busy = "yielding", False, True
        else:
            self.state = "S1"
            y.E_motion, y.E_brake, y.c_busy = "moving", False, True
        return row


class ArmMethod:
    Inputs = ArmInputs

    def __init__(self) -> None:
        self.x, self.y, self.memory, self.state = ArmInputs(), ArmOutputs(), NoMemory(), ""
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        y = self.y
        self.state, self._work = "S0", self._in_s0
        y.E_motion, y.E_brake, y.c_busy = "held", True, False
        return -1

    def _in_s0(self) -> int:
        x, y = self.x, self.y
        if x.fresh_c_goal:
            self.state, self._work = "S1", self._in_s1
            y.E_motion, y.E_brake, y.c_busy = "moving", False, True
            return 1
        if x.fresh_c_comply:
            self.state, self._work = "S2", self._in_s2
            y.E_motion, y.E_brake, y.c_busy = "yielding", False, True
            return 2
        y.E_motion, y.E_brake, y.c_busy = "held", True, False
        return 0

    def _in_s1(self) -> int:
        x, y = self.x, self.y
        if not (x.E_arrived or x.fresh_c_comply):
            y.E_motion, y.E_brake, y.c_busy = "moving", False, True
            return -1
        if x.fresh_c_goal:
            y.E_motion, y.E_brake, y.c_busy = "moving", False, True
            return 4
        if x.fresh_c_comply:
            self.state, self._work = "S2", self._in_s2
            y.E_motion, y.E_brake, y.c_busy = "yielding", False, True
            return 5
        self.state, self._work = "S0", self._in_s0
        y.E_motion, y.E_brake, y.c_busy = "held", True, False
        return 3

    def _in_s2(self) -> int:
        x, y = self.x, self.y
        if x.fresh_c_goal:
            self.state, self._work = "S1", self._in_s1
            y.E_motion, y.E_brake, y.c_busy = "moving", False, True
            return 6
        y.E_motion, y.E_brake, y.c_busy = "yielding", False, True
        return 7 if x.fresh_c_comply else -1


class ArmBehaviours:
    Inputs = ArmInputs

    def __init__(self) -> None:
        self.x, self.y, self.memory, self.state = ArmInputs(), ArmOutputs(), NoMemory(), ""
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        self.state, self._work = "S0", self._in_s0
        self._hold()
        return -1

    def _in_s0(self) -> int:
        x = self.x
        if x.fresh_c_goal:
            self.state, self._work = "S1", self._in_s1
            self._move()
            return 1
        if x.fresh_c_comply:
            self.state, self._work = "S2", self._in_s2
            self._yield()
            return 2
        self._hold()
        return 0

    def _in_s1(self) -> int:
        x = self.x
        if not (x.E_arrived or x.fresh_c_comply):
            self._move()
            return -1
        if x.fresh_c_goal:
            self._move()
            return 4
        if x.fresh_c_comply:
            self.state, self._work = "S2", self._in_s2
            self._yield()
            return 5
        self.state, self._work = "S0", self._in_s0
        self._hold()
        return 3

    def _in_s2(self) -> int:
        x = self.x
        if x.fresh_c_goal:
            self.state, self._work = "S1", self._in_s1
            self._move()
            return 6
        self._yield()
        return 7 if x.fresh_c_comply else -1

    def _hold(self) -> None:
        y = self.y
        y.E_motion, y.E_brake, y.c_busy = "held", True, False

    def _move(self) -> None:
        y = self.y
        y.E_motion, y.E_brake, y.c_busy = "moving", False, True

    def _yield(self) -> None:
        y = self.y
        y.E_motion, y.E_brake, y.c_busy = "yielding", False, True


class ControlIf:
    Inputs = ControlInputs

    def __init__(self) -> None:
        self.x, self.y, self.memory, self.state = ControlInputs(), ControlOutputs(), NoMemory(), ""

    def step(self) -> int:  # noqa: C901, PLR0911, PLR0912  # the style that is measured here
        x, y, state = self.x, self.y, self.state
        if state == "S1":
            if not x.arm_busy:
                self.state = "S2"
                return 0
            y.arm_goal = 0
            return -1
        if state == "S2":
            if x.eye_seen:
                self.state = "S3"
                return 1
            return -1
        if state == "S3":
            self.state = "S4"
            y.arm_goal = 2
            return 2
        if state == "S4":
            if not x.arm_busy:
                self.state = "S5"
                return 3
            y.arm_goal = 2
            return -1
        if state == "S5":
            if x.eye_opened:
                self.state = "S6"
                y.arm_comply = True
                return 4
            return -1
        if state == "S6":
            if x.eye_lost:
                self.state = "S1"
                y.arm_goal = 0
                return 6
            y.arm_comply = True
            if not x.arm_busy or x.eye_contact:
                self.state = "S7"
                return 5
            return -1
        if state == "S7":
            if x.eye_lost:
                self.state = "S1"
                y.arm_goal = 0
                return 8
            if x.eye_closed:
                self.state = "S8"
                y.arm_goal = 2
                return 7
            y.arm_comply = True
            return -1
        if state == "S8":
            if x.eye_lost:
                self.state = "S1"
                y.arm_goal = 0
                return 10
            if not x.arm_busy:
                self.state = "S9"
                y.arm_goal = 1
                return 9
            y.arm_goal = 2
            return -1
        if state == "S9":
            if x.eye_opened:
                self.state = "S1"
                y.arm_goal = 0
                return 11
            y.arm_goal = 1
            return -1
        self.state = "S1"
        y.arm_goal = 0
        return -1


class ControlMethod:
    Inputs = ControlInputs

    def __init__(self) -> None:
        self.x, self.y, self.memory, self.state = ControlInputs(), ControlOutputs(), NoMemory(), ""
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        self.state, self._work = "S1", self._in_s1
        self.y.arm_goal = 0
        return -1

    def _in_s1(self) -> int:
        if not self.x.arm_busy:
            self.state, self._work = "S2", self._in_s2
            return 0
        self.y.arm_goal = 0
        return -1

    def _in_s2(self) -> int:
        if self.x.eye_seen:
            self.state, self._work = "S3", self._in_s3
            return 1
        return -1

    def _in_s3(self) -> int:
        self.state, self._work = "S4", self._in_s4
        self.y.arm_goal = 2
        return 2

    def _in_s4(self) -> int:
        if not self.x.arm_busy:
            self.state, self._work = "S5", self._in_s5
            return 3
        self.y.arm_goal = 2
        return -1

    def _in_s5(self) -> int:
        if self.x.eye_opened:
            self.state, self._work = "S6", self._in_s6
            self.y.arm_comply = True
            return 4
        return -1

    def _in_s6(self) -> int:
        x = self.x
        if x.eye_lost:
            self.state, self._work = "S1", self._in_s1
            self.y.arm_goal = 0
            return 6
        self.y.arm_comply = True
        if not x.arm_busy or x.eye_contact:
            self.state, self._work = "S7", self._in_s7
            return 5
        return -1

    def _in_s7(self) -> int:
        x = self.x
        if x.eye_lost:
            self.state, self._work = "S1", self._in_s1
            self.y.arm_goal = 0
            return 8
        if x.eye_closed:
            self.state, self._work = "S8", self._in_s8
            self.y.arm_goal = 2
            return 7
        self.y.arm_comply = True
        return -1

    def _in_s8(self) -> int:
        x = self.x
        if x.eye_lost:
            self.state, self._work = "S1", self._in_s1
            self.y.arm_goal = 0
            return 10
        if not x.arm_busy:
            self.state, self._work = "S9", self._in_s9
            self.y.arm_goal = 1
            return 9
        self.y.arm_goal = 2
        return -1

    def _in_s9(self) -> int:
        if self.x.eye_opened:
            self.state, self._work = "S1", self._in_s1
            self.y.arm_goal = 0
            return 11
        self.y.arm_goal = 1
        return -1


class ControlBehaviours:
    Inputs = ControlInputs

    def __init__(self) -> None:
        self.x, self.y, self.memory, self.state = ControlInputs(), ControlOutputs(), NoMemory(), ""
        self._work: Callable[[], int] = self._start

    def step(self) -> int:
        return self._work()

    def _start(self) -> int:
        self.state, self._work = "S1", self._in_s1
        self._to_start()
        return -1

    def _in_s1(self) -> int:
        if not self.x.arm_busy:
            self.state, self._work = "S2", self._in_s2
            return 0
        self._to_start()
        return -1

    def _in_s2(self) -> int:
        if self.x.eye_seen:
            self.state, self._work = "S3", self._in_s3
            return 1
        return -1

    def _in_s3(self) -> int:
        self.state, self._work = "S4", self._in_s4
        self._above()
        return 2

    def _in_s4(self) -> int:
        if not self.x.arm_busy:
            self.state, self._work = "S5", self._in_s5
            return 3
        self._above()
        return -1

    def _in_s5(self) -> int:
        if self.x.eye_opened:
            self.state, self._work = "S6", self._in_s6
            self._approach()
            return 4
        return -1

    def _in_s6(self) -> int:
        x = self.x
        if x.eye_lost:
            self.state, self._work = "S1", self._in_s1
            self._to_start()
            return 6
        if not x.arm_busy or x.eye_contact:
            self.state, self._work = "S7", self._in_s7
            self._approach()
            return 5
        self._approach()
        return -1

    def _in_s7(self) -> int:
        x = self.x
        if x.eye_lost:
            self.state, self._work = "S1", self._in_s1
            self._to_start()
            return 8
        if x.eye_closed:
            self.state, self._work = "S8", self._in_s8
            self._above()
            return 7
        self._approach()
        return -1

    def _in_s8(self) -> int:
        x = self.x
        if x.eye_lost:
            self.state, self._work = "S1", self._in_s1
            self._to_start()
            return 10
        if not x.arm_busy:
            self.state, self._work = "S9", self._in_s9
            self._drop()
            return 9
        self._above()
        return -1

    def _in_s9(self) -> int:
        if self.x.eye_opened:
            self.state, self._work = "S1", self._in_s1
            self._to_start()
            return 11
        self._drop()
        return -1

    def _to_start(self) -> None:
        self.y.arm_goal = 0

    def _above(self) -> None:
        self.y.arm_goal = 2

    def _approach(self) -> None:
        self.y.arm_comply = True

    def _drop(self) -> None:
        self.y.arm_goal = 1
