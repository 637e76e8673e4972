"""A verb of disturbances takes a row of the compiler and one of the runtime."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.house.scratch import copied, in_copy
from tests.runtime.test_disturbances import MODEL, SPEC

ROWS = {
    "specc/model/task.py": (
        '    Verb("silent", "silenced"',
        '    Verb("drop", "dropped", "distance", "one", "Joints, and how far they fall.",'
        ' has_duration=False, neutral=(0, "from nowhere", "say from where"),'
        ' spoiled_by=("block",)),\n'
        '    Verb("flip", "flipped", "measurement", "none", "Elements of the other sign."),\n',
    ),
    "runtime/specc_runtime/disturbances.py": (
        '    "silent": Verb(',
        '    "drop": Verb(once=lambda plant, by: plant.shift({of: -by[of] for of in by})),\n'
        '    "flip": Verb(lasts=_distort, on_plant=False),\n',
    ),
}
"""Files, where the row stands, and the row."""
DROP = '  disturb: [{at: "1[s]", drop: {cart: "3[m]"}, because: of the test}]\n'
IDLE = '  disturb: [{at: "1[s]", drop: {cart: "0[m]"}, because: of the test}]\n'
FLIP = '  disturb: [{at: "1[s]", flip: [cart.E.wheels.s], because: of the test}]\n'
FAR = "require: [{that: 'within(1.1[s], plant.s < -1.9[m])', because: of the test}]\n"


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scratch = copied(tmp_path_factory.mktemp("copy"), "specc", "runtime", "templates")
    for name, (before, row) in ROWS.items():
        text = (scratch / name).read_text("utf-8")
        assert before in text
        (scratch / name).write_text(text.replace(before, row + before), "utf-8")
    (scratch / "cart.xml").write_text(MODEL, "utf-8")
    (scratch / "drop.yaml").write_text(f"{SPEC}{DROP}{FAR}", "utf-8")
    (scratch / "idle.yaml").write_text(f"{SPEC}{IDLE}", "utf-8")
    (scratch / "flip.yaml").write_text(f"{SPEC}{FLIP}", "utf-8")
    return scratch


@pytest.mark.long
def test_two_rows_are_all_there_is_to_write(copy: Path) -> None:
    ran = in_copy(copy, "specc", "run", "drop.yaml", "--duration", "2")
    assert ran.returncode == 0, ran.stderr
    checked = in_copy(copy, "specc", "validate", "idle.yaml")
    assert "W0519]: `cart` is dropped from nowhere" in checked.stderr
    flipped = in_copy(copy, "specc", "validate", "flip.yaml")
    assert flipped.returncode == 0, flipped.stderr
    told = in_copy(copy, "specc", "diff", "drop.yaml", "idle.yaml")
    assert "drop cart" in told.stdout
