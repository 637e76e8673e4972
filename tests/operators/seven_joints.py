"""An arm with seven joints like those of a Panda, as MJCF, and its published kinematics.

Craig's parameters (a, d, alpha) of each joint and the ranges are those of the manufacturer (Franka
Control Interface documentation, "Robot and interface specifications").
"""

from __future__ import annotations

from math import pi

import numpy as np

ROWS = (
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -pi / 2),
    (0.0, 0.316, pi / 2),
    (0.0825, 0.0, pi / 2),
    (-0.0825, 0.384, -pi / 2),
    (0.0, 0.0, pi / 2),
    (0.088, 0.0, pi / 2),
)
FLANGE_M = 0.107
FINGER_M = 0.02
LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
HOME = np.array([0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4])
MASSES = (4.97, 0.65, 3.23, 3.59, 1.23, 1.67, 0.74)


def model(drives: str = "", more: str = "", *, weightless: bool = False, free: bool = False) -> str:
    """MJCF with joints q1 to q7 from body `base` to site `flange`, and a finger there.

    Args:
        drives: actuators.
        more: bodies of the world.
        free: whether these move, so that no keyframe knows their coordinates.
        weightless: whether something carries the weight of the links.
    """
    carried = 'gravcomp="1" ' if weightless else ""
    links, ends = "", ""
    for number, (a, d, alpha) in enumerate(ROWS, 1):
        links += (
            f'<body name="link{number}" {carried}pos="{a} {-np.sin(alpha) * d} {np.cos(alpha) * d}"'
            f' quat="{np.cos(alpha / 2)} {np.sin(alpha / 2)} 0 0">'
            f'<joint name="q{number}" axis="0 0 1" armature="0.1" damping="0.5"'
            f' range="{LOWER[number - 1]} {UPPER[number - 1]}"/>'
            f'<geom name="link{number}" type="capsule" fromto="0 0 -0.05 0 0 0.05" size="0.04"'
            f' mass="{MASSES[number - 1]}"/>'
        )
        ends += "</body>"
    home = " ".join(map(str, (*HOME, FINGER_M)))
    keyframe = f'<keyframe><key name="home" qpos="{home}"/></keyframe>' if not free else ""
    return f"""\
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="1"/></default>
  <worldbody>
    <body name="base" pos="0.2 -0.1 0.5" quat="0.8 0 0 0.6">
      {links}
      <site name="flange" pos="0 0 {FLANGE_M}"/>
      <body name="finger" {carried}pos="0 0 {FLANGE_M}">
        <joint name="finger" type="slide" axis="0 1 0" range="0 0.04"/>
        <geom name="finger" type="box" size="0.01 0.01 0.02" pos="0 0 0.02" mass="0.05"/>
      </body>
      {ends}
    </body>
    {more}
  </worldbody>
  {drives}
  {keyframe}
</mujoco>
"""


def links(q: np.ndarray) -> list[np.ndarray]:
    """X (4, 4) of each link in the base by the product of the parameters' transforms."""
    found, X = [], np.eye(4)
    for angle, (a, d, alpha) in zip(q, ROWS, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        X = X @ [
            [c, -s, 0, a],
            [s * ca, c * ca, -sa, -d * sa],
            [s * sa, c * sa, ca, d * ca],
            [0, 0, 0, 1],
        ]
        found.append(X)
    return found


def direct(q: np.ndarray) -> np.ndarray:
    """X_BE (4, 4) of the flange in the base."""
    X = links(q)[-1].copy()
    X[:3, 3] += X[:3, 2] * FLANGE_M
    return X
