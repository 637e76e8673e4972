"""What SECURITY.md says: which commands run the Python that a specification names, and which none.

Its module leaves a mark when it is imported, and so does the package around it.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from specc.cli.main import main
from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from tests.recording.forged import forged
from tests.recording.runs import ROOT
from tests.recording.test_foreign_code import CELL, MODEL

pytestmark = pytest.mark.no_replay
MARKER = Path("marker")
MACHINE = """  {0}:
    control:
      rate: 10 Hz
      x: {{{1}: {{n: int}}}}
      y: {{{1}: {{n: int}}}}
      memory: {{m: {{type: int, init: 1}}}}
      conditions: {{initial: {{more: m > 1}}, terminal: {{told: fresh(x.{1}.n)}}}}
      behaviours:
        wait: {{functions: [{{m: m}}], terminal: told}}
        tell: {{functions: [{{y.{1}.n: UP(m), m: m}}], terminal: told}}
      states: {{waiting: wait, telling: tell}}
      initial_state: waiting
      transitions: [[waiting, terminal, always, telling], [telling, terminal, always, waiting]]
"""
WAITING = """specc: 1
system: talk
operators: {UP: {signature: "(n: int) -> int", python: "arm.force:up"}}
agents:
""" + "".join(MACHINE.format(*each) for each in ("ab", "ba"))
REFUTED = WAITING.replace("terminal, always, telling]", "terminal, more, telling]")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two specifications whose Python leaves a mark, and what commands take beside them."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    Path("arm").mkdir()
    mark = "open('marker', 'a').write(__name__ + '\\n')\n"
    for name in ("arm/__init__.py", "arm/force.py", "conftest.py", "sitecustomize.py"):
        Path(name).write_text(mark)
    Path("arm/force.py").write_text(f"{mark}def up(n): return n + 1\n")
    Path("cell.yaml").write_text(CELL.replace("own:", "arm.force:"))
    Path("model.xml").write_text(MODEL)
    Path("talk.yaml").write_text(WAITING)
    Path("wrong.yaml").write_text(REFUTED)
    forged(Path("run.mcap"), {"talk.yaml": WAITING})
    yield
    for name in [n for n in sys.modules if n.partition(".")[0] in ("arm", "generated_talk")]:
        del sys.modules[name]


NOTHING_RUNS = [
    *(["validate", "cell.yaml", f"--format={f}"] for f in ("text", "json", "sarif", "junit")),
    ["validate", "cell.yaml", "talk.yaml", "wrong.yaml", "--fix"],
    ["build", "cell.yaml", "talk.yaml"],
    ["build", "cell.yaml", "talk.yaml", "--check"],
    ["status", "cell.yaml"],
    ["ages", "cell.yaml"],
    ["graph", "cell.yaml"],
    ["explore", "cell.yaml"],
    ["explore", "talk.yaml", "--format=json"],
    ["diff", "cell.yaml", "talk.yaml"],
    ["doc", "cell.yaml", "--out", "document"],
    ["test", "wrong.yaml", "--out", "tried"],
    ["fmt", "cell.yaml", "--diff"],
    ["fmt", "cell.yaml", "--upgrade"],
    ["explain", "E0201"],
    ["lib"],
    ["schema"],
    ["init", "new"],
    ["recover", "run.mcap", "--out", "mended.mcap"],
    ["replay", "run.mcap"],
    ["why", "run.mcap@0.1"],
    ["coverage", "run.mcap"],
    ["coverage", "run.mcap", "--format", "github"],
    ["coverage", "run.mcap", "--format", "json"],
    ["plot", "run.mcap"],
    ["plot", "run.mcap", "talker.c.m", "--csv"],
    ["report", "run.mcap"],
    ["completion", "bash"],
    ["witness", "wrong.yaml", "--out=scenarios"],
    ["run", "wrong.yaml"],
]


def test_these_commands_run_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    for command in NOTHING_RUNS:
        code = main(command)
        told = capsys.readouterr()
        assert code in (0, 1, 2), (command, told)
        assert not MARKER.exists(), command
        assert "arm" not in sys.modules, command
    assert Path("generated/cell/system.py").exists() and Path("mended.mcap").exists()
    assert [*Path("scenarios").glob("test_*.py")]


AS_SPECIFICATION = [
    *(["validate"], ["validate", "--fix"], ["build"], ["run"], ["sweep"], ["fmt"], ["status"]),
    *(["ages"], ["explore"], ["explore", "--traces=t"], ["diff", "talk.yaml"], ["witness"]),
    *(["import", "scxml"], ["init"], ["replay", "run.mcap", "--spec"], ["replay"]),
    *(["why", "run.mcap@0.1", "--spec"], ["view", "run.mcap", "--spec"]),
    ["report", "run.mcap", "--out=passed.html", "--force", "--spec"],
]
PICKLED = b"cos\nsystem\n(S'touch marker'\ntR."


def test_recordings_reports_and_pickles_are_no_specifications(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Whatever they are called, and whatever code they name."""
    told = {"operators": {"E": {"python": "arm.force:up"}}, "spec": "talk.yaml", "faults": []}
    files = {
        "run.yaml": Path("run.mcap").read_bytes(),
        "report.json": json.dumps(told).encode(),
        "pickled.yaml": PICKLED,
        "pickled.mcap": PICKLED,
        "folder/runs.jsonl": b'{"python": "arm.force:up"}\n',
    }
    Path("folder").mkdir()
    for name, data in files.items():
        Path(name).write_bytes(data)
    for name in ("run.mcap", "folder", *files):
        for command in AS_SPECIFICATION:
            if (command, name) == (["init"], "folder"):
                continue
            assert main([*command, name]) in (1, 2), (command, name)
            assert "Traceback" not in capsys.readouterr().err
    for name in ("report.json", "pickled.mcap", "folder", "folder/runs.jsonl"):
        for command in (["run", "talk.yaml", f"--from={name}@1"], ["recover", name]):
            assert main(command) == 2, command
    assert {name: Path(name).read_bytes() for name in files} == files
    assert not MARKER.exists() and "arm" not in sys.modules


def test_the_editor_runs_nothing() -> None:
    project = Project()
    for file in ("cell.yaml", "talk.yaml", "wrong.yaml"):
        project.analyse(str(Path(file).resolve()))
    assert features.notes(project)
    assert not MARKER.exists() and "arm" not in sys.modules


RUNS = [
    ["run", "talk.yaml", "--duration=1", "--quiet"],
    ["replay", "run.mcap", "--spec=talk.yaml"],
    ["explore", "talk.yaml", "--traces=traces"],
]


@pytest.mark.parametrize("command", RUNS, ids=lambda command: command[0])
def test_these_commands_run_what_the_specification_names(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main([part for part in command if part != "--quiet"])
    capsys.readouterr()
    assert MARKER.read_text().split() == ["arm", "arm.force"]


@pytest.mark.long
def test_a_sweep_runs_what_the_specification_names(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", "talk.yaml", "--seeds=0:1", "--duration=1", "--workers=1"]) == 0
    assert "arm.force" in MARKER.read_text()


def test_the_page_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    page = (ROOT / "SECURITY.md").read_text()
    assert "(SECURITY.md)" in (ROOT / "README.md").read_text()
    with pytest.raises(SystemExit):
        main(["--help"])
    commands = set(re.findall(r"^    ([a-z]+)\b", capsys.readouterr().out, re.MULTILINE))
    assert commands and commands <= set(re.findall(r"`(?:specc )?([a-z]+)[` ]", page))
    silent = {command[0] for command in NOTHING_RUNS}
    assert commands == silent | {"sweep", "import", "lsp", "view"}
