"""Descriptions may have different types of one name: a change of any of them is found, once."""

from __future__ import annotations

from pathlib import Path

from specc.pipeline import read_spec
from specc.tools.diff import compare

SYSTEM = """specc: 1
system: pair
frames: {W: world, B: base}
agents:
  one: {use: one.yaml, with: {F: W}}
  two: {use: two.yaml, with: {F: B}}
  three: {use: one.yaml, with: {F: B}}
"""
PART = """specc: 1
parameters: {F: frame}
types:
  Mode: "enum[MEMBERS]"
  Spot: {frames: [G], fields: {at: "point[G]", FIELD}}
agent:
  control:
    rate: 10 Hz
    memory: {mode: {type: Mode, init: low}, seen: {type: "list[Spot[F]]", init: "[]"}}
    functions: {go: {mode: low}}
    behaviours: {go: {functions: [go], terminal: never}}
    states: {S0: go}
    initial_state: S0
"""


def changes(
    folder: Path, first: tuple[str, str], second: tuple[str, str]
) -> list[tuple[str, str, str]]:
    """What became of types when the second description did, and the first one at the same time."""
    systems = []
    for version in (0, 1):
        texts = {"one": first[version], "two": second[version]}
        (folder / "pair.yaml").write_text(SYSTEM)
        for name, text in texts.items():
            members, _, fields = text.partition("; ")
            part = PART.replace("MEMBERS", members).replace("FIELD", fields or "n: int")
            (folder / f"{name}.yaml").write_text(part)
        result = read_spec(str(folder / "pair.yaml"))
        assert result.system is not None, result.diagnostics
        assert not result.diagnostics
        systems.append(result.system)
    found = compare(*systems).changes
    return [(c.name, c.change, c.new or c.old) for c in found if c.part == "type"]


def test_the_type_of_one_description_is_not_that_of_another(tmp_path: Path) -> None:
    first = ("low, high", "low, high")
    found = changes(tmp_path, first, ("low, mid", "low, mid, top"))
    assert found == [("Mode of two.c", "added", "member top -")]
    found = changes(tmp_path, first, ("low, high", "low, high, top"))
    assert found == [("Mode of two.c", "added", "member top -")]
    assert changes(tmp_path, first, ("low, mid", "low, mid")) == []


def test_a_change_that_all_have_is_told_once(tmp_path: Path) -> None:
    both = ("low", "low, top; n: bool")
    assert changes(tmp_path, both, both) == [
        ("Mode", "added", "member top -"),
        ("Spot", "changed", "bool"),
    ]
