"""The picture of a machine with modes: frames, and one arc for the rows of a mode."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from specc.pipeline import read_spec
from specc.tools.graph import Diagram, picture
from specc.tools.graph.diagram import Arc, Cluster
from specc.tools.graph.dot import as_dot
from specc.tools.graph.drawing import render
from tests.commands import ROOT
from tests.tools.graph.laws import every_part_is_drawn_once

SPEC = ROOT / "tests/tools/modes.yaml"
Draw = Callable[..., Diagram]


@pytest.fixture
def draw(tmp_path: Path) -> Draw:
    def drawn(old: str = "", new: str = "") -> Diagram:
        spec = tmp_path / "arm.yaml"
        text = SPEC.read_text(encoding="utf-8")
        assert old in text
        spec.write_text(text.replace(old, new, 1), encoding="utf-8")
        system = read_spec(str(spec)).system
        assert system is not None
        every_part_is_drawn_once(system)
        return picture(system, "arm.c", None)[1]

    return drawn


def frames(diagram: Diagram) -> dict[str, tuple[str, ...]]:
    """The nodes and frames directly in each frame."""
    found = {}
    open_: list[Cluster] = [*diagram.groups]
    while open_:
        group = open_.pop()
        inner = (each.id for each in (*group.nodes, *group.groups))
        found[group.id] = tuple(name for name in inner if " " not in name)
        open_ += group.groups
    return found


def leaving(diagram: Diagram, frame: str) -> list[tuple[str, Arc]]:
    """The texts and the heads of arcs from a frame."""
    texts = {node.id: node.lines for node in diagram.all_nodes}
    onward = {arc.tail: arc for arc in diagram.arcs}
    found = []
    for arc in (each for each in diagram.arcs if each.tail_frame == frame):
        lines = arc.lines or texts[arc.head]
        text = " ".join(run.text for each in lines for run in each)
        found.append((text, onward[arc.head] if arc.head.startswith("text ") else arc))
    return found


def test_modes_are_frames_inside_one_another(draw: Draw) -> None:
    assert frames(draw()) == {
        "powered": ("booting", "homing", "waiting", "paused", "working"),
        "working": ("retrying", "picking", "placing"),
        "picking": ("looking", "approaching", "grasping", "lifting"),
        "placing": ("carrying", "lowering", "releasing", "backing"),
    }


def test_the_frame_of_a_mode_has_its_error_conditions_and_states_have_their_own(draw: Draw) -> None:
    text = as_dot(draw())
    assert text.count("error tripped: x.desk.halt<") == 1
    assert text.count("error tired: elapsed(working) &gt; 60[s]<") == 1
    assert text.count("error missed: x.desk.load == 25<") == 1
    assert text.count("error: slow<") == 10


def test_a_behaviour_that_stands_in_its_state_is_not_named_beside_it(draw: Draw) -> None:
    text = as_dot(draw("paused: hold", "paused: {terminal: resumed}"))
    assert "<B>paused</B><BR/>" in text and "<B>halted</B>  <I>brake</I><BR/>" in text


def test_rows_of_a_mode_are_one_arc_from_its_frame(draw: Draw) -> None:
    drawn = draw()
    assert [(text, arc.head) for text, arc in leaving(drawn, "powered")] == [("tripped", "halted")]
    assert sorted((text, arc.head) for text, arc in leaving(drawn, "working")) == [
        ("pause", "paused"),
        ("tired", "failed"),
    ]
    assert sorted((text, arc.head) for text, arc in leaving(drawn, "picking")) == [
        ("again", "retrying"),
        ("given_up", "failed"),
    ]
    assert all(arc.stroke == "error" for _, arc in leaving(drawn, "working"))


def test_an_arc_to_a_mode_ends_at_its_frame_where_a_dot_points_at_the_initial_state(
    draw: Draw,
) -> None:
    ends = {(arc.tail, arc.head, arc.head_frame) for arc in draw().arcs}
    assert ("waiting", "start of working", "working") in ends
    assert ("start of working", "looking", "") in ends
    assert ("lifting", "start of placing", "placing") in ends
    # From inside the mode there is no way to its frame.
    inside = draw("[backing, terminal, always, waiting]", "[backing, terminal, always, placing]")
    assert ("backing", "start of placing", "") in {
        (a.tail, a.head, a.head_frame) for a in inside.arcs
    }


def test_a_mode_that_is_resumed_has_a_mark_for_its_history(draw: Draw) -> None:
    text = as_dot(draw())
    assert '"paused" -> "history of working"' in text
    assert "label=<H*>" in text
    text = as_dot(draw("resume(working)", "resume(picking)"))
    assert '"paused" -> "history of picking"' in text
    assert "label=<H>" in text


def test_a_row_of_a_mode_to_a_state_inside_begins_at_any_state(draw: Draw) -> None:
    drawn = draw("[working, tired, always, failed]", "[working, tired, always, looking]")
    (arc,) = (each for each in drawn.arcs if each.tail == "any state of working")
    assert (arc.head, arc.tail_frame) == ("looking", "")
    assert "any state of working" in {node.id for node in drawn.all_nodes}


def test_it_can_be_drawn(draw: Draw) -> None:
    svg = render(as_dot(draw()), "svg").decode()
    assert svg.count('class="cluster"') == 4
