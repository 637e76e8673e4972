"""`specc plot`: pictures and tables of recorded runs, and what it refuses."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from mcap.writer import Writer

from specc.tools.plot.sheet import MOST_NAMES, Band, Sheet, render
from tests.commands import specc
from tests.recording.test_damage import _damaged_at
from tests.seeds import every, short

KEPT = Path(__file__).parents[2] / "recording/conveyor_gate.mcap"
SPEC = KEPT.parents[2] / "specs/conveyor_gate.yaml"
pytestmark = pytest.mark.no_replay("forged or damaged")
_STARTS = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}


def _plot(folder: Path, *arguments: object) -> Any:
    return specc("plot", *arguments, cwd=folder)


def _texts(file: Path) -> list[str]:
    found = ElementTree.parse(file).iter("{http://www.w3.org/2000/svg}text")
    return ["".join(each.itertext()).strip() for each in found]


def _table(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


@pytest.mark.long
def test_the_timeline_of_all_machines(tmp_path: Path) -> None:
    done = _plot(tmp_path, KEPT)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "conveyor_gate-timeline.svg\n"
    texts = _texts(tmp_path / "conveyor_gate-timeline.svg")
    assert "Conveyor with a gate, conveyor_gate.mcap" in texts
    for name in ("belt.c", "gate.c", "halting", "opening", "passing", "time (s)"):
        assert name in texts
    assert "always in one state: belt.drive S0, gate.barrier S0, gate.eye S0" in texts


@pytest.mark.parametrize("form", short(_STARTS, 0))
@pytest.mark.long
def test_what_specc_made_gives_way_and_is_the_same_again(form: str, tmp_path: Path) -> None:
    asked = ("gate.c", "belt.drive.x.E.v_m,belt.drive.x.c.v_d", "gate.eye.y.c.parcel")
    file = tmp_path / f"out.{form}"
    first = None
    for _ in range(2):
        done = _plot(tmp_path, KEPT, *asked, "--out", file)
        assert (done.returncode, done.stderr) == (0, "")
        assert first in (None, file.read_bytes())
        first = file.read_bytes()
    assert first is not None and first.startswith(_STARTS[form])


def test_formats() -> None:
    sheet = Sheet("t", (Band("a", ((0.0, 1.0, "s"),), ("s",)),), (), (), 0.0, 1.0)
    for form, start in _STARTS.items():
        assert render(sheet, form).startswith(start)


def test_signals_and_states(tmp_path: Path) -> None:
    asked = ("gate.c", "belt.drive.x.E.v_m,belt.drive.x.c.v_d", "gate.eye.y.c.parcel")
    assert _plot(tmp_path, KEPT, *asked, "--out", tmp_path / "out.svg").returncode == 0
    texts = _texts(tmp_path / "out.svg")
    for text in ("rad/s", "belt.drive.x.E.v_m", "True", "False", "gate.c", "passing"):
        assert text in texts, text


def test_tables(tmp_path: Path) -> None:
    done = _plot(tmp_path, KEPT, "--csv")
    assert done.returncode == 0 and not list(tmp_path.iterdir())
    rows = _table(done.stdout)
    assert rows[0] == ["begin_s", "end_s", "subsystem", "state"]
    assert ["1.5", "2.25", "gate.c", "halting"] in rows
    rows = _table(_plot(tmp_path, KEPT, "gate.c", "belt.drive.x.E.v_m", "--csv").stdout)
    assert rows[0] == ["time_s", "gate.c", "belt.drive.x.E.v_m [rad/s]"]
    at = {row[0]: row[1:] for row in rows}
    assert at["1.6"] == ["halting", "0.500137731172"]
    assert at["1.61"][0] == "halting"
    done = _plot(tmp_path, KEPT, "--out", "t.csv")
    assert done.stdout == "t.csv\n" and (tmp_path / "t.csv").read_text().startswith("begin_s,end_s")
    assert _plot(tmp_path, KEPT, "--out", "t.csv").returncode == 0, "the same table again"


@pytest.mark.parametrize("head", ["time_s,force", "begin_s,end_s,grade", "recording,time_s,v"])
def test_a_table_is_replaced_by_force_only(head: str, tmp_path: Path) -> None:
    mine = tmp_path / "mine.csv"
    mine.write_text(f"{head}\n0,1\n")
    done = _plot(tmp_path, KEPT, "--out", "mine.csv")
    words = "specc: mine.csv is there already; `--force` replaces it"
    assert (done.returncode, done.stdout) == (2, "") and words in done.stderr
    assert mine.read_text() == f"{head}\n0,1\n" and [*tmp_path.iterdir()] == [mine]
    assert _plot(tmp_path, KEPT, "--out", "mine.csv", "--force").returncode == 0
    assert mine.read_text().startswith("begin_s,end_s")


@pytest.mark.long
def test_settings_of_matplotlib_in_the_working_folder_change_nothing(tmp_path: Path) -> None:
    """A new process, because matplotlib reads them when it is imported."""
    with_them, without = tmp_path / "a", tmp_path / "b"
    for folder in (with_them, without):
        folder.mkdir()
    settings = "text.usetex: True\nfont.size: 30\nsavefig.bbox: tight\n\x1b[31m.key: 1\n"
    (with_them / "matplotlibrc").write_text(settings)
    command = [sys.executable, "-m", "specc", "plot", str(KEPT)]
    done = subprocess.run(command, cwd=with_them, capture_output=True, text=True, check=False)
    name = "conveyor_gate-timeline.svg"
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{name}\n", "")
    assert _plot(without, KEPT).returncode == 0
    assert (with_them / name).read_bytes() == (without / name).read_bytes()


def test_settings_of_matplotlib_are_those_of_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import matplotlib as mpl

    for name in ("a.svg", "b.svg"):
        assert _plot(tmp_path, KEPT, "--out", name).returncode == 0
        monkeypatch.setitem(mpl.rcParams, "text.usetex", True)
        monkeypatch.setitem(mpl.rcParams, "font.size", 30.0)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert mpl.rcParams["font.size"] == 30.0


@pytest.mark.long
def test_many_states_are_one_collection_and_the_longest_have_names() -> None:
    """Drawing time would otherwise go with the number of different states."""
    spans = [(i * 1.0, i + 1.0, f"s{i}") for i in range(900)] + [(900.0, 1200.0, "long")]
    states = tuple(state for *_, state in spans)
    bands = tuple(Band(label, tuple(spans), states) for label in ("a", "b"))
    picture = render(Sheet("t", bands, (), (), 0.0, 1200.0), "svg").decode()
    assert len(set(re.findall(r'id="(\w*PolyCollection_\d+)"', picture))) == 2
    texts = re.findall(r">([^<>]+)</text>", picture)
    assert texts.count("long") == 2 and "s1" not in texts
    even = Band("", tuple((i * 8.0, i * 8.0 + 8, "i") for i in range(60)), ("i",))
    picture = render(Sheet("t", (even,) * 10, (), (), 0.0, 480.0), "svg").decode()
    assert len(re.findall(">i</text>", picture)) == MOST_NAMES


@pytest.mark.long
def test_a_part_of_the_time(tmp_path: Path) -> None:
    part = ("--since", 1.6, "--until", 2.5)
    rows = _table(_plot(tmp_path, KEPT, "--csv", *part).stdout)
    gate = [row for row in rows if row[2] == "gate.c"]
    assert gate == [["1.6", "2.25", "gate.c", "halting"], ["2.25", "2.5", "gate.c", "opening"]]
    rows = _table(_plot(tmp_path, KEPT, "belt.drive.x.E.v_m", "--csv", *part).stdout)
    assert rows[1] == ["1.6", "0.500137731172"] and rows[-1][0] == "2.5"
    done = _plot(tmp_path, KEPT, "gate.c", "belt.drive.x.E.v_m", *part)
    assert (done.returncode, done.stderr) == (0, "")
    texts = _texts(tmp_path / "conveyor_gate-plot.svg")
    assert "halting" in texts and "passing" not in texts
    for wrong, words in ((("--since", 7), "goes from 0 s to 6 s; --since"),
                         (("--since", 2, "--until", 2), "--since 2 is not before --until 2"),
                         (("--until", -1), "'-1' is not a number of seconds")):  # fmt: skip
        done = _plot(tmp_path, KEPT, *wrong)
        assert done.returncode == 2 and words in done.stderr.replace("\n", " "), done.stderr


@pytest.mark.long
def test_runs_over_each_other(tmp_path: Path) -> None:
    shutil.copy(KEPT, tmp_path / "other.mcap")
    done = _plot(tmp_path, KEPT, "other.mcap", "gate.c", "belt.drive.x.E.v_m", "--out", "a.svg")
    assert (done.returncode, done.stderr) == (0, "")
    texts = _texts(tmp_path / "a.svg")
    assert {"gate.c (conveyor_gate)", "gate.c (other)", "conveyor_gate", "other"} <= {*texts}
    rows = _table(_plot(tmp_path, KEPT, "other.mcap", "--csv").stdout)
    assert {row[0] for row in rows} == {"recording", "conveyor_gate", "other"}


def test_runs_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    for name in ("old/a.mcap", "new/a.mcap", "a.mcap", "b.mcap"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        _forged(tmp_path / name, {})

    def named(*files: object) -> list[str]:
        rows = _table(_plot(tmp_path, *files, "--csv").stdout)[1:]
        return [row[0] for row in rows]

    old, new = tmp_path / "old/a.mcap", tmp_path / "new/../new/a.mcap"
    assert named(old, new, "b.mcap") == ["old/a", "new/a", "b"]
    assert named("a.mcap", "old/a.mcap") == ["a", "old/a"]
    assert named("a.mcap", "./a.mcap", "b.mcap") == ["a (1)", "a (2)", "b (3)"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    every(
        3,
        [
            ("none.mcap", "cannot read none.mcap: No such file"),
            ("{spec}", "is no MCAP file"),
            ("{kept} gate.x", "there is no signal gate.x; did you mean "),
            (
                "{kept} gate.c.x.eye.parcl",
                "gate.c has no x.eye.parcl; did you mean gate.c.x.eye",
            ),
            ("{kept} --out a.gif", "a.gif: the name has to end in .svg, .png, .pdf, .csv"),
            ("{kept} --out a", "a: the name has to end in"),
            ("{kept} --csv --out a.svg", "a.svg: with --csv the name has to end in .csv"),
            ("{kept} --out none/a.svg", "none/a.svg cannot be written: no such file or directory"),
            (
                "{kept} --out mine.svg",
                "mine.svg is there, but no SVG that specc made; `--force` replaces it",
            ),
            ("{kept} --out mine.csv", "mine.csv is there already; `--force` replaces it"),
            ("{kept} a.mcap b.mcap c.mcap d.mcap e.mcap f.mcap", "7 recordings are not told apart"),
            ("empty.mcap", "is no MCAP file"),
            ("bare.mcap", "bare.mcap is no recording of specc"),
            ("stepless.mcap", "stepless.mcap has no steps"),
        ],
    ),
)
def test_what_is_refused(arguments: str, words: str, tmp_path: Path) -> None:
    for name in ("empty.mcap", "mine.svg", "mine.csv"):
        (tmp_path / name).write_text("" if name == "empty.mcap" else "mine")
    for name, about in (("bare.mcap", {}), ("stepless.mcap", {"format": "1", "spec": "a.yaml"})):
        with (tmp_path / name).open("wb") as file:
            writer = Writer(file)
            writer.start()
            if about:
                writer.add_metadata("specc", about)
            writer.finish()
    before = sorted(tmp_path.iterdir())
    done = _plot(tmp_path, *arguments.format(kept=KEPT, spec=SPEC).split())
    assert done.returncode == 2 and words in done.stderr, done.stderr
    assert sorted(tmp_path.iterdir()) == before and not done.stdout


def test_damaged_and_cut_files(tmp_path: Path) -> None:
    _damaged_at(2.3, tmp_path / "damaged.mcap")
    done = _plot(tmp_path, "damaged.mcap", "gate.c", "belt.drive.x.E.v_m", "--csv")
    assert done.returncode == 3 and "damaged parts left out: 1" in done.stderr
    assert ",".join(_table(done.stdout)[1]) == "0,closed,-0.000337271883079"
    (tmp_path / "cut.mcap").write_bytes(KEPT.read_bytes()[:60_000])
    done = _plot(tmp_path, "cut.mcap", "gate.c")
    assert done.returncode == 3 and "it was cut after" in done.stderr
    assert (tmp_path / "cut-plot.svg").is_file()


def _forged(
    file: Path,
    *steps: dict[str, Any],
    report: dict[str, Any] | None = None,
    text: bytes = SPEC.read_bytes(),
    times_s: Sequence[float] = (),
) -> None:
    """A recording with steps of `gate.c`, each 50 ms after the one before, or at these times."""
    with file.open("wb") as opened:
        writer = Writer(opened)
        writer.start()
        writer.add_metadata("specc", {"format": "1", "set": "{}", "spec": "conveyor_gate.yaml"})
        writer.add_attachment(0, 0, "conveyor_gate.yaml", "text/yaml", text)
        schema = writer.register_schema("specc.Step.gate.c", "jsonschema", b"{}")
        channel = writer.register_channel("/gate.c", "json", schema)
        for i, step in enumerate(steps):
            told = {"stamp": i, "time": i / 20, "before": "", "state": "closed", "cause": ""}
            told |= {"row": -1, "transition": "", "conditions": {}, "x": {}, "fresh": {}} | step
            data = json.dumps(told, separators=(",", ":"), ensure_ascii=False).encode()
            at_ns = round(times_s[i] * 1e9) if times_s else i * 50_000_000
            writer.add_message(channel, at_ns, data, at_ns)
        if report is not None:
            writer.add_metadata("report", {"report": json.dumps(report)})
        writer.finish()


def test_faults_and_violated_requirements(tmp_path: Path) -> None:
    fault = {"fault": "ValueError: no way", "y": None}
    _forged(tmp_path / "a.mcap", {}, fault)
    _plot(tmp_path, "a.mcap", "gate.c", "--out", "a.svg")
    assert "1 at 0.05 s: fault: gate.c: ValueError: no way" in _texts(tmp_path / "a.svg")
    required = {"time_s": 0.02, "that": "always(False)", "verdict": "violated"}
    met = {"time_s": None, "that": "always(True)", "verdict": "met"}
    told = {"time_s": 0.05, "culprit": "sqrt", "message": "no way"}
    report = {"requirements": [required, met], "faults": [told, 1, {}], "simulated_s": 0.1}
    _forged(tmp_path / "b.mcap", {}, fault, report=report)
    _plot(tmp_path, "b.mcap", "gate.c", "--out", "b.svg")
    texts = _texts(tmp_path / "b.svg")
    assert "1 at 0.02 s: violated: always(False)" in texts
    assert "2 at 0.05 s: fault: sqrt: no way" in texts


@pytest.mark.parametrize("simulated_s", every(4, [1.7e308, 10**400, -1.0, float("nan")]))
def test_no_run_is_as_long_as_that(simulated_s: float, tmp_path: Path) -> None:
    _forged(tmp_path / "a.mcap", {}, {"state": "opening"}, report={"simulated_s": simulated_s})
    assert _plot(tmp_path, "a.mcap").returncode == 0
    rows = _table(_plot(tmp_path, "a.mcap", "--csv").stdout)
    assert rows[-1] == ["0.05", "0.05", "gate.c", "opening"]


def test_times_that_go_back_are_refused(tmp_path: Path) -> None:
    for words in ([], ["gate.c.x.belt.v"], ["gate.c", "--csv"]):
        _forged(tmp_path / "a.mcap", {}, {}, {}, times_s=(0.0, 0.1, 0.05))
        done = _plot(tmp_path, "a.mcap", *words)
        told = "specc: a.mcap: /gate.c at 0.05 s: the step before was later, at 0.1 s\n"
        assert (done.returncode, done.stdout, done.stderr) == (2, "", told), words


def test_what_a_stranger_writes_is_data(tmp_path: Path) -> None:
    """Control characters and commands are seen, huge numbers left out; nothing is executed."""
    huge, odd = {"x": {"belt": {"v": -1.7e308}}}, {"state": "a\u202eb$_$" * 1000}
    _forged(tmp_path / "a.mcap", huge, odd, {"state": "::error::x"})
    done = _plot(tmp_path, "a.mcap", "gate.c", "gate.c.x.belt.v", "--out", "a.svg")
    assert (done.returncode, done.stderr) == (0, "specc: gate.c.x.belt.v never has a value\n")
    done = _plot(tmp_path, "a.mcap", "gate.c", "--csv")
    assert "\n::" not in done.stdout
    _forged(tmp_path / "a.mcap", {"x": {"belt": {"v": "fast"}}})
    done = _plot(tmp_path, "a.mcap", "gate.c.x.belt.v")
    assert done.returncode == 2 and "what is recorded is no real[rad/s]" in done.stderr
    _forged(tmp_path / "a.mcap", {"x": {"belt": {"v": "fast"}}, "stamp": -1})
    done = _plot(tmp_path, "a.mcap")
    assert done.returncode == 2 and "does not begin as that of a step" in done.stderr


def test_a_specification_of_a_stranger_is_read_within_bounds(tmp_path: Path) -> None:
    unfolds = b"a: &a [x, x]\n" + b"".join(b"%c: &%c [*%c, *%c]\n" % (k + 1, k + 1, k, k)
                                          for k in range(97, 121))  # fmt: skip
    others = [b"use: {q: other.yaml}\n", unfolds, b"#" + bytes([120]) * 2_000_000]
    (tmp_path / "other.yaml").write_bytes(SPEC.read_bytes())
    for text in (b"", b"hello", *(SPEC.read_bytes() + other for other in others)):
        _forged(tmp_path / "a.mcap", {}, text=text)
        done = _plot(tmp_path, "a.mcap", "gate.c")
        words = "a.mcap has no specification that can be read, so it names no signals"
        assert (done.returncode, done.stderr) == (2, f"specc: {words}\n"), text[:20]
        assert _table(_plot(tmp_path, "a.mcap", "--csv").stdout)[1:] == [
            ["0", "0", "gate.c", "closed"]
        ]


@pytest.mark.long
def test_the_picture_of_the_page_is_that_of_the_command(tmp_path: Path) -> None:
    page = (KEPT.parents[2] / "docs/runs.md").read_text()
    command = page.split("$ specc plot run.mcap ", 1)[1].split("\n", 1)[0]
    assert "](pictures/plot/gate.svg)" in page
    _plot(tmp_path, KEPT, *command.split(), "--out", "gate.svg")
    shown = _texts(KEPT.parents[2] / "docs/pictures/plot/gate.svg")
    assert shown == _texts(tmp_path / "gate.svg"), f"{command} --out docs/pictures/plot/gate.svg"
