"""The position regulator of the IRp-6 drives, for any number of axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from specc_runtime.operators.arrays import Array


@dataclass(frozen=True, slots=True)
class RegulatorGains:
    """Gains of n regulators, each (n,); see `regulate` for their places in the law."""

    counts_per_rad: Array
    integral: Array
    pole: Array
    now: Array
    before: Array
    current_per_unit: Array
    largest_integral: Array
    largest_current: Array


@dataclass(frozen=True, slots=True)
class RegulatorState:
    """What regulators remember from one period to the next, each (n,).

    error: last position error, encoder counts; integral, lagged: last two parts of the output, in
    the regulator's own unit.
    """

    error: Array
    integral: Array
    lagged: Array


@dataclass(frozen=True, slots=True)
class RegulatorOutput:
    """Desired currents c_d (n,) in A and the state to be given to the next call."""

    c_d: Array
    state: RegulatorState


def regulator_gains(
    published: Sequence[tuple[float, ...]], counts_per_turn: Sequence[float]
) -> RegulatorGains:
    """Gains from published rows (A, BB0, BB1, kp in mA, eps, Imax in mA), one for each axis."""
    pole, b0, b1, kp_mA, eps, limit_mA = np.array(published).T
    integral = 2.0 * eps * (b0 - b1) / (1.0 - pole)
    return RegulatorGains(
        counts_per_rad=np.array(counts_per_turn) / (2.0 * pi),
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
    zero = np.zeros(axes)
    return RegulatorState(zero, zero, zero)


def regulate(
    gains: RegulatorGains, error: Array, state: RegulatorState, feedforward: Array
) -> RegulatorOutput:
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
        error: (n,) desired minus measured motor position, rad.
        state: what the last period returned.
        feedforward: (n,) A, added before clipping.
    """
    counts = error * gains.counts_per_rad
    integral = state.integral + gains.integral * counts
    integral = np.minimum(np.maximum(integral, -gains.largest_integral), gains.largest_integral)
    lagged = gains.pole * state.lagged + gains.now * counts - gains.before * state.error
    current = gains.current_per_unit * (integral + lagged) + feedforward
    c_d = np.minimum(np.maximum(current, -gains.largest_current), gains.largest_current)
    return RegulatorOutput(c_d, RegulatorState(counts, integral, lagged))
