"""Texts of strangers stay texts, whatever is in them."""

from __future__ import annotations

from pathlib import Path

import pygraphviz
import pytest

from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cells,
    Cluster,
    Diagram,
    TextRun,
    comma_lines,
    line,
    wrap_lines,
)
from specc.tools.graph.dot import as_dot
from specc.tools.graph.drawing import NotDrawn, render
from tests.commands import specc

HOSTILE = (
    '"]; evil [shape=box]; "',
    "\\",
    '\\" -> evil',
    "\\N \\G \\n",
    "</TD></TR></TABLE>> evil [x=<",
    "<IMG SRC='/secret'/>",
    "&amp; &#0; &evil;",
    "-->]]>",
    "\x00\x01\x1b[31m\u202e\u2028",
    "\ud800",
    "a\nb -> evil // /* #",
    "",
    " ",
)


def diagram(texts: tuple[str, ...]) -> Diagram:
    """Texts in all places that texts can have."""
    nodes = tuple(
        Box(f"{number}{text}", "state", (line(text, "name"), line(text)), ())
        for number, text in enumerate(texts)
    )
    rows = tuple(Cells((line(text, "note"), line(text, "lower"))) for text in texts)
    table = Box(f"table {texts[0]}", "table", (line(texts[0]),), rows)
    arcs = tuple(Arc(nodes[0].id, node.id, (line(node.id),)) for node in nodes)
    return Diagram(
        texts[0], nodes, arcs, (Cluster(texts[0], (line(texts[0]),), (table,)),), (), rows
    )


@pytest.mark.parametrize("first", HOSTILE)
def test_hostile_texts_add_nothing(first: str) -> None:
    texts = (first, *(text for text in HOSTILE if text != first))
    read = pygraphviz.AGraph(string=as_dot(diagram(texts)))
    assert len(read.nodes()) == len(texts) + 1
    assert len(read.edges()) == len(texts)
    assert len(read.subgraphs()) == 1
    assert "evil" not in read.nodes()


def test_hostile_texts_can_be_render() -> None:
    svg = render(as_dot(diagram(HOSTILE)), "svg").decode()
    assert svg.count('class="node"') == len(HOSTILE) + 1
    assert "<image" not in svg and "\x1b" not in svg


def test_what_is_no_graph_is_not_render() -> None:
    with pytest.raises(NotDrawn):
        render("digraph {", "svg")


def test_a_title_of_a_stranger(tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    text = Path("specs/conveyor_gate.yaml").read_text(encoding="utf-8")
    title = "</B>]; evil -> \\\\N [label=<"
    spec.write_text(text.replace("  belt:\n", f'  belt:\n    title: "{title}"\n', 1), "utf-8")
    done = specc("graph", spec, "--format", "dot")
    assert "&lt;/B&gt;]; evil" in done.stdout
    read = pygraphviz.AGraph(string=done.stdout)
    assert len(read.nodes()) == 8


def test_lines() -> None:
    assert [each[0].text for each in wrap_lines("one two three", 8)] == ["one two", "three"]
    assert wrap_lines("", 8) == ()
    (cut,) = wrap_lines("word " * 9, 20, most=1)
    assert cut == (TextRun("word word word word…"),)
    names = [f"name_{number}" for number in range(20)]
    shown = " ".join(each[0].text for each in comma_lines(names, 24))
    assert shown.split(", ") == names
