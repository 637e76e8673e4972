"""Lines of text in SVG of Graphviz, set so that they stay in place in any font.

Graphviz gives each run of a line a place of its own, by the widths of a font of this machine. Here
a line is one text: its runs follow one another, and a line in the middle of a node stays there.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator

_SVG = "http://www.w3.org/2000/svg"
_GROUP, _TEXT, _RUN = (f"{{{_SVG}}}{tag}" for tag in ("g", "text", "tspan"))
_SHAPES = tuple(f"{{{_SVG}}}{tag}" for tag in ("path", "polygon", "ellipse"))
_LOWER = 2.2
"""How far subscripts stand below their line; not all browsers know `baseline-shift`."""
_SPACE = "{http://www.w3.org/XML/1998/namespace}space"
_PLACE = ("text-anchor", "x", "y", "baseline-shift", _SPACE)
ET.register_namespace("", _SVG)


def set_lines(svg: str, note_color: str) -> str:
    """An element `svg` with lines as texts; runs in the color of notes have the class `note`."""
    root = ET.fromstring(svg)
    for group in root.iter(_GROUP):
        kind, *looks = group.get("class", "").split()
        if kind != "graph" and "table" not in looks:  # those have columns
            middle = _middle(group) if kind == "node" else None
            for line in _lines(group):
                _join(group, line, middle)
    for text in (*root.iter(_TEXT), *root.iter(_RUN)):
        if text.get("fill") == note_color:
            text.set("class", "note")
    return ET.tostring(root, encoding="unicode")


def _middle(group: ET.Element) -> float | None:
    """The middle of the shape of a node, which has none if nothing is drawn around its texts."""
    shape = next((each for each in group if each.tag in _SHAPES), None)
    if shape is None:
        return None
    if "cx" in shape.attrib:
        return float(shape.attrib["cx"])
    points = re.findall(r"(-?[\d.]+),-?[\d.]+", shape.get("points") or shape.get("d") or "")
    places = [float(each) for each in points]
    return (min(places) + max(places)) / 2


def _lines(group: ET.Element) -> Iterator[list[ET.Element]]:
    """The runs of each line: those at the same height, and subscripts after them."""
    line: list[ET.Element] = []
    for run in group.findall(_TEXT):
        if line and "baseline-shift" not in run.attrib and run.get("y") != line[0].get("y"):
            yield line
            line = []
        line.append(run)
    if line:
        yield line


def _join(group: ET.Element, line: list[ET.Element], middle: float | None) -> None:
    """Replace the runs of a line by one text, around the middle if there is one."""
    place = {"x": line[0].attrib["x"], "text-anchor": "start"}
    if middle is not None:
        place = {"x": f"{middle:.2f}", "text-anchor": "middle"}
    text = ET.Element(_TEXT, {_SPACE: "preserve", **place, "y": line[0].attrib["y"]})
    for run in line:
        own = {name: value for name, value in run.attrib.items() if name not in _PLACE}
        lower = {"dy": f"{_LOWER}"} if "baseline-shift" in run.attrib else {}
        ET.SubElement(text, _RUN, own | lower).text = run.text
    text.tail = line[0].tail
    group.insert(list(group).index(line[0]), text)
    for run in line:
        group.remove(run)
