"""What names of signals stand for, and the numbers that are drawn of values."""

from __future__ import annotations

import math
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.lang.values import pose
from specc.model.system import Subsystem, System
from specc.pipeline import read_spec
from specc.tools.plot import NoSignal, Signal, resolve_signal
from specc.tools.plot.signals import rotation_vector, unwrap_rotations
from specc.tools.why import NotKnown
from tests.commands import ROOT

ANGLES = st.floats(-10, 10).filter(lambda a: abs(a % math.tau - math.pi) > 1e-3)
AXES = st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8), (-0.48, 0.6, 0.64)])


@cache
def _system(name: str = "irp_picking") -> System:
    system = read_spec(str(ROOT / "specs" / f"{name}.yaml")).system
    assert system is not None
    return system


def _signal(name: str, spec: str = "irp_picking") -> Signal:
    signal = resolve_signal(_system(spec), name)
    assert isinstance(signal, Signal)
    return signal


def _shape(name: str) -> list[tuple[str, str]]:
    return [(part.name, part.unit) for part in _signal(name).components]


def test_names_are_those_of_requirements() -> None:
    subsystem = resolve_signal(_system(), "irp.m")
    assert isinstance(subsystem, Subsystem) and subsystem.qualified_name == "irp.m"
    signal = _signal("irp.m.x.E.m_m")
    assert signal.owner == "irp.m" and signal.path == ("x", "E", "m_m")
    assert signal.title == "measured motor positions"
    assert _signal("irp.m.m_d").path == ("memory", "m_d")
    assert _signal("plant.load", "architectures/syndicate").path == ("y", "load")


def test_lines_by_type() -> None:
    metres = [(name, "m") for name in ("x", "y", "z")]
    turned = [(name, "rad") for name in ("rx", "ry", "rz")]
    assert _shape("irp.m.x.c.T_d") == metres + turned
    assert _shape("irp.m.x.E.m_m") == [(f"[{i}]", "rad") for i in range(6)]
    assert _shape("irp.m.x.E.m_m[2]") == [("", "rad")]
    forces = [(name, "N") for name in ("x", "y", "z")]
    assert _shape("irp.m.x.E.F_m") == forces + [(n, "N*m") for n in ("ax", "ay", "az")]
    assert _shape("irp.m.x.E.F_m.z") == [("", "N")]
    assert _signal("irp.m.x.c.b").components[0].words == ("u", "c", "g", "s")


def test_numbers_of_values() -> None:
    assert _signal("irp.m.x.E.m_m[2]").numbers([1.0, 2, 3.0, 4.0, 5.0, 6.0]) == (3.0,)
    assert _signal("irp.m.x.E.F_m.az").numbers([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) == (6.0,)
    assert _signal("irp.m.x.c.b[1]").numbers(["u", "g", "u", "u", "u", "u"]) == (2.0,)
    here = [1, 0, 0, 0.1, 0, 1, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1]
    assert _signal("irp.m.x.c.T_d").numbers(here) == (0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    for wrong in ([1.0], "u", None, {"a": 1}, [True] * 6):
        with pytest.raises(NotKnown):
            _signal("irp.m.x.E.m_m").numbers(wrong)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("irp.n", "there is no signal irp.n; did you mean "),
        ("abc", "there is no signal abc; there are irp.c, "),
        ("irp.m.x.c.T_s", "irp.m has no x.c.T_s; did you mean irp.m.x.c.T_d"),
        ("irp.m.x.c", "irp.m has no x.c; "),
        ("irp.E.m.x.c_d", "irp.E.m is a device; recordings have the buffers of its subsystem; did"),
        ("irp.m.T_c", "irp.m.T_c is a let, and recordings have none"),
        ("irp.m.x.E.m_m[6]", "has no [6]; it has [0], [1], "),
        ("irp.m.x.E.m_m.x", "irp.m.x.E.m_m of type vector[6, rad] has no .x; it has [0], "),
        ("irp.m.x.E.m_m[", "is no signal: [ is neither .field nor [item]"),
        ("irp.m.x.E.m_m[-1]", "is neither .field nor [item]"),
        ("irp.k.x.R.I_rgb", "is nothing that can be drawn as a line"),
    ],
)
def test_what_is_no_signal(name: str, words: str) -> None:
    with pytest.raises(NoSignal) as told:
        resolve_signal(_system(), name)
    assert words in str(told.value)


@given(AXES, ANGLES)
def test_rotations(axis: tuple[float, ...], angle: float) -> None:
    """The vector is along the axis, and as long as the angle of at most half a turn."""
    half = angle / 2
    rows = pose((0.0, 0.0, 0.0), (*(a * math.sin(half) for a in axis), math.cos(half)))
    turn = math.remainder(angle, math.tau)
    assert rotation_vector(rows) == pytest.approx([a * turn for a in axis], abs=1e-6)


def test_half_a_turn() -> None:
    for axis in ((0.0, 1.0, 0.0), (0.6, 0.0, 0.8)):
        vector = rotation_vector(pose((0.0, 0.0, 0.0), (*axis, 0.0)))
        assert [abs(v) for v in vector] == pytest.approx([math.pi * abs(a) for a in axis])


def test_what_goes_on_turning_does_not_jump() -> None:
    gone = [0.1 * i for i in range(100)]
    wound = [(0.0, math.remainder(angle, math.tau), 0.0) for angle in gone]
    assert [v[1] for v in unwrap_rotations(wound)] == pytest.approx(gone, abs=1e-9)
    assert unwrap_rotations([(0.0, -3.1, 0.0)])[0][1] == pytest.approx(math.tau - 3.1)
    nothing = (math.nan,) * 3
    assert [v[0] for v in unwrap_rotations([(3.0, 0.0, 0.0), nothing, (-3.1, 0.0, 0.0)])][2] > 3
