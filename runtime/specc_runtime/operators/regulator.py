"""The position regulator of the IRp-6 drives, for any number of axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from specc_runtime.operators.arrays import Array


@dataclass(frozen=True, slots=True)
class RegulatorGains:
    """Gains of n regulators, each (n,); see `regulate` for their places in the law."""

    scale: Array
    lead: Array
    lag: Array
    pole: Array
    b0: Array
    b1: Array
    current_per_unit: Array
    largest_current: Array


@dataclass(frozen=True, slots=True)
class RegulatorState:
    """What regulators remember from one period to the next, each (n,).

    error: last position error, encoder counts; delta: last filtered error, counts; u and
    u_before: the last two outputs, in the regulator's own unit.
    """

    error: Array
    delta: Array
    u: Array
    u_before: Array


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
    return RegulatorGains(
        scale=np.array(counts_per_turn) / (2.0 * pi),
        lead=1.0 + eps,
        lag=1.0 - eps,
        pole=pole,
        b0=b0,
        b1=b1,
        current_per_unit=kp_mA / 1000.0,
        largest_current=limit_mA / 1000.0,
    )


def resting_state(axes: int) -> RegulatorState:
    """State of regulators that have had no error and given no current."""
    zero = np.zeros(axes)
    return RegulatorState(zero, zero, zero, zero)


def regulate(
    gains: RegulatorGains, error: Array, state: RegulatorState, feedforward: Array
) -> RegulatorOutput:
    """One period of the published law (irp6_regulator/src/IRp6Regulator.cpp).

    With E the position error in counts:

        delta_k = (1 + eps) E_k - (1 - eps) E_k-1
        u_k     = u_k-1 + A (u_k-1 - u_k-2) + BB0 delta_k - BB1 delta_k-1
        c_d     = clip(kp u_k + feedforward, +-Imax)

    The robot sums delta from increments, e_k = E_k - E_k-1; from rest that sum telescopes to the
    line above. Unlike the robot's, u is pulled back to what the clipped current stands for:
    fingers that hold an object would otherwise wind it up for as long as they hold.

    Args:
        gains: of n axes.
        error: (n,) desired minus measured motor position, rad.
        state: what the last period returned.
        feedforward: (n,) A, added before clipping.
    """
    counts = error * gains.scale
    delta = gains.lead * counts - gains.lag * state.error
    u = state.u + gains.pole * (state.u - state.u_before)
    u += gains.b0 * delta - gains.b1 * state.delta
    wanted = gains.current_per_unit * u + feedforward
    c_d = np.minimum(np.maximum(wanted, -gains.largest_current), gains.largest_current)
    u += (c_d - wanted) / gains.current_per_unit
    return RegulatorOutput(c_d, RegulatorState(counts, delta, u, state.u))
