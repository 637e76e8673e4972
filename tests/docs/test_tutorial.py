"""The tutorial's pieces are the tutorial's specification, and its commands answer as it shows."""

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from specc.cli import main
from tests.docs.examples import HERE

ROOT = HERE.parents[1]
SPEC = ROOT / "specs" / "conveyor_gate.yaml"
TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCK = re.compile(
    r"(?:^<!-- without: (?P<without>.*) -->\n)?^```(?P<kind>\w+)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
BLOCKS = list(BLOCK.finditer(TUTORIAL))


def steps() -> list[tuple[str, str]]:
    """What `specc validate` is given at each point of the tutorial, and what the tutorial shows."""
    found, written = [], ""
    for block in BLOCKS:
        if block["kind"] == "yaml":
            written += block["text"]
        command, _, shown = block["text"].partition("\n")
        if command == "$ specc validate specs/my_gate.yaml":
            lines = shlex.split(block["without"] or "")
            kept = [line for line in written.splitlines() if line not in lines]
            assert len(kept) == len(written.splitlines()) - len(lines)
            found.append(("\n".join(kept) + "\n", shown))
    return found


def test_the_pieces_together_are_the_specification() -> None:
    pieces = "".join(block["text"] for block in BLOCKS if block["kind"] == "yaml")
    spec = SPEC.read_text(encoding="utf-8")
    assert pieces.strip() == spec[spec.index("specc: 1") :].strip()


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the plant in it, to work in."""
    shutil.copytree(ROOT / "specs" / "plants", tmp_path / "specs" / "plants")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("spec", "shown"), steps(), ids=range(len(steps())))
def test_validate_says_what_the_tutorial_shows(
    spec: str, shown: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "specs" / "my_gate.yaml").write_text(spec, encoding="utf-8")
    main(["validate", "specs/my_gate.yaml"])
    assert capsys.readouterr().err.strip() == shown.strip()


def test_shown_code_is_generated(project: Path) -> None:
    assert main(["build", str(SPEC)]) == 0
    text = (project / "generated" / "conveyor_gate" / "belt_c.py").read_text(encoding="utf-8")
    shown = [block["text"] for block in BLOCKS if block["kind"] == "python"]
    assert shown
    assert all(piece in text for piece in shown)


def test_parcels_pass_without_faults(project: Path) -> None:
    arguments = ["--duration", "20", "--report", "gate.json"]
    assert main(["run", str(SPEC), *arguments]) == 0
    report = json.loads((project / "gate.json").read_text(encoding="utf-8"))
    assert report["faults"] == []
    assert len([cycle for cycle in report["cycles"] if cycle["ended"] == "completed"]) >= 3
    assert set(report["subsystems"]["gate.c"]["states_visited"]) == {
        "closed", "halting", "opening", "passing", "closing"
    }  # fmt: skip
    assert "alarm" not in report["subsystems"]["belt.c"]["states_visited"]
