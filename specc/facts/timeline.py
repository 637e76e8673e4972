"""The base tick: the longest time of which all periods are whole multiples."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from math import gcd, lcm


def base_tick(periods: Iterable[Fraction]) -> Fraction:
    """Greatest common divisor of periods in seconds; at least one is needed."""
    listed = list(periods)
    return Fraction(gcd(*(p.numerator for p in listed)), lcm(*(p.denominator for p in listed)))


def hyperperiod(periods: Iterable[Fraction]) -> Fraction:
    """Seconds after which the timeline repeats."""
    listed = list(periods)
    return Fraction(lcm(*(p.numerator for p in listed)), gcd(*(p.denominator for p in listed)))
