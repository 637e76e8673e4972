"""The position regulator of the IRp-6 drives, for any number of axes.

For as few axes as a robot has, numpy takes three times as long as Python's own floats.
"""

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

from specc_runtime.operators.arrays import Array


class RegulatorGains(NamedTuple):
    """Gains of the regulator of one axis; see `regulate` for their places in the law."""

    counts_per_rad: float
    integral: float
    pole: float
    now: float
    before: float
    current_per_unit: float
    largest_integral: float
    largest_current: float


class RegulatorState(NamedTuple):
    """What regulators remember from one period to the next, one number for each of n axes.

    error: last position error, encoder counts; integral, lagged: last two parts of the output, in
    the regulator's own unit.
    """

    error: tuple[float, ...]
    integral: tuple[float, ...]
    lagged: tuple[float, ...]


class RegulatorOutput(NamedTuple):
    """Desired currents c_d (n,) in A and the state to be given to the next call."""

    c_d: Array
    state: RegulatorState


def regulator_gains(published: Sequence[float], counts_per_turn: float) -> RegulatorGains:
    """Gains of an axis from a published row: A, BB0, BB1, kp in mA, eps, Imax in mA."""
    pole, b0, b1, kp_mA, eps, limit_mA = published
    integral = 2.0 * eps * (b0 - b1) / (1.0 - pole)
    return RegulatorGains(
        counts_per_rad=counts_per_turn / (2.0 * pi),
        integral=integral,
        pole=pole,
        now=(1.0 + eps) * b0 - integral,
        before=(1.0 - eps) * b1,
        current_per_unit=kp_mA / 1000.0,
        largest_integral=limit_mA / kp_mA,
        largest_current=limit_mA / 1000.0,
    )


def resting_state(axes: int) -> RegulatorState:
    """State of regulators that have had no error and given no current."""
    zero = (0.0,) * axes
    return RegulatorState(zero, zero, zero)


def regulate(
    gains: Sequence[RegulatorGains],
    error: Sequence[float],
    state: RegulatorState,
    feedforward: Sequence[float],
) -> tuple[list[float], RegulatorState]:
    """One period of the published law, a PID with one lag, resolved into its parts.

    The robot (irp6_regulator/src/IRp6Regulator.cpp) feeds increments of the position error E, in
    encoder counts, through

        (BB0 - BB1 z^-1) ((1 + eps) - (1 - eps) z^-1) / ((1 - z^-1) (1 - A z^-1)),

    multiplies by kp and clips to +-Imax. By partial fractions, and from rest, that is

        integral_k = integral_k-1 + Ki E_k,            Ki = 2 eps (BB0 - BB1) / (1 - A)
        lagged_k   = A lagged_k-1 + ((1 + eps) BB0 - Ki) E_k - (1 - eps) BB1 E_k-1
        c_d        = clip(kp (integral_k + lagged_k) + feedforward, +-Imax)

    Unlike the robot's, the integral is kept within +-Imax / kp: fingers that hold an object would
    otherwise wind it up for as long as they hold, and let go as much later.

    Args:
        gains: of n axes.
        error: n, desired minus measured motor positions, rad.
        state: what the last period returned.
        feedforward: n, A, added before clipping.

    Returns:
        n currents c_d in A and the state to be given to the next call.
    """
    currents: list[float] = []
    parts: list[tuple[float, float, float]] = []
    axes = zip(gains, error, *state, feedforward, strict=True)
    for axis, off, before, integral, lagged, feed in axes:
        counts = off * axis.counts_per_rad
        integral = clipped(integral + axis.integral * counts, axis.largest_integral)
        lagged = axis.pole * lagged + axis.now * counts - axis.before * before
        current = axis.current_per_unit * (integral + lagged) + feed
        currents.append(clipped(current, axis.largest_current))
        parts.append((counts, integral, lagged))
    return currents, RegulatorState(*zip(*parts, strict=True))


def clipped(value: float, largest: float) -> float:
    """The value, or +-largest if it is larger."""
    if value > largest:
        return largest
    return -largest if value < -largest else value
