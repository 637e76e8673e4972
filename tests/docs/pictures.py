"""Pictures of specifications in the documentation, and the DOT texts that they were made from.

`python -m tests.docs.pictures` renews both.
"""

from __future__ import annotations

from pathlib import Path

from specc.pipeline import read_spec
from specc.tools.graph import FORMATS, Diagram, PictureKind, picture

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


def diagram(name: str) -> Diagram:
    """What a picture shows."""
    spec, place, kind = PICTURES[name]
    system = read_spec(str(ROOT / "specs" / f"{spec}.yaml")).system
    assert system is not None
    return picture(system, place, kind)[1]


def dot(name: str) -> str:
    """The DOT text of a picture."""
    return FORMATS["dot"].render(diagram(name)).decode()


def renew() -> None:
    """Write all files anew."""
    for name in PICTURES:
        for form in ("dot", "svg"):
            (FOLDER / f"{name}.{form}").write_bytes(FORMATS[form].render(diagram(name)))


if __name__ == "__main__":
    renew()
