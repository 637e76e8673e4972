"""All classes of faults, and what is known of other tools about them."""

from __future__ import annotations

from bench.seeding import (
    flow_faults,
    machine_faults,
    name_faults,
    plant_faults,
    structure_faults,
    text_faults,
    type_faults,
)

GROUPS = {
    "Text and keys": text_faults.FAULTS,
    "Names": name_faults.FAULTS,
    "Types, units, frames": type_faults.FAULTS,
    "Structure": structure_faults.FAULTS,
    "Machines": machine_faults.FAULTS,
    "What flows": flow_faults.FAULTS,
    "Plant and task": plant_faults.FAULTS,
}
FAULTS = tuple(fault for group in GROUPS.values() for fault in group)

RIVALS = ("sismic", "python-statemachine", "transitions")
FOUND, MISSED, ONE_OF_THREE = "found", "no", "(a)"

MEASURED = {
    "wrong target of a row": (FOUND, FOUND, MISSED),
    "unreachable state": (MISSED, MISSED, MISSED),
    "trap state (no rows)": (MISSED, MISSED, MISSED),
    "overlapping conditions": (MISSED, MISSED, MISSED),
    "missing case (one of several rows)": (MISSED, MISSED, MISSED),
    "unknown condition": (MISSED, MISSED, MISSED),
    "condition of a row that can never hold": (ONE_OF_THREE, ONE_OF_THREE, MISSED),
    "misspelt key": (ONE_OF_THREE, ONE_OF_THREE, MISSED),
    "type error in a condition": (ONE_OF_THREE, ONE_OF_THREE, MISSED),
}
"""What loading one such fault gave with each of the rivals: nine faults, of which `RIVALS` found
2, 2 and 0. Of the last three only the sum was noted down."""
