"""Recordings of strangers: the page opens no file and calls no Python that they name."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.recording.budget import Unusable

from specc.refusal import Refused
from specc.tools.page.messages import json_text
from specc.tools.page.recorded import RecordedRun
from tests.commands import ROOT
from tests.page.recordings import KEPT, forged_run, opened
from tests.recording.bombs import bombs
from tests.recording.test_foreign_code import CELL, MODEL
from tests.seeds import every, short

pytestmark = pytest.mark.no_replay("of strangers")
MARKUP = "</script><img src=x onerror=alert(1)>\u202e\x1b[31m"
EVIL = "raise SystemExit(open('called', 'w').write('by a recording'))\n"
STEPS: Mapping[str, list[Mapping[str, Any]]] = {
    "a.c": [
        {"state": "going", "x": {"m": {"p": 2.0}}, "memory": {}},
        {"before": "going", "state": "gone", "row": 0, "cause": "terminal",
         "transition": "going terminal always -> gone", "x": {"m": {"p": 2.0}}, "memory": {}},
    ],
}  # fmt: skip


def _all_of(run: RecordedRun) -> str:
    """Everything that a page can ask, as it gets it."""
    hello = run.hello()
    found: list[Any] = [hello, run.spans(), run.marks(), run.now()]
    end_s = hello["end_s"]
    for time_s in (None, -1.0, 0.0, end_s / 3, end_s, 1e9):
        found.append(run.moment(time_s, None))
        found += [run.why(machine["name"], time_s) for machine in hello["machines"]]
        found += [run.series(s["name"], time_s, 5.0) for s in hello["signals"][:40]]
        found += [repr(run.picture(camera, time_s)) for camera in hello["cameras"]]
    found += [run.moment(0.0, ["none", "a.c", ""]), run.why("none", 0.0), run.series("", 0.0, 1e11)]
    assert run.picture("none", 0.0) is None and run.asset(999) is None
    for number in range(20):
        run.asset(number)
    return "\n".join(map(json_text, found))


WATCHED = """
import sys
WATCHED = "open", "import", "subprocess.Popen", "os.system", "os.exec", "tempfile.mkdtemp"
seen, is_watched = [], False
def hook(event, arguments):
    if is_watched and event in WATCHED:
        seen.append((event, str(arguments[0])))
sys.addaudithook(hook)
sys.path[:0] = [{root!r}, {root!r} + "/runtime", "."]
from tests.page.recordings import opened, KEPT
from tests.page.test_strangers import _all_of
from pathlib import Path
_all_of(opened(KEPT))  # what is read of the tools themselves is read by now
is_watched = True
_all_of(opened(Path("run.mcap")))
is_watched = False
import json
print(json.dumps(seen))
"""


@pytest.mark.long
def test_nothing_that_a_recording_names_is_opened(tmp_path: Path) -> None:
    """No file beside it, none elsewhere, no module: the hook of the interpreter sees all."""
    for name in ("own.py", "evil.py"):
        (tmp_path / name).write_text(EVIL)
    (tmp_path / "model.xml").write_text(MODEL)
    (tmp_path / "part.yaml").write_text("specc: 1\n")
    (tmp_path / "secret.yaml").write_text("specc: 1\n")
    text = CELL.replace("system: cell\n", "system: cell\nuses: [../secret.yaml, part.yaml]\n")
    for number, own in enumerate((CELL, text)):
        forged_run(tmp_path / "run.mcap", {f"{tmp_path}/cell.yaml": own}, STEPS, spec="evil.py")
        program = WATCHED.format(root=str(ROOT))
        done = subprocess.run(
            [sys.executable, "-c", program],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, (number, done.stderr)
        seen = json.loads(done.stdout.splitlines()[-1])
        own_parts = (str(ROOT / "specc"), str(ROOT / "runtime"), sys.prefix, sys.base_prefix)
        # Folders of the tools' own are opened to take them away.
        made = {name for event, name in seen if event == "tempfile.mkdtemp"}
        outside = [
            (event, name)
            for event, name in seen
            if event not in ("import", "tempfile.mkdtemp")
            and name not in made
            and Path(name).name != "run.mcap"
            and not str(Path(name).resolve()).startswith(own_parts)
            and not name.isdecimal()
        ]
        assert outside == []
        assert not [name for event, name in seen if event == "import" and name in ("own", "evil")]
        assert not (tmp_path / "called").exists()
    assert ("open", "run.mcap") in {(event, Path(name).name) for event, name in seen}


def test_operators_are_not_called_without_the_own_specification(tmp_path: Path) -> None:
    file = forged_run(tmp_path / "run.mcap", {"cell.yaml": CELL}, STEPS)
    run = opened(file)
    assert run.hello()["notice"] == [] and run.hello()["system"] == "cell"
    lines = run.why("a.c", None)["lines"]
    assert any("terminal far: True" in line["text"] for line in lines)
    asking = CELL.replace('"x.m.p > 1[m]"', '"UP(g, c) > 1"')
    step = {**STEPS["a.c"][1], "memory": {"g": {"width": 1.0}, "c": {"type": "Cloud"}}}
    first = {**STEPS["a.c"][0], "memory": {"g": {"width": 1.0}, "c": {"type": "Cloud"}}}
    file = forged_run(tmp_path / "run.mcap", {"cell.yaml": asking}, {"a.c": [first, step]})
    text = json_text(opened(file).why("a.c", None))
    assert "operators are not called" in text
    assert opened(file).hello()["notice"] == [
        "What operators compute is not known, for a recording does not decide which code runs."
        f" To have them called, name the specification: specc view {file} --spec SPEC"
    ]


def test_files_that_a_specification_names_need_not_be_there(tmp_path: Path) -> None:
    """They are not opened, so what is shown does not depend on the folder."""
    text = CELL.replace("system: cell\n", "system: cell\nfiles: {m: gone.xml}\n")
    assert text != CELL
    hello = opened(forged_run(tmp_path / "run.mcap", {"cell.yaml": text}, STEPS)).hello()
    assert hello["notice"] == [] and hello["signals"]


def test_names_with_markup_are_texts_of_json(tmp_path: Path) -> None:
    """In HTML nothing is rendered of them: the page sets texts only."""
    steps = {MARKUP: [{"state": MARKUP.replace("\x1b", "")}, {"before": "a", "state": "b"}]}
    report = {
        "faults": [{"culprit": MARKUP, "message": MARKUP, "time_s": 0.1}],
        "requirements": [{"that": MARKUP, "verdict": "violated", "time_s": 0.0, "because": MARKUP}],
        "disturbances": [{"because": MARKUP, "began_s": 0.1, "times": 3}],
        "cycles": [{"simulated_s": 0.1, "ended": MARKUP}, {"simulated_s": "x"}, 3],
    }
    file = forged_run(tmp_path / "run.mcap", {}, steps, report=report, system=MARKUP)
    run = opened(file)
    assert [mark["kind"] for mark in run.marks()] == ["violation", "fault", "disturbance", "cycle"]
    assert run.moment(0.0, [])["states"][MARKUP]["state"].startswith("</script>")
    assert json.loads(_all_of(run).splitlines()[0])["system"] == MARKUP


HUGE = [
    {"x": {"m": {"p": 1e308}}, "memory": {"a": 10**400}},
    {"x": {"m": {"p": "NaN"}}, "y": {"m": {"f": [[[]]] * 2000}}},
    {"time": 1e308}, {"time": -1e300}, {"x": {"m": 3}, "memory": 7, "y": []},
    {"conditions": {"a": [1]}, "fresh": {"m.p": "yes"}}, {"fault": {"a": ["\x1b"]}},
    {"memory": {str(number): number for number in range(5000)}},
]  # fmt: skip


@pytest.mark.parametrize("odd", every(3, HUGE))
@pytest.mark.parametrize("texts", [{}, {"cell.yaml": CELL}, {"x.yaml": "specc: [" * 2000}])
def test_odd_values_are_told_or_left_out(
    odd: dict[str, Any], texts: dict[str, str], tmp_path: Path
) -> None:
    steps = {"a.c": [{**own, **odd} for own in STEPS["a.c"]], "b": [odd], "plant": [odd]}
    others = {
        ("/plant", "specc.Truth"): [{"stamp": 0, "y": odd}, [], b"{", odd],
        ("/tf", "foxglove.FrameTransforms"): [{"transforms": [{}]}, {"transforms": 3}, b"\xff"],
        ("/scene", "foxglove.SceneUpdate"): [[1], b"{"],
        ("/requirements", "specc.Requirements"): [{"requirements": [3, odd]}, [], b"["],
        ("/constants", "specc.Change"): [odd, [], b"x"],
        ("/panel", "specc.Operation"): [{"element": [MARKUP], "value": odd}],
        ("/a.c/x/m/I", "foxglove.CompressedImage"): [{"format": "png", "data": "AAAA"}, odd, b"1"],
        ("/a.c/x/m/J", "foxglove.RawImage"): [{"width": 10**9, "height": 10**9}, {}, b"[]"],
        ("/a.c/x/m/D", "specc.DepthImage"): [b"\xff" * 12, b"", b"\xff" * 40],
    }
    del steps["plant"]
    report = {"requirements": [{"that": 3}, 5], "cycles": {}, "faults": [odd], "simulated_s": 1e300}
    file = forged_run(tmp_path / "run.mcap", texts, steps, others=others, report=report)
    try:
        text = _all_of(opened(file))
    except (Refused, Unusable) as refused:
        assert str(file) in str(refused)
    else:
        for line in text.splitlines():
            json.loads(line, parse_constant=pytest.fail)


@pytest.mark.parametrize("seed", short(range(12), 0, 1))
def test_flipped_bytes(seed: int, tmp_path: Path) -> None:
    data, chance = bytearray(KEPT.read_bytes()), Random(seed)
    for _ in range(40):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    (tmp_path / "run.mcap").write_bytes(data)
    try:
        run = opened(tmp_path / "run.mcap")
    except (Refused, Unusable):
        return
    assert any("is damaged" in notice for notice in run.hello()["notice"])
    _all_of(run)


@pytest.mark.parametrize("bomb", short([name for name, _ in bombs()], 2, 5))
def test_bombs_are_refused_or_small(bomb: str, tmp_path: Path) -> None:
    (tmp_path / "bomb.mcap").write_bytes(dict(bombs())[bomb]())
    try:
        run = opened(tmp_path / "bomb.mcap")
    except (Refused, Unusable) as refused:
        assert "bomb.mcap" in str(refused)
        return
    assert len(json_text(run.moment(None, None))) < 1_000_000
