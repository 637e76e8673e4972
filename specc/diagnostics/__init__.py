"""Findings about a specification: their value, their codes and the ways to print them."""

from specc.diagnostics.diagnostic import (
    CommandName,
    Diagnostic,
    Edit,
    Faults,
    Fix,
    Related,
    TooManyFaultsError,
    blocks,
    first_at_each_place,
    merge_duplicates,
    severity_of,
    without_follow_ups,
)
from specc.diagnostics.nearest import is_typo, nearest, sole_correction
from specc.diagnostics.renaming import rename_fix

__all__ = [
    "CommandName",
    "Diagnostic",
    "Edit",
    "Faults",
    "Fix",
    "Related",
    "TooManyFaultsError",
    "blocks",
    "first_at_each_place",
    "is_typo",
    "merge_duplicates",
    "nearest",
    "rename_fix",
    "severity_of",
    "sole_correction",
    "without_follow_ups",
]
