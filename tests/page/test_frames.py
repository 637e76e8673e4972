"""Which bodies carry frames, and the poses that are drawn."""

from __future__ import annotations

import numpy as np
import pytest

from specc import pipeline
from specc.tools.page.description import AssetShelf, Description
from specc.tools.page.frames import carriers
from specc.tools.page.moments import LastStep, frames_of
from tests.house.tree import ROOT
from tests.seeds import every


@pytest.mark.parametrize(
    ("spec", "expected"),
    every(
        3,
        [
            ("examples/tray_cell", {"B": "base", "E": "tip"}),
            ("irp_picking", {}),
            ("conveyor_gate", {}),
        ],
    ),
)
def test_arms_of_the_library_say_where_their_frames_are(
    spec: str, expected: dict[str, str]
) -> None:
    system = pipeline.check_spec(str(ROOT / "specs" / f"{spec}.yaml")).system
    assert system is not None and carriers(system) == expected


def test_poses_are_numbers() -> None:
    result = pipeline.compile_spec(str(ROOT / "specs/irp_picking.yaml"))
    assert result.system is not None
    description = Description(result.system, result, AssetShelf())
    turned = (
        np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], float).ravel().tolist()
    )
    step = {"state": "S1", "x": {"m": {"T_c": turned, "F_c": [0.0] * 6}}}
    steps = {"irp.c": LastStep("irp.c", step, None, 0.0, 0.0, "")}
    found = frames_of(description, steps, None, ["irp.c.x.m.T_c", "irp.c.x.m.F_c", "nothing"])
    assert list(found) == ["irp.c.x.m.T_c"]
    np.testing.assert_allclose(found["irp.c.x.m.T_c"], (1, 2, 3, 0, 0, np.pi / 2), atol=1e-9)
    assert list(frames_of(description, steps, None, None)) == ["irp.c.x.m.T_c"]
    assert {"name": "irp.c.x.m.T_c", "base": "B", "end": "E"} in description.message["poses"]
    assert description.message["carriers"] == {}
