"""All classes of faults, and what is known of other tools about them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bench.seeding import (
    device_faults,
    flow_faults,
    form_faults,
    machine_faults,
    many_faults,
    meaning_faults,
    name_faults,
    plant_faults,
    requirement_faults,
    structure_faults,
    text_faults,
    type_faults,
)

GROUPS = {
    "Text and keys": text_faults.FAULTS,
    "Names": name_faults.FAULTS,
    "Types, units, frames": type_faults.FAULTS,
    "Numbers and expressions": meaning_faults.FAULTS,
    "Structure": structure_faults.FAULTS,
    "Machines": machine_faults.FAULTS,
    "What flows": flow_faults.FAULTS,
    "Forms of version 1.1": form_faults.FAULTS,
    "Many of a kind, and events": many_faults.FAULTS,
    "Requirements": requirement_faults.FAULTS,
    "Plant and task": plant_faults.FAULTS,
    "Samples and safe outputs": device_faults.FAULTS,
}
FAULTS = tuple(fault for group in GROUPS.values() for fault in group)

MEASURED: dict[str, Any] = json.loads(
    Path(__file__).with_name("rivals.json").read_text(encoding="utf-8")
)
"""What `bench/rivals.py --write` measured: `tools`, their `versions`, and cells by fault."""
