"""Texts in pictures of specifications lie inside their boxes, whatever font a browser has."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from specc.pipeline import read_spec
from specc.tools.graph import dot
from specc.tools.graph.page import machine_picture, structure_picture
from tests.page.browser import Page
from tests.page.looks import OUTSIDE

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

FONTS = ("DejaVu Sans", "Liberation Sans")
"""The second is as wide as Arial and Helvetica, the first 12 to 16 % wider."""
SPECS = (
    "conveyor_gate", "irp_picking", "architectures/recovering_picking", "architectures/three_tier",
    "examples/tray_cell",
)  # fmt: skip


def installed(font: str) -> bool:
    found = subprocess.run(["fc-list", font], capture_output=True, text=True, check=True)
    return bool(found.stdout)


def pictures(spec: str) -> list[str]:
    system = read_spec(f"specs/{spec}.yaml").system
    assert system is not None
    machines = [each for each in system.subsystems if len(each.states) > 1]
    drawn = [machine_picture(each, f"p{number}").svg for number, each in enumerate(machines)]
    return [structure_picture(system, "p").svg, *drawn]


@pytest.mark.parametrize("measured", FONTS)
def test_texts_lie_inside_their_boxes(
    measured: str, page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = [font for font in FONTS if installed(font)]
    if measured not in shown:
        pytest.skip(f"the font {measured} is not installed")
    monkeypatch.setattr(dot, "_FONT", f'fontname="{measured}"')
    drawn = {spec: "".join(pictures(spec)) for spec in SPECS}
    for font in shown:
        style = f'<style>text, tspan {{ font-family: "{font}" }}</style>'
        for spec, svg in drawn.items():
            page.show(f"<!doctype html>{style}{svg}")
            count, outside = page.evaluate(OUTSIDE)
            assert count > 9 and outside == [], (spec, font)


def test_the_title_of_a_stranger_is_shown_as_text(tmp_path: Path, page: Page) -> None:
    spec = tmp_path / "spec.yaml"
    text = Path("specs/conveyor_gate.yaml").read_text(encoding="utf-8")
    title = "<img src=x onerror=evil()></text><script>evil()</script>"
    spec.write_text(text.replace("  belt:\n", f'  belt:\n    title: "{title}"\n', 1), "utf-8")
    system = read_spec(str(spec)).system
    assert system is not None
    page.show(f"<!doctype html>{structure_picture(system, 'p').svg}")
    texts = page.evaluate("[...document.querySelectorAll('text')].map(t => t.textContent)")
    assert any("<img" in each for each in texts)
    assert page.evaluate("document.querySelectorAll('img, script').length") == 0
    assert page.errors() == []
