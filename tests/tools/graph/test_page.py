"""Pictures for a page: every part has an id of its own, whatever it is called."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

import pytest

from specc.model.system import Subsystem, System
from specc.pipeline import read_spec
from specc.tools.graph.diagram import Arc, Box, Cluster, Diagram, line
from specc.tools.graph.formats import draw_svg
from specc.tools.graph.page import machine_picture, structure_picture
from specc.tools.graph.tags import TaggedDiagram
from tests.seeds import every
from tests.tools.graph.test_dot import HOSTILE

GROUP = "{http://www.w3.org/2000/svg}g"
ALLOWED = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-")


def system(name: str) -> System:
    read = read_spec(f"specs/{name}.yaml").system
    assert read is not None
    return read


def subsystem(name: str, place: str) -> Subsystem:
    return next(s for s in system(name).subsystems if s.qualified_name == place)


def classes(svg: str) -> dict[str, list[str]]:
    """The classes of each group with an id; no two have the same id."""
    groups = [each for each in ET.fromstring(svg).iter(GROUP) if "id" in each.attrib]
    assert max(Counter(each.attrib["id"] for each in groups).values()) == 1
    return {each.attrib["id"]: each.attrib.get("class", "").split() for each in groups}


@pytest.mark.long
def test_states_and_rows_have_ids() -> None:
    drawn = machine_picture(subsystem("conveyor_gate", "gate.c"), "p1")
    of = classes(drawn.svg)
    assert drawn.states["passing"] == "p1-s-passing"
    assert all(of[id][:2] == ["node", "state"] for id in drawn.states.values())
    assert drawn.rows == tuple(f"p1-r-{number}" for number in range(7))
    assert {of[id][2] for id in drawn.rows} == {"solid", "error"}
    assert all(id in of[id] for id in drawn.rows)
    assert drawn.svg == machine_picture(subsystem("conveyor_gate", "gate.c"), "p1").svg


def test_conditions_below_the_diagram_are_left_out_and_nothing_is_behind_it() -> None:
    svg = machine_picture(subsystem("conveyor_gate", "gate.c"), "p1").svg
    assert svg.startswith("<svg") and "ends: parcel_came" in svg
    assert "x.eye.parcel" not in svg and 'fill="white"' not in svg
    assert " style=" not in svg


def test_rows_of_a_mode_share_an_arc_with_all_its_pieces() -> None:
    drawn = machine_picture(subsystem("architectures/recovering_picking", "irp.c"), "p1")
    assert drawn.modes == {"moving": "p1-m-moving", "reaching": "p1-m-reaching"}
    of = classes(drawn.svg)
    assert all(of[id] == ["cluster", "mode"] for id in drawn.modes.values())
    assert drawn.rows[8] == drawn.rows[9] == "p1-r-8"
    pieces = [names[0] for names in of.values() if "p1-r-8" in names]
    assert sorted(pieces) == ["edge", "edge", "node"]


def test_the_structure_tells_the_arc_between_two_parts() -> None:
    drawn = structure_picture(system("conveyor_gate"), "p0")
    of = classes(drawn.svg)
    assert drawn.arcs["gate.c", "belt.c"] == "p0-a-gate.c-belt.c"
    assert drawn.arcs["belt.c", "gate.c"] == "p0-a-belt.c-gate.c"
    assert of[drawn.parts["belt.E.drive"]][:2] == ["node", "device"]
    assert {*drawn.parts.values(), *drawn.arcs.values()} <= set(of)


def test_copies_are_one_part() -> None:
    drawn = structure_picture(system("rovers"), "p0")
    assert len(set(drawn.parts.values())) < len(drawn.parts)
    assert {*drawn.parts.values(), *drawn.arcs.values()} <= set(classes(drawn.svg))


@pytest.mark.parametrize("name", every(3, sorted(map(str, Path("specs").glob("*.yaml")))))
def test_pictures_of_one_page_share_no_id(name: str) -> None:
    read = system(Path(name).stem)
    drawn = [structure_picture(read, "p0").svg]
    for number, each in enumerate(read.subsystems, 1):
        if each.transitions:
            drawn.append(machine_picture(each, f"p{number}").svg)
    ids = Counter(id for svg in drawn for id in classes(svg))
    assert max(ids.values()) == 1


def test_names_of_strangers_make_ids_of_few_characters() -> None:
    names = [*dict.fromkeys(HOSTILE), "a b", "a-b", "a_b"]
    boxes = tuple(Box(f"{name}", "state", (line(name),), covers=(name,)) for name in names)
    arcs = tuple(Arc(boxes[0].id, box.id, covers=(f"{boxes[0].id} -> {box.id}",)) for box in boxes)
    groups = tuple(Cluster(name, (), (Box(f"in {name}", "state", ()),)) for name in names[:2])
    tagged = TaggedDiagram(Diagram("hostile", boxes, arcs, groups), "<p>")
    of = classes(draw_svg(tagged))
    assert {*tagged.nodes.values(), *tagged.arcs.values(), *tagged.groups.values()} <= set(of)
    assert len(set(tagged.nodes.values())) == len(names)
    assert len(set(tagged.arcs.values())) == len(arcs)
    assert {each for id, names in of.items() for each in id + "".join(names)} <= ALLOWED
