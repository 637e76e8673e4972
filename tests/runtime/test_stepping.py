"""One generated subsystem by itself, fed and stepped by hand."""

from __future__ import annotations

import pytest
from conveyor_gate.belt_c import BeltC
from specc_runtime.stepping import Stepper


def stepper() -> Stepper:
    """A belt after its first period."""
    found = Stepper(BeltC({}))
    assert found.step() == -1
    return found


def test_what_arrives_is_fresh_for_one_period() -> None:
    belt = stepper()
    belt.feed({"gate_go": 1.0}, {}, ())
    assert (belt.step(), belt.subsystem.state) == (0, "running")
    belt.feed({}, {"gate_hold": 0.5}, ())
    assert (belt.step(), belt.subsystem.state) == (-1, "running")
    assert (belt.subsystem.x.gate_go, belt.subsystem.x.gate_hold) == (1.0, 0.5)


def test_what_is_absent_has_no_value() -> None:
    belt = stepper()
    belt.feed({"gate_hold": 0.5}, {}, ())
    assert belt.step() == 1
    belt.feed({}, {}, ("gate_hold",))
    with pytest.raises(AttributeError, match="gate_hold"):
        belt.step()


def test_a_state_and_its_time_are_put_in_place() -> None:
    belt = stepper()
    belt.place("holding", "_in_holding")
    belt.feed({}, {"gate_hold": 0.5}, ())
    belt.lasted(10)  # of 0.05 s: not longer than it holds
    assert belt.step() == -1
    assert (belt.step(), belt.subsystem.state) == (4, "alarm")


def test_violations_are_those_of_the_last_period() -> None:
    belt = stepper()
    belt.feed({"gate_go": 1.0, "gate_hold": 0.5}, {}, ())
    belt.step()
    assert belt.subsystem.violations == (0,)
    belt.feed({}, {}, ())
    belt.step()
    assert belt.subsystem.violations == ()
