"""Position-force control in the frame of the end-effector: GE, PF and AA (paper, 4.5)."""

from math import cos, sin, sqrt

from specc_runtime.operators.arrays import Array, transform, vector
from specc_runtime.operators.irp6 import SENSOR_HEIGHT, TOOL

_SENSOR_Z = SENSOR_HEIGHT - TOOL  # of the origin of S in E, m
_SMALL_ANGLE = 1e-4  # rad, below which the series of Rodrigues' coefficients is exact to rounding
_COMPONENTS = ("x", "y", "z", "ax", "ay", "az")


def eliminate_gravity(F_m: Array, X_BE: Array, tool_weight_N: float, p_S_com: Array) -> Array:
    """GE: wrench F_c (6,) that the robot exerts on its environment (paper, eq. 25).

    F_m is exerted *on* the hand, by its weight and by the environment; without the weight and with
    its sign turned it is what the hand exerts. S is turned by -90 degrees about the tool axis, so
    that a vector (x, y, z) of S is (y, -x, z) in E.

    Args:
        F_m: (6,) N and Nm, in the axes and at the origin of the sensor's frame S.
        X_BE: (4, 4) pose of E in B; the z axis of B points up.
        tool_weight_N: of all that hangs from the sensor.
        p_S_com: (3,) m, its centre of mass in S.

    Returns:
        (6,) N and Nm, in the axes and at the origin of E.
    """
    f_x, f_y, f_z, t_x, t_y, t_z = F_m.tolist()
    r_x, r_y, r_z, _ = X_BE[2].tolist()
    com_x, com_y, com_z = p_S_com.tolist()
    com_x, com_y, com_z = com_y, -com_x, com_z + _SENSOR_Z
    f_x, f_y, t_x, t_y = f_y, -f_x, t_y, -t_x
    g_x, g_y, g_z = -tool_weight_N * r_x, -tool_weight_N * r_y, -tool_weight_N * r_z
    return vector(
        g_x - f_x,
        g_y - f_y,
        g_z - f_z,
        com_y * g_z - com_z * g_y - (t_x - _SENSOR_Z * f_y),
        com_z * g_x - com_x * g_z - (t_y + _SENSOR_Z * f_x),
        com_x * g_y - com_y * g_x - t_z,
    )


def position_force(
    F_d: Array,
    V_d: Array,
    D_d: Array,
    I_d: Array,
    b: tuple[str, ...],
    rdot_p: Array,
    F_c: Array,
    period_s: float,
) -> Array:
    """PF: desired velocity of E from six independent regulators (paper, eq. 26, Tables 5 and 6).

    The mode replaces parameters (Table 6): c (contact) has V = 0, g (guarded) F = 0, u
    (unguarded) D = inf and I = 0, which leaves the desired velocity; s (stop) rests. What a mode
    does not use is not looked at and may be NaN. In steady contact a guarded motion presses with
    V D.

    Args:
        F_d, F_c: (6,) N and Nm, desired and current wrench exerted by the robot, axes of E.
        V_d, rdot_p: (6,) m/s and rad/s, desired and previous commanded velocity of E, axes of E.
        D_d: (6,) kg/s and kg m2/s, damping, > 0.
        I_d: (6,) kg and kg m2, inertia, >= 0.
        b: six modes.
        period_s: time between calls.

    Returns:
        (6,) m/s and rad/s, in the axes of E.

    Raises:
        ValueError: unknown mode, or a parameter that the mode uses is missing or out of range.
    """
    velocity: list[float] = []
    parameters = zip(
        b,
        F_d.tolist(),
        V_d.tolist(),
        D_d.tolist(),
        I_d.tolist(),
        rdot_p.tolist(),
        F_c.tolist(),
        strict=True,
    )
    for mode, force, speed, damping, inertia, previous, current in parameters:
        if mode == "u":
            v = speed
        elif mode == "s":
            v = 0.0
        elif mode in ("c", "g") and damping > 0.0 and inertia >= 0.0:
            drive = (force - current) / damping if mode == "c" else speed - current / damping
            lag = inertia / damping
            v = (drive * period_s + lag * previous) / (period_s + lag)
        else:
            v = float("nan")
        if v != v:  # NaN
            raise ValueError(_complaint(len(velocity), mode, damping, inertia))
        velocity.append(v)
    return vector(*velocity)


def angle_axis_to_pose(r: Array) -> Array:
    """AA: homogeneous matrix (4, 4) of a displacement (paper, eq. 27).

    Args:
        r: (6,) translation in m and rotation vector (axis times angle) in rad, both in the axes
            of the frame that is displaced.
    """
    x, y, z, a, b, c = r.tolist()
    square = a * a + b * b + c * c
    if square < _SMALL_ANGLE * _SMALL_ANGLE:
        s, k = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        angle = sqrt(square)
        s, k = sin(angle) / angle, (1.0 - cos(angle)) / square
    ab, ac, bc = k * a * b, k * a * c, k * b * c
    return transform(
        *(1.0 - k * (b * b + c * c), ab - s * c, ac + s * b, x),
        *(ab + s * c, 1.0 - k * (a * a + c * c), bc - s * a, y),
        *(ac - s * b, bc + s * a, 1.0 - k * (a * a + b * b), z),
    )


def _complaint(component: int, mode: str, damping: float, inertia: float) -> str:
    where = f"motion component {_COMPONENTS[component]}"
    if mode not in ("u", "c", "g", "s"):
        return f"{where}: unknown mode {mode!r}"
    if mode == "u":
        return f"{where}: mode u needs a velocity"
    if damping > 0.0 and inertia >= 0.0:
        return f"{where}: mode {mode} needs forces and velocities that are numbers"
    return f"{where}: mode {mode} needs damping > 0 and inertia >= 0, not {damping} and {inertia}"
