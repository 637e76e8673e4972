"""Plots of recorded runs: signals with their units over time, and the states of machines."""

from specc.tools.plot.signals import (
    ListedSignal,
    NoSignal,
    Signal,
    list_signals,
    resolve_signal,
)

__all__ = ["ListedSignal", "NoSignal", "Signal", "list_signals", "resolve_signal"]
