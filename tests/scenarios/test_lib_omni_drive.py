"""The drive of the library for platforms that go in any direction."""

from __future__ import annotations

from math import copysign, pi
from pathlib import Path

import pytest

from specc.testing import Stepped

SPEC = """\
specc: 1.2
system: yard
frames: {W: world, P: platform}
agents:
  cart:
    real_effectors:
      drive:
        x: {v_d: "vector[2, m/s]", w_d: "real[rad/s]"}
        y: {at: "vector[2, m]", yaw: "real[rad]"}
    virtual_effectors:
      drive:
        use: specc:omni_drive
        rate: 100 Hz
        with: {v_max: "0.5[m/s]", tolerance: "1[cm]", angle_tolerance: "1[deg]", W: W, P: P}
    control:
      rate: 50 Hz
      x:
        drive: {X_WP: {type: "pose[W, P]", init: identity()}, there: {type: bool, init: False}}
      y: {drive: {to: "vector[2, m]", heading: "real[rad]"}}
      functions: {go: {y.drive.to: "[1[m], 0[m]]", y.drive.heading: 0}}
      behaviours: {go: {functions: [go], terminal: {when: x.drive.there}}}
      states: {going: go}
      initial_state: going
      transitions: [[going, terminal, always, going]]
"""


@pytest.fixture
def drive(tmp_path: Path) -> Stepped:
    (tmp_path / "yard.yaml").write_text(SPEC)
    return Stepped(tmp_path / "yard.yaml", "cart.drive")


def test_it_goes_straight_and_no_faster_than_it_may(drive: Stepped) -> None:
    to = {"x.c.to": "[3[m], -4[m]]", "x.c.heading": 0.0}
    drive.step({"x.E.at": "[0[m], 0[m]]", "x.E.yaw": 0.0, **to})
    assert drive["y.E.v_d"] == pytest.approx([0.3, -0.4])
    assert drive["y.c.there"] is False
    drive.step({"x.E.at": "[3[m], -4[m]]", "x.E.yaw": 0.01})
    assert drive["y.E.v_d"] == pytest.approx([0.0, 0.0])
    assert drive["y.c.there"] is True


@pytest.mark.parametrize("yaw", [0.4, -0.4, 1.5 * pi, -1.5 * pi, 2.0 * pi + 0.4])
def test_it_turns_the_shorter_way_round(yaw: float, drive: Stepped) -> None:
    drive.step({"x.E.at": "[0[m], 0[m]]", "x.E.yaw": yaw})
    back = -yaw if abs(yaw) < pi else copysign(2.0 * pi, yaw) - yaw
    assert drive["y.E.w_d"] == pytest.approx(max(-1.0, min(2.0 * back, 1.0)))


def test_a_heading_is_the_same_after_a_whole_turn(drive: Stepped) -> None:
    drive.step({"x.E.at": "[0[m], 0[m]]", "x.E.yaw": 2.0 * pi})
    assert drive["y.c.there"] is True
