"""Findings about a specification: their value, their codes and the ways to print them."""

from specc.diagnostics.diagnostic import (
    CommandName,
    Diagnostic,
    Edit,
    Faults,
    Fix,
    Related,
    TooManyFaultsError,
    first_at_each_place,
    once,
    severity_of,
    stops,
    without_follow_ups,
)
from specc.diagnostics.nearest import is_slip, nearest, surely_meant
from specc.diagnostics.renaming import renaming

__all__ = [
    "CommandName",
    "Diagnostic",
    "Edit",
    "Faults",
    "Fix",
    "Related",
    "TooManyFaultsError",
    "first_at_each_place",
    "is_slip",
    "nearest",
    "once",
    "renaming",
    "severity_of",
    "stops",
    "surely_meant",
    "without_follow_ups",
]
