"""A pick from known poses by a plain script, to try the plant without agents."""

import numpy as np
from specc_runtime.cells.irp6_picking import PickJudge, devices
from specc_runtime.operators import dynamics, gripper, kinematics, motors
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.worlds import PICKING

ARM = tuple(f"q{i}" for i in range(1, 7))
MOTORS = tuple(f"q{i}_motor" for i in range(1, 7))
FINGERS = ("finger_l", "finger_r")
TICK_S = 0.002

SENSORS = (
    SensorBinding("q", joints=ARM),
    SensorBinding("m", joints=ARM, through=devices.motor_positions),
    SensorBinding("F", sensors=("wrist_force", "wrist_torque"), through=devices.wrist_wrench),
    SensorBinding("d", joints=FINGERS, through=devices.finger_distance),
    SensorBinding("g", joints=FINGERS, through=devices.gripper_motor_position),
    SensorBinding("i_g", actuators=("gripper_motor",), through=devices.gripper_current),
)
ACTUATORS = (
    ActuatorBinding("c", MOTORS, ARM, through=devices.drive_torques),
    ActuatorBinding("c_g", ("gripper_motor",), through=devices.gripper_force),
)


class Script:
    """Moves a plant tick by tick; keeps the regulators' states."""

    def __init__(self, plant: MujocoPlant, judge: PickJudge) -> None:
        self.plant, self.judge = plant, judge
        self.arm = dynamics.load_arm(PICKING)
        self.arm_state = motors.initial_regulator_state()
        self.gripper_state = gripper.initial_gripper_regulator_state()
        self.q = plant.sample("q")
        self.wanted_d = float(plant.sample("d"))

    def tick(self, q_desired: np.ndarray, d_desired: float) -> None:
        plant = self.plant
        holding = dynamics.gravity_feedforward(plant.sample("q"), self.arm)
        error = motors.joint_to_motor(q_desired) - plant.sample("m")
        arm = motors.motor_regulator(error, self.arm_state, holding)
        hand = gripper.gripper_regulator(
            gripper.distance_to_motor(d_desired) - plant.sample("g"), self.gripper_state
        )
        self.arm_state, self.gripper_state = arm.state, hand.state
        self.q, self.wanted_d = q_desired, d_desired
        plant.actuate("c", arm.c_d)
        plant.actuate("c_g", hand.c_d)
        plant.advance(TICK_S)
        self.judge.observe()

    def move(self, X_BE: np.ndarray, duration_s: float) -> None:
        """Joint motion to a pose with a smooth profile."""
        start, goal = self.q, kinematics.inverse_kinematics(X_BE, self.q)
        for k in range(round(duration_s / TICK_S)):
            s = (k + 1) * TICK_S / duration_s
            self.tick(start + (goal - start) * (10 * s**3 - 15 * s**4 + 6 * s**5), self.wanted_d)

    def fingers(self, d_goal: float, until_A: float = 1.0) -> None:
        start, elapsed = self.wanted_d, 0.0
        duration = gripper.gripper_interpolation_duration(start, d_goal)
        while elapsed < duration and self.plant.sample("i_g") < until_A:
            elapsed += TICK_S
            self.tick(self.q, gripper.gripper_interpolation(start, d_goal, elapsed))

    def descend(self, X_BE: np.ndarray, speed_m_s: float, until_N: float) -> None:
        """Straight down along the tool until the wrist feels a push against it."""
        X, free = X_BE.copy(), self.plant.sample("F")[2]
        while free - self.plant.sample("F")[2] < until_N:
            X[:3, 3] += speed_m_s * TICK_S * X[:3, 2]
            self.tick(kinematics.inverse_kinematics(X, self.q), self.wanted_d)


def above(X_BO: np.ndarray, size: np.ndarray, height_m: float) -> np.ndarray:
    """Pose X_BE that looks down on a lying box, fingers across its shorter side."""
    up = int(np.argmax(np.abs(X_BO[2, :3])))
    across = min((axis for axis in range(3) if axis != up), key=lambda axis: size[axis])
    y = X_BO[:3, across] * np.sign(X_BO[:3, across] @ X_BO[:3, 3])
    z = np.array((0.0, 0.0, -1.0))
    X = np.eye(4)
    X[:3, :3] = np.column_stack((np.cross(y, z), y, z))
    X[:3, 3] = X_BO[:3, 3] + (0.0, 0.0, size[up] / 2 + height_m)
    return X


def pick(plant: MujocoPlant, judge: PickJudge, name: str) -> dict[str, object]:
    """Open, go over the object, descend to touch, grip, lift by 0.2 m; returns the report."""
    script = Script(plant, judge)
    X_BO, size = plant.truth.body_pose(name), plant.truth.box_size(name)
    judge.recognised(name, X_BO)
    script.fingers(0.09)
    start = above(X_BO, size, -0.03)
    lifted = above(X_BO, size, 0.17)
    script.move(lifted, 3.0)
    script.move(start, 2.0)
    script.descend(start, 0.01, until_N=2.0)
    script.fingers(0.053, until_A=0.1)
    script.move(lifted, 3.0)
    return judge.end_cycle()
