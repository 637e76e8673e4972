"""Pictures of specifications in the documentation, and the DOT texts that they were made from.

`python -m tests.docs.pictures` renews both.
"""

from __future__ import annotations

from pathlib import Path

from specc.pipeline import read_spec
from specc.tools.graph import PictureKind, picture
from specc.tools.graph.dot import as_dot
from specc.tools.graph.drawing import render

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs/pictures/graph"
PICTURES: dict[str, tuple[str, str, PictureKind]] = {
    "picking_structure": ("irp_picking", "", "structure"),
    "manipulator_states": ("irp_picking", "irp.m", "states"),
    "manipulator_inside": ("irp_picking", "irp.m", "inside"),
    "picking_frames": ("irp_picking", "", "frames"),
    "recognition_flow": ("irp_picking", "irp.k.recognition", "flow"),
    "conveyor_structure": ("conveyor_gate", "", "structure"),
    "gate_states": ("conveyor_gate", "gate.c", "states"),
    "services_structure": ("architectures/services", "", "structure"),
    "recovering_states": ("architectures/recovering_picking", "irp.c", "states"),
    "three_tier_structure": ("architectures/three_tier", "", "structure"),
}
"""Name of the file -> specification, place and kind."""


def dot(name: str) -> str:
    """The DOT text of a picture."""
    spec, place, kind = PICTURES[name]
    system = read_spec(str(ROOT / "specs" / f"{spec}.yaml")).system
    assert system is not None
    return as_dot(picture(system, place, kind)[1])


def renew() -> None:
    """Write all files anew."""
    for name in PICTURES:
        text = dot(name)
        (FOLDER / f"{name}.dot").write_text(text, encoding="utf-8")
        (FOLDER / f"{name}.svg").write_bytes(render(text, "svg"))


if __name__ == "__main__":
    renew()
