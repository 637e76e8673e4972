"""Periods as the language writes them."""

from __future__ import annotations

from fractions import Fraction


def rate(period: Fraction) -> str:
    """A period as the language writes it: whole hertz where it is a whole number of them."""
    frequency = 1 / period
    if frequency.denominator == 1:
        return f"{frequency.numerator} Hz"
    return f"{float(period * 1000):.12g} ms"
