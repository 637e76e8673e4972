"""`specc sweep` as a user starts it: a row for every run, whatever happens to it."""

from __future__ import annotations

import json
import os
import py_compile
import random
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path

import pytest

from specc.tools.sweep.table import Folder, SweepError
from tests.commands import specc
from tests.seeds import short
from tests.sweep.runs import GATE, ROOT, command, environment, hazards, swept, table

SHORT = ("--set", "cruise=0.4,0.5", "--seeds", "0:2", "--duration", "6")


def lines(folder: Path) -> list[str]:
    path = folder / "out" / "runs.jsonl"
    *whole, _ = path.read_text(encoding="utf-8").split("\n") if path.exists() else [""]
    return whole


@pytest.mark.parametrize("counts", short(["2", "13"], 0))
def test_rows_are_what_single_runs_report_whoever_makes_them(counts: str, tmp_path: Path) -> None:
    """However many processes make them."""
    tables = []
    for workers in counts:
        folder = tmp_path / workers
        folder.mkdir()
        done = swept(folder, GATE, *SHORT, "--workers", workers)
        assert done.returncode == 0, done.stderr
        tables.append(table(folder))
    assert tables[0] == tables[-1]
    rows = tables[0]
    order = [(row["cruise [rad/s]"], row["seed"]) for row in rows]
    assert order == [(c, s) for c in ("0.4", "0.5") for s in "01"]
    report = tmp_path / "run.json"
    setting = ("--set", "cruise=0.4[rad/s]", "--report", report)
    assert specc("run", GATE, "--seed", 1, "--duration", 6, *setting).returncode == 0
    told = json.loads(report.read_text(encoding="utf-8"))
    assert rows[1]["records_sha256"] == told["records_sha256"]
    assert rows[1]["cycle.simulated_s"] == json.dumps(told["cycles"][0]["simulated_s"])
    margins = {
        f"margin of {r.get('contract') or r['that']}": r["margin"] for r in told["requirements"]
    }
    assert {n: rows[1][n] for n in margins} == {
        n: "" if m is None else json.dumps(m) for n, m in margins.items()
    }


@pytest.mark.long
def test_a_run_that_fails_is_a_row_with_its_reason(tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    options = ("--set", "mode=1,2,3,0", "--seeds", "0:1", "--duration", "1", "--limit", "4")
    done = swept(tmp_path, spec, *options, "--workers", "1")
    *bad, good = table(tmp_path)
    assert done.returncode == 0
    assert (good["success"], good["reason"]) == ("true", "")
    reasons = {
        "1": "operator do (hazards:do): ValueError: no such thing",
        "2": "its process ended with exit code 3, 3 times",
        "3": "ended after 4 s of wall time",
    }
    for row, (mode, reason) in zip(bad, reasons.items(), strict=True):
        assert (row["mode"], row["success"], row["reason"]) == (f"{float(mode)}", "false", reason)
        assert f"1 not successful: {reason}" in done.stdout
        again = f"specc run {spec} --set mode={mode} --duration 1 --seed 0"
        assert f"  seed 0 with mode={mode}: {again}\n" in done.stdout


@pytest.mark.long
def test_operators_keep_nothing_from_one_run_to_the_next(tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    swept(tmp_path, spec, "--set", "mode=5", "--seeds", "0:3", "--duration", "1", "--workers", "1")
    assert [row["reason"] for row in table(tmp_path)] == ["", "", ""]


def test_what_is_done_is_kept_and_what_is_torn_made_again(tmp_path: Path) -> None:
    """The short form of the next test: the log ends as that of a killed sweep may."""
    options = (hazards(tmp_path), "--seeds", "0:3", "--duration", "1", "--workers", "1")
    assert swept(tmp_path, *options).returncode == 0
    whole, (first, *others) = table(tmp_path), lines(tmp_path)
    (tmp_path / "out/runs.jsonl").write_text(f"{first}\n{others[0][:20]}", encoding="utf-8")
    assert "1 of 3 runs are done already" in swept(tmp_path, *options).stderr
    assert table(tmp_path) == whole
    assert (lines(tmp_path)[0], len(lines(tmp_path))) == (first, 3)


@pytest.mark.long
def test_nothing_is_lost_or_done_twice_however_often_a_sweep_is_ended(tmp_path: Path) -> None:
    chance = random.Random(20)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    options = ("--set", "cruise=0.4,0.5", "--seeds", "0:30", "--duration", "20")
    kept: list[str] = []
    for number in range(5):
        sweep = subprocess.Popen(
            command(GATE, "--out", "out", *options),
            cwd=broken,
            env=environment(broken),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        while sweep.poll() is None and len(lines(broken)) < len(kept) + 1:
            time.sleep(0.01)
        time.sleep(chance.uniform(0.0, 0.3))
        sign = signal.SIGINT if number % 2 else signal.SIGKILL
        sweep.send_signal(sign)
        sweep.communicate()
        assert sweep.returncode == (130 if number % 2 else -signal.SIGKILL)
        if number % 2:
            assert len(table(broken)) == len(lines(broken))
            assert not (broken / "out/.work").exists()
        found = lines(broken)
        assert found[: len(kept)] == kept
        assert len(kept) < len(found) < 60
        kept = found
        with (broken / "out/runs.jsonl").open("a", encoding="utf-8") as log:
            log.write('{"set": {"cru' * (number % 2))  # as if it were torn there
        alive = f"{broken}/out"
        while any(alive in _arguments(p) for p in Path("/proc").iterdir() if p.name.isdigit()):
            time.sleep(0.2)
    assert swept(broken, GATE, *options).returncode == 0
    assert swept(whole, GATE, *options).returncode == 0
    runs = [(json.loads(line)["set"]["cruise"], json.loads(line)["seed"]) for line in lines(broken)]
    assert len(runs) == len(set(runs)) == 60
    assert table(broken) == table(whole)


def _arguments(process: Path) -> str:
    try:
        return (process / "cmdline").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


@pytest.mark.long
def test_a_run_that_a_limit_ended_is_made_again_with_a_longer_one(tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    options = ("--seeds", "0:1", "--duration", "1")
    for limit, reason in (("0.01", "ended after 0.01 s of wall time"), ("60", ""), ("90", "")):
        done = swept(tmp_path, spec, *options, "--limit", limit)
        assert [row["reason"] for row in table(tmp_path)] == [reason], done.stderr
    assert len(lines(tmp_path)) == 2


@pytest.mark.long
def test_a_run_in_which_nothing_was_decided_is_no_success(tmp_path: Path) -> None:
    spec = ROOT / "specs/architectures/sense_plan_act.yaml"
    done = swept(tmp_path, spec, "--seeds", "0:1", "--duration", "0.1")
    (row,) = table(tmp_path)
    assert (row["success"], row["ended"]) == ("", "completed")
    assert row["reason"].startswith("undecided: within(59[s]")
    assert done.stdout.splitlines()[0].split() == ["runs", "success", "95", "%", "undecided"]
    assert swept(tmp_path, spec, "--seeds", "0:1", "--duration", "0.1").returncode == 0


@pytest.mark.long
def test_a_value_that_is_spelled_otherwise_is_the_same_run(tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    for values in ("0.1,2", "0.10,2000[mm]"):
        more = ("--seeds", "0:1", "--duration", "1", "--workers", "1")
        swept(tmp_path, spec, "--set", f"level={values}", *more)
    assert len(lines(tmp_path)) == 2


@pytest.mark.long
def test_more_seeds_and_values_are_added_to_what_is_there(tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    few = ("--duration", "1", "--workers", "1")
    swept(tmp_path, spec, "--set", "level=1,2", "--seeds", "0:2", *few)
    before = lines(tmp_path)
    done = swept(tmp_path, spec, "--set", "level=1:3:3", "--seeds", "0:3", *few)
    assert "4 of 9 runs are done already" in done.stderr
    assert lines(tmp_path)[:4] == before
    assert len(lines(tmp_path)) == len(table(tmp_path)) == 9
    assert (tmp_path / "out/plots/success.png").exists()
    swept(tmp_path, spec, "--set", "level=1", "--seeds", "0:1", *few)
    assert not list((tmp_path / "out/plots").iterdir())


@pytest.mark.parametrize("what", short(["specification", "cycle_limit", "duration"], 0))
def test_runs_of_something_else_are_not_mixed(what: str, tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    swept(tmp_path, spec, "--seeds", "0:1", "--duration", "1")
    before = lines(tmp_path)
    options = ["--seeds", "0:2", "--duration", "1"]
    if what == "specification":
        spec.write_text(spec.read_text().replace("init: 0", "init: 1"))
    elif what == "duration":
        options[-1] = "2"
    else:
        options += ["--cycle-limit", "3"]
    done = swept(tmp_path, spec, *options)
    assert done.returncode == 2
    assert f"out has runs with another {what}" in done.stderr
    assert lines(tmp_path) == before


@pytest.mark.parametrize(
    ("options", "code", "told"),
    [
        (["--set", "cruse=1,2"], 2, "unknown constant `cruse`"),
        (["--set", "cruise=1[m]"], 2, "expected `real[rad/s]`"),
        (["--set", "cruise=1:2"], 2, "write FROM:TO:COUNT"),
        (["--set", "cruise=1,1"], 2, "is there twice"),
        (["--seeds", "3:1"], 2, "write FROM:TO"),
        (["--seeds", "x"], 2, "whole numbers"),
        (["--seeds", "0:9999999"], 2, "more than 1000000 runs"),
        (["--set", "cruise=1:2:1"], 2, "COUNT is a whole number from 2 to 10000, not '1'"),
        (["--limit", "0"], 2, "'0' is not a number of seconds from 0.001 to 10000000"),
        (["--limit", "inf"], 2, "'inf' is not a number of seconds from 0.001 to 10000000"),
        (["--workers", "10000"], 2, "'10000' is not a whole number from 1 to 9999"),
        pytest.param(
            ["--scheduler", "127.0.0.1:1"], 2, "no Dask scheduler there", marks=pytest.mark.long
        ),
    ],
)
def test_wrong_usage(options: list[str], code: int, told: str, tmp_path: Path) -> None:
    done = swept(tmp_path, GATE, "--duration", "1", *options)
    assert (done.returncode, done.stdout) == (code, "")
    assert told in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_setting_that_the_specification_refuses_is_told_before_any_run(tmp_path: Path) -> None:
    spec = hazards(tmp_path)
    text = spec.read_text(encoding="utf-8").replace(
        'level: "1[m]"', 'level: "1[m]", v: "[level, 1[m]]"'
    )
    spec.write_text(text, encoding="utf-8")
    done = swept(tmp_path, spec, "--set", "mode=0,1.5", "--duration", "1")
    assert done.returncode == 2
    assert "with mode=1.5:" in done.stderr
    assert lines(tmp_path) == []


def test_two_sweeps_do_not_write_into_one_folder(tmp_path: Path) -> None:
    with Folder(tmp_path, {}), pytest.raises(SweepError, match="another sweep writes"):
        Folder(tmp_path, {}).__enter__()


def test_a_folder_of_something_else_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "out/.work").mkdir(parents=True)
    (tmp_path / "out/.work/mine").write_text("kept", encoding="utf-8")
    done = swept(tmp_path, GATE, *SHORT)
    assert done.returncode == 2
    assert ".work is there, which no sweep wrote" in done.stderr
    assert [path.name for path in (tmp_path / "out").rglob("*")] == [".work", "mine"]


@pytest.mark.parametrize(
    "line",
    [
        "x",
        "[]",
        '{"set": {}, "seed": 0, "run": {}}',
        '{"set": {}, "seed": [], "run": {}}',
        '{"set": {}, "seed": 0, "run": {"success": false, "reason": "", "ended": "limit"}}',
    ],
)
def test_a_line_that_is_of_no_run_is_refused(line: str, tmp_path: Path) -> None:
    with Folder(tmp_path, {}):
        (tmp_path / "runs.jsonl").write_text(line + "\n", encoding="utf-8")
    with pytest.raises(SweepError, match="line 1 is not of a run"):
        Folder(tmp_path, {}).__enter__()


def test_a_full_disk_is_told_with_the_file(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with Folder(tmp_path, {}) as folder:
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, hard))
        try:
            with pytest.raises(OSError, match=r"runs\.jsonl"):
                folder.add({}, 0, {"success": True, "reason": ""})
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert not folder.done


@pytest.mark.long
def test_what_is_done_needs_no_code_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from specc import pipeline
    from specc.cli.main import main

    spec = hazards(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    build, built = pipeline.build, []

    def building(path: str, texts: Mapping[str, str], **how: bool) -> pipeline.Build:
        built.append(texts["level"])
        return build(path, texts, **how)

    monkeypatch.setattr(pipeline, "build", building)
    for values in ("1,2", "1,2,3"):
        built.clear()
        options = ["--set", f"level={values}", "--seeds", "0:1", "--duration", "1"]
        assert main(["sweep", str(spec), *options, "--workers", "1"]) == 0
    assert built == ["1[m]", "3[m]"]


def test_a_link_to_a_specification_has_its_files_beside_it(tmp_path: Path) -> None:
    from specc.pipeline import read_spec
    from specc.tools.sweep.sweeping import inputs_of

    link = tmp_path / "link.yaml"
    link.symlink_to(GATE)
    read = read_spec(str(GATE))
    assert read.system is not None
    found = inputs_of(str(link), read.sources, read.system)
    root = os.path.commonpath([tmp_path, ROOT])
    assert found.base == os.path.relpath(tmp_path, root)
    assert set(found.files) == {os.path.relpath(ROOT / "specs/plants/conveyor_gate.xml", root)}


def test_the_flagship_is_found_with_all_its_files() -> None:
    from specc.pipeline import read_spec
    from specc.tools.sweep.sweeping import inputs_of

    py_compile.compile(str(ROOT / "specs/objects/drawing.py"))  # which is none of its files
    spec = ROOT / "specs/irp_picking.yaml"
    read = read_spec(str(spec))
    assert read.system is not None
    found = inputs_of(str(spec), read.sources, read.system)
    specs = ROOT / "specs"
    files = [
        specs / "plants/irp6_picking.xml",
        *filter(Path.is_file, (specs / "objects").iterdir()),
    ]
    assert found.files == {str(file.relative_to(specs)): file.read_bytes() for file in files}


@pytest.mark.parametrize("sign", short([signal.SIGKILL, signal.SIGTERM], 0))
def test_nothing_outlives_a_sweep_that_is_killed_while_code_is_generated(
    sign: signal.Signals, tmp_path: Path
) -> None:
    spec = hazards(tmp_path)
    options = ("--set", "level=1:400:400", "--seeds", "0:1", "--workers", "2")
    sweep = subprocess.Popen(
        command(spec, "--out", "out", *options),
        cwd=tmp_path,
        env=environment(tmp_path),
        stderr=subprocess.PIPE,
        text=True,
    )
    while sweep.poll() is None and len(children := _children(sweep.pid)) < 2:
        time.sleep(0.01)
    sweep.send_signal(sign)
    sweep.wait()
    with Folder(tmp_path / "out", json.loads((tmp_path / "out/sweep.json").read_text())):
        pass
    # They hold its standard error, so this waits for their end.
    _, told = sweep.communicate(timeout=60)
    assert sweep.returncode == (-sign if sign == signal.SIGKILL else 128 + sign)
    assert sign == signal.SIGKILL or "Traceback" not in told
    assert not any(_arguments(Path("/proc", str(child))) for child in children)


def _children(process: int) -> list[int]:
    """The processes in which it generates code."""
    found = Path(f"/proc/{process}/task/{process}/children")
    pids = found.read_text(encoding="ascii").split() if found.exists() else []
    return [int(pid) for pid in pids if "spawn_main" in _arguments(Path("/proc", pid))]


@pytest.mark.long
@pytest.mark.parametrize("seeds", ["0:4", "0:8"])
def test_a_file_that_is_changed_meanwhile_changes_no_run(seeds: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "specs/plants", tmp_path / "plants")
    spec = Path(shutil.copy(GATE, tmp_path))
    model = tmp_path / "plants/conveyor_gate.xml"
    text = model.read_text(encoding="utf-8")
    assert 'timestep="0.002"' in text
    options = ("--seeds", seeds, "--duration", "4", "--workers", "1")
    sweep = subprocess.Popen(command(spec, "--out", "out", *options), cwd=tmp_path)
    while sweep.poll() is None and len(lines(tmp_path)) < 2:
        time.sleep(0.01)
    model.write_text(text.replace('timestep="0.002"', 'timestep="0.0025"'), encoding="utf-8")
    assert sweep.wait(timeout=300) == 0
    assert {row["reason"] for row in table(tmp_path)} == {""}
    again = swept(tmp_path, spec, *options)
    assert "runs with another specification" in again.stderr


@pytest.mark.parametrize("what", ["conveyor_gate.yaml", "plants/conveyor_gate.xml"])
def test_code_of_two_versions_is_not_mixed(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from specc import pipeline
    from specc.cli.main import main

    shutil.copytree(ROOT / "specs/plants", tmp_path / "plants")
    spec = Path(shutil.copy(GATE, tmp_path))
    build = pipeline.build

    def changing(path: str, texts: Mapping[str, str], **how: bool) -> pipeline.Build:
        built = build(path, texts, **how)
        if texts["cruise"] == "0.5[rad/s]":
            (tmp_path / what).write_text((tmp_path / what).read_text() + "\n", encoding="utf-8")
        return built

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pipeline, "build", changing)
    assert main(["sweep", str(spec), "--set", "cruise=0.4,0.5", "--seeds", "0:1"]) == 2
    assert "was changed meanwhile; begin again" in capsys.readouterr().err


@pytest.mark.long
def test_files_behind_links_are_found_in_the_copy(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "specs/plants", tmp_path / "models")
    (tmp_path / "plants").symlink_to("models")
    spec = Path(shutil.copy(GATE, tmp_path))
    done = swept(tmp_path, spec, "--seeds", "0:1", "--duration", "1")
    assert [row["reason"] for row in table(tmp_path)] == [""], done.stderr
