"""Plots of recorded runs: signals with their units over time, and the states of machines."""

from specc.tools.plot.signals import NoSignal, Signal, resolve_signal

__all__ = ["NoSignal", "Signal", "resolve_signal"]
