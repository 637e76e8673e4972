"""The page over a recording shows what `specc why`, `specc plot` and the report say."""

from __future__ import annotations

import csv
import json
import math
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.recording.index import Index

from specc.cli.view import recorded_run
from specc.tools.page.recorded import RecordedRun
from tests.commands import ROOT, specc
from tests.page.browser import Page
from tests.page.recordings import KEPT, forged_run, opened, served, why_text, without
from tests.page.runs import LIT, TIME
from tests.recording.runs import CONVEYOR, messages
from tests.recording.test_damage import _damaged_at
from tests.recording.test_why_told import MOVING, _changed
from tests.scenarios.architectures import ARCHITECTURES

pytestmark = [
    pytest.mark.no_replay("damaged, or of a specification that is gone"),
    pytest.mark.long,  # recordings of whole runs: seconds each
]
THREE_TIER = next(a.path for a in ARCHITECTURES if a.name == "three_tier")
ROVERS = ROOT / "specs" / "rovers.yaml"
MOMENTS = 20


@pytest.fixture(scope="module", params=["conveyor_gate", "three_tier", "rovers"])
def recorded(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Path, Path]]:
    """A file, and the specification of which it is."""
    spec = {"conveyor_gate": CONVEYOR, "three_tier": THREE_TIER, "rovers": ROVERS}[request.param]
    file = tmp_path_factory.mktemp(request.param) / "run.mcap"
    done = specc("run", spec.relative_to(ROOT), "--duration", 6, "--record", file)
    assert file.exists(), done.stderr
    yield file, spec.relative_to(ROOT)


def _moments(seed: int, end_s: float) -> list[float]:
    chance = Random(seed)
    return [round(chance.uniform(0, end_s), 4) for _ in range(MOMENTS)]


def test_states_and_reasons_are_those_of_why(recorded: tuple[Path, Path]) -> None:
    file, spec = recorded
    run, own = opened(file), opened(file, spec)
    for number, time_s in enumerate(_moments(1, 6.0)):
        shown = run.moment(time_s, None)["states"]
        overview = specc("why", f"{file}@{time_s}", "--spec", spec).stdout.splitlines()
        rows = {words[0]: words[1] for line in overview if len(words := line.split()) > 1}
        assert {name: one["state"] for name, one in shown.items()} == {
            name: state for name, state in rows.items() if name in shown
        }
        machine = sorted(shown)[number % len(shown)]
        done = specc("why", f"{file}@{time_s}", machine, "--spec", spec)
        since = shown[machine]["since_s"]
        assert f"since {since:.6g} s" in done.stdout.splitlines()[0]
        assert why_text(own, machine, time_s) == done.stdout
        assert why_text(run, machine, time_s) == done.stdout  # no operator in these conditions


def test_values_are_those_of_the_plot(recorded: tuple[Path, Path]) -> None:
    file, _ = recorded
    run, chance = opened(file), Random(2)
    signals = [s for s in run.hello()["signals"] if s["kind"] in ("numbers", "pose")]
    for signal in chance.sample(signals, min(len(signals), 12)):
        name = signal["name"]
        rows = list(csv.reader(specc("plot", file, name, "--csv").stdout.splitlines()))[1:]
        time_s = chance.uniform(1.0, 5.0)
        series = run.series(name, time_s, 0.8)
        assert (series["begin_s"], series["end_s"]) == pytest.approx((time_s - 0.4, time_s + 0.4))
        begin = max((float(r[0]) for r in rows if float(r[0]) <= time_s - 0.4), default=0.0)
        expected = [r for r in rows if begin - 1e-9 <= float(r[0]) <= time_s + 0.4 + 1e-6]
        assert [f"{t:.9g}" for t in series["t"]] == [r[0] for r in expected], name
        words = series["words"]
        for column, line in enumerate(series["lines"], start=1):
            texts = ["" if math.isnan(v) else words[int(v)] if words else f"{v:.12g}" for v in line]
            assert texts == [r[column] for r in expected], name


def test_values_at_a_moment_are_those_of_the_message(recorded: tuple[Path, Path]) -> None:
    """As texts: what a real number is, to six digits."""
    file, _ = recorded
    run, checked = opened(file), 0
    every = messages(file)
    numbers = {s["name"]: s for s in run.hello()["signals"] if len(s["components"]) == 1}
    for time_s in _moments(3, 6.0):
        values = run.moment(time_s, None)["values"]
        for name, text in values.items():
            owner, _, path = name.partition(".x.")
            steps = [d for m, d in every.get(f"/{owner}", ()) if m.log_time / 1e9 <= time_s + 1e-6]
            if not path or not steps or name not in numbers:
                continue
            peer, element = path.split(".")
            data = steps[-1]["x"].get(peer, {}).get(element)
            if isinstance(data, float):
                unit = numbers[name]["components"][0]["unit"]
                assert text == f"{data:.6g} {unit}".strip(), name
                checked += 1
            elif data is None:
                assert text == "", name
    assert checked > MOMENTS


def test_verdicts_are_those_of_the_report(tmp_path: Path) -> None:
    spec = _changed(tmp_path, (MOVING, "always(state(gate.c) != opening)"))
    file, report_file = tmp_path / "run.mcap", tmp_path / "report.json"
    specc("run", spec, "--duration", 4, "--record", file, "--report", report_file)
    report = json.loads(report_file.read_text())["requirements"]
    run = opened(file)
    since_s = report[0]["time_s"]
    assert report[0]["verdict"] == "violated" and 0 < since_s < 4
    for time_s in (*_moments(4, 4.0), since_s - 0.01, since_s, None):
        first, second, _ = run.moment(time_s, [])["requirements"]
        is_violated = time_s is None or time_s >= since_s
        assert first["verdict"] == ("violated" if is_violated else "holds"), time_s
        assert first["time_s"] == (since_s if is_violated else None)
        assert second["verdict"] in ("holds", "open")
    last = run.now()["requirements"]
    final = {"met": "holds", "violated": "violated", "unknown": "unknown"}
    assert [each["verdict"] for each in last] == [final[each["verdict"]] for each in report]
    marks = [m for m in run.marks() if m["kind"] == "violation"]
    assert marks == [{"time_s": since_s, "kind": "violation", "text": report[0]["that"]}]
    _marks_and_verdicts_agree(run)


def test_a_requirement_is_violated_where_its_mark_is(tmp_path: Path) -> None:
    spec = _changed(tmp_path, (MOVING, "within(2[s], state(gate.c) == opening)"))
    file = tmp_path / "run.mcap"
    specc("run", spec, "--duration", 4, "--record", file)
    _marks_and_verdicts_agree(opened(file))
    assert opened(file).moment(0.5, [])["requirements"][0]["time_s"] == 0.0


def _marks_and_verdicts_agree(run: RecordedRun) -> None:
    """Of each requirement, at the mark of its violation and just before it."""
    marks = {mark["text"]: mark["time_s"] for mark in run.marks() if mark["kind"] == "violation"}
    assert marks
    for number, each in enumerate(run.hello()["requirements"]):
        since_s = marks.get(each["that"], math.inf)
        for time_s in (0.0, since_s - 0.01, since_s, since_s + 0.01, run.hello()["end_s"]):
            if 0 <= time_s < math.inf:
                found = run.moment(time_s, [])["requirements"][number]
                expected = time_s >= since_s
                assert (found["verdict"] == "violated") is expected, (each, time_s)
                assert found["time_s"] == (since_s if expected else None)


def test_verdicts_of_files_without_them_over_time(tmp_path: Path) -> None:
    """Those of before they were recorded: open until the report says more."""
    run = opened(without("/requirements", KEPT, tmp_path / "run.mcap"))
    assert {each["verdict"] for each in run.moment(3.0, [])["requirements"]} == {"open"}
    assert {each["verdict"] for each in run.now()["requirements"]} == {"holds"}


def test_a_violation_is_explained_as_why_does(tmp_path: Path) -> None:
    """With the constants of the requirement, as they were set."""
    file = _violated(tmp_path)
    first, second, _ = opened(file).hello()["requirements"]
    assert (first["constants"], second["constants"]) == ({}, {"patience": "0.5 s"})
    assert first["reasons"] == []
    assert second["reasons"][1] == (
        "state(gate.c) == opening had to hold by 2 s, 0.5 s later, and did not"
    )
    told = specc("why", f"{file}@3", "--spec", CONVEYOR).stdout
    assert "".join(f"  {reason}\n" for reason in second["reasons"]) in told


def test_spans_and_marks(recorded: tuple[Path, Path]) -> None:
    file, _ = recorded
    run = opened(file)
    spans = run.spans()
    for row in csv.reader(specc("plot", file, "--csv").stdout.splitlines()[1:]):
        begin, end, machine, state = row
        assert any(f"{b:.9g}" == begin and f"{e:.9g}" == end and s == state
                   for b, e, s in spans.get(machine, ())) or machine not in spans  # fmt: skip
    for name, own in spans.items():
        assert own[0][0] == 0.0 and own[-1][1] >= 5.5, name
        assert all(a[1] == b[0] for a, b in pairwise(own))


def test_scene_and_poses() -> None:
    run = opened(KEPT)
    hello = run.hello()
    tf = messages(KEPT)["/tf"]
    names = [each["child_frame_id"] for each in tf[0][1]["transforms"]]
    assert hello["bodies"] == names
    scene = run.asset(int(hello["scene"].rpartition("/")[2]))
    assert scene and json.loads(scene.content) == messages(KEPT)["/scene"][0][1]
    for time_s in _moments(5, 6.0):
        (last,) = [d for m, d in tf if m.log_time / 1e9 <= time_s + 1e-6][-1:]
        first = last["transforms"][0]
        expected = [first["translation"][a] for a in "xyz"] + [first["rotation"][a] for a in "wxyz"]
        assert run.moment(time_s, [])["poses"][0] == expected


def test_changes_of_constants_are_marks(tmp_path: Path) -> None:
    change = {"tick": 20, "constant": "patience", "value": 2.5, "by": "program"}
    others = {("/constants", "specc.Change"): [change]}
    file = forged_run(tmp_path / "run.mcap", {}, {"a.c": [{}, {}, {}]}, others=others)
    text = "patience = 2.5, by program"
    assert opened(file).marks() == [{"time_s": 0.0, "kind": "change", "text": text}]


def test_an_own_specification_is_used_and_compared(tmp_path: Path) -> None:
    changed = _changed(tmp_path, (MOVING, "always(state(gate.c) != opening)"))
    run = opened(KEPT, changed)
    assert any("is not as it was recorded" in text for text in run.hello()["notice"])
    words = run.command({"type": "restart", "from_s": 2.5, "set": {"patience": "3[s]"}})
    assert words == (
        f"start it in a terminal: specc run {changed} --from {KEPT}@2.5 --ui '--set=patience=3[s]'"
    )
    assert run.hello()["can"]["restart"] and not opened(KEPT).hello()["can"]["restart"]
    assert "--spec SPEC" in opened(KEPT).command({"type": "restart", "from_s": None, "set": {}})
    assert "nothing runs" in opened(KEPT).command({"type": "pause"})


def _scrub(run: Any, browser: Any, end_s: float) -> float:
    """40 moves in a second; how long after the last one its moment was there, in s."""
    for number in range(1, 41):
        browser.send("look", id=number, time_s=end_s * number / 41)
        time.sleep(0.025)
    begun = time.monotonic()
    while browser.next("moment")["id"] != 40:
        pass
    return time.monotonic() - begun


def test_scrubbing_ends_at_the_last_moment(recorded: tuple[Path, Path]) -> None:
    file, _ = recorded
    with served(file) as run, run.visit() as browser:
        hello = browser.next("hello")
        assert (hello["source"], hello["file"], hello["notice"]) == ("file", "run.mcap", [])
        assert hello["end_s"] == pytest.approx(6.0, abs=0.2) and hello["controls"]
        assert browser.next("spans")["replace"] and browser.next("marks")["replace"]
        now = browser.next("now")
        assert now["status"] == "ended" and now["time_s"] == hello["end_s"]
        assert _scrub(run, browser, 6.0) < 0.3
        machine = hello["machines"][0]["name"]
        answer = browser.ask("why", machine=machine, time_s=3.0)
        assert (answer["machine"], answer["id"]) == (machine, 7) and answer["lines"]
        browser.send("pause")
        assert "nothing runs" in browser.next("refused")["text"]


@pytest.mark.parametrize("how", ["damaged", "cut"])
def test_damaged_and_cut_files_have_a_notice_and_exit_code_3(how: str, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    if how == "damaged":
        _damaged_at(3.0, file)
    else:
        file.write_bytes(KEPT.read_bytes()[:100_000])
    with served(file, code=3) as run, run.visit() as browser:
        hello = browser.next("hello")
        assert any(how in notice for notice in hello["notice"])
        moment = browser.ask("look", time_s=hello["end_s"] / 2)
        names = {m["name"] for m in hello["machines"]}
        assert set(moment["states"]) == (set() if how == "damaged" else names)
        name = min(names)
        lines = browser.ask("why", machine=name, time_s=hello["end_s"] / 2)["lines"]
        assert ("are lost" in lines[0]["text"]) is (how == "damaged")


def _violated(tmp_path: Path) -> Path:
    """A recording in which the second requirement is violated at 1.5 s."""
    file = tmp_path / "gate.mcap"
    done = specc("run", CONVEYOR, "--set", "patience=0.5", "--duration", 6, "--record", file)
    assert "violated" in done.stderr + done.stdout
    return file


def test_a_cut_file_ends_with_its_last_step(tmp_path: Path) -> None:
    """Cut anywhere, it says no more than what is in its messages, and no less."""
    data, whole = _violated(tmp_path).read_bytes(), opened(tmp_path / "gate.mcap")
    reports = 0
    for share in (0.3, 0.5, 0.7, 0.9):
        file = tmp_path / "cut.mcap"
        file.write_bytes(data[: int(share * len(data))])
        run, machines = opened(file), Index(file).machines.values()
        last_s, end_s = max(each.last_s for each in machines), run.hello()["end_s"]
        assert end_s == last_s == run.now()["time_s"] < whole.hello()["end_s"] or share == 0.9
        assert run.hello()["notice"][0] == f"The recording was cut after {end_s:.6g} s"
        assert all(own[-1][1] == pytest.approx(end_s, abs=0.05) for own in run.spans().values())
        assert all(mark["time_s"] <= end_s for mark in run.marks())
        assert run.moment(end_s + 3, [])["time_s"] == end_s
        assert run.moment(end_s - 0.2, None)["states"] == whole.moment(end_s - 0.2, None)["states"]
        reports += bool(Index(file).report) and share < 0.9
        if end_s > 2.1:
            _marks_and_verdicts_agree(run)
            shown = run.moment(1.5, [])["requirements"][1]
            assert shown == whole.moment(1.5, [])["requirements"][1]
    assert reports == 0, "the report was written before the steps"


def test_a_cut_file_with_a_report_ends_with_its_last_step(tmp_path: Path) -> None:
    """Older runs wrote the report before steps that waited."""
    report = {"simulated_s": 9.0, "requirements": [
        {"that": "a", "verdict": "violated", "time_s": 0.1}, {"that": "b", "verdict": "met"},
        {"that": "c", "verdict": "violated", "time_s": 5.0}]}  # fmt: skip
    verdicts = [{"verdict": "holds"}, {"verdict": "open"}, {"verdict": "holds"}]
    others = {("/requirements", "specc.Requirements"): [{"requirements": verdicts}]}
    steps = {"a.c": [{"state": "s"}, *[{"before": "s", "state": "s"}] * 3]}
    file = tmp_path / "run.mcap"
    forged_run(file, {}, steps, report=report, others=others, is_chunked=False)
    assert opened(file).hello()["end_s"] == 9.0
    data = file.read_bytes()
    text = json.dumps(report).encode()
    file.write_bytes(data[: data.index(text) + len(text)])
    run = opened(file)
    assert run.hello()["end_s"] == pytest.approx(0.3)
    assert [mark["text"] for mark in run.marks()] == ["a"]
    found = [each["verdict"] for each in run.moment(None, [])["requirements"]]
    assert found == ["violated", "open", "holds"]


def test_what_is_lost_within_a_file_is_a_gap(tmp_path: Path) -> None:
    file = tmp_path / "damaged.mcap"
    _damaged_at(3.0, file)
    run, spans = opened(file), opened(file).spans()
    assert run.hello()["notice"] == ["The recording is damaged: 3 parts of it cannot be read"]
    for name, own in spans.items():
        ((begin_s, end_s),) = [(a[1], b[0]) for a, b in pairwise(own) if a[1] < b[0]]
        assert begin_s < 3.0 < end_s
        for time_s, is_known in ((begin_s, True), (3.0, False), (end_s - 0.001, False),
                                 (end_s, True)):  # fmt: skip
            moment = run.moment(time_s, None)
            assert (name in moment["states"]) is is_known, (name, time_s)
        values = run.moment(3.0, None)["values"]
        assert not values.get(name)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.mcap",), "cannot read none.mcap: No such file"),
        (("README.md",), "README.md is no MCAP file"),
        ((KEPT, "--spec", "none.yaml"), "none.yaml"),
        ((KEPT, "--port", "70000"), "'70000' is not a whole number from 0 to 65535"),
        (("run.txt@3",), "cannot read run.txt@3"),
    ],
)
def test_what_cannot_be_viewed(arguments: tuple[object, ...], words: str) -> None:
    done = specc("view", *arguments)
    assert done.returncode in (1, 2) and words in done.stderr + done.stdout


def test_a_port_that_is_taken() -> None:
    with served(KEPT) as run:
        done = specc("view", KEPT, "--port", run.port)
        live = specc("run", CONVEYOR, f"--ui={run.port}", "--duration", "1")
    words = f"specc: no page at port {run.port}: address already in use\n"
    assert (done.returncode, done.stderr) == (live.returncode, live.stderr) == (2, words)


def test_a_recording_of_another_system(tmp_path: Path) -> None:
    """Also one with constants that the specification does not have."""
    file, words = _violated(tmp_path), "specs/rovers.yaml describes rovers"
    words = f"specc: {file} is a recording of conveyor_gate, and {words}\n"
    for command in (["view", file], ["why", f"{file}@1.5"], ["replay", file]):
        done = specc(*command, "--spec", "specs/rovers.yaml")
        assert (done.returncode, done.stdout, done.stderr) == (2, "", words)


def test_a_file_is_shown_while_it_is_read(recorded: tuple[Path, Path]) -> None:
    file, _ = recorded
    whole, index = opened(file), Index(file, 0.0)
    run = recorded_run(index)
    assert not run.is_whole and "still being read" in run.hello()["notice"][0]
    ends = [run.hello()["end_s"]]
    while not run.is_whole:
        run.read_on(1e-6)
        ends.append(run.hello()["end_s"])
    assert ends == sorted(ends)
    assert run.hello()["notice"] == [] and run.spans() == whole.spans()
    for time_s in _moments(6, 6.0):
        assert run.moment(time_s, None) == whole.moment(time_s, None)


# In the browser.


def test_the_page_shows_where_a_machine_was(page: Page) -> None:
    with served(KEPT) as run:
        page.size(1600, 1000)
        page.open(run.url)
        page.wait_for("document.querySelectorAll('.bands .band').length == 5")
        page.wait_for("document.querySelector('#source').innerText.includes('conveyor_gate.mcap')")
        page.evaluate("const slider = document.querySelector('input.cursor'); slider.value = 3.1;"
                      "slider.dispatchEvent(new Event('input'))")  # fmt: skip
        page.wait_for(f"{TIME} == 3.1")
        done = specc("why", f"{KEPT}@3.1", "--spec", CONVEYOR)
        shown = "[...document.querySelectorAll('#machines > *')].map((each) => each.innerText)"
        states = dict(line.split()[:2] for line in done.stdout.splitlines())
        page.wait_for(f"{shown}.join(' ').includes('{states['gate.c']}')")
        found = " ".join(page.evaluate(shown)).split()
        assert {found[found.index(name) + 1] == state for name, state in states.items()} == {True}
        chosen = page.evaluate("document.querySelector('#machines [aria-selected=true]').innerText")
        page.wait_for(f"{LIT} == '{states[chosen.split()[0]]}'")
        assert page.errors() == []
        assert {url.split("/")[2] for url in page.requests()} == {f"127.0.0.1:{run.port}"}


@pytest.mark.parametrize("is_specified", [False, True])
def test_markup_is_shown_as_text(page: Page, is_specified: bool, tmp_path: Path) -> None:
    evil = "<img src=x onerror=alert(1)>"
    texts = {"specs/gate.yaml": CONVEYOR.read_text(encoding="utf-8")} if is_specified else {}
    name = "gate.c" if is_specified else f"{evil}.c"
    steps = {name: [{"state": "a"}, {"before": "a", "state": evil, "row": 0, "transition": evil}]}
    report = {"faults": [{"culprit": evil, "message": evil, "time_s": 0.1}]}
    file = forged_run(tmp_path / "run.mcap", texts, steps, report=report, system=evil)
    with served(file) as run:
        page.open(run.url)
        page.wait_for("document.querySelector('#machines')?.innerText.includes('gate.c')"
                      f" || document.querySelector('#title')?.innerText == '{evil}'")  # fmt: skip
        page.wait_for(f"document.querySelector('#reasons').innerText.includes('{evil}')")
        notices = page.evaluate("document.querySelector('#notices').innerText")
        assert ("there is no specification in the file" in notices) is not is_specified
        assert page.evaluate("[...document.images].filter((each) => each.id != 'picture')") == []
        assert page.errors() == []


def test_a_notice_says_that_a_file_was_cut(page: Page, tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(KEPT.read_bytes()[:100_000])
    with served(tmp_path / "run.mcap", code=3) as run:
        page.open(run.url)
        page.wait_for("document.querySelector('#notices')?.innerText.includes('was cut after')")
        assert page.errors() == []


def test_the_page_explains_a_violation(page: Page, tmp_path: Path) -> None:
    with served(_violated(tmp_path)) as run:
        page.open(run.url)
        shown = (
            "[...document.querySelectorAll('#verdict-list .is-violated')].map((e) => e.innerText)"
        )
        page.wait_for(f"{shown}.join().includes('where patience = 0.5 s')")
        assert "had to hold by 2 s" in page.evaluate(shown)[0]
        page.evaluate("const slider = document.querySelector('input.cursor'); slider.value = 1;"
                      "slider.dispatchEvent(new Event('input'))")  # fmt: skip
        page.wait_for(f"{TIME} == 1 && {shown}.length == 0")
        every = "document.querySelector('#verdict-list').innerText"
        page.wait_for(f"!{every}.includes('had to hold')")
        assert "where patience = 0.5 s" in page.evaluate(every)
        assert page.errors() == []


def test_the_flagship_with_and_without_its_specification(tmp_path: Path) -> None:
    """Its conditions call operators, and its poses, images and chains are of all kinds."""
    file, spec = tmp_path / "run.mcap", Path("specs/irp_picking.yaml")
    assert specc("run", spec, "--duration", 4, "--record", file).returncode == 0
    run, own, unknown = opened(file), opened(file, spec), 0
    for number, time_s in enumerate(_moments(7, 4.0)):
        shown = run.moment(time_s, None)
        assert shown == own.moment(time_s, None)
        machine = sorted(shown["states"])[number % len(shown["states"])]
        done = specc("why", f"{file}@{time_s}", machine, "--spec", spec)
        assert why_text(own, machine, time_s) == done.stdout
        without = why_text(run, machine, time_s)
        unknown += "operators are not called" in without
        truths = [line.split("  (")[0] for line in done.stdout.splitlines() if ": True" in line]
        assert all(line in without for line in truths if line.strip().startswith("row"))
    assert unknown
    cameras = run.hello()["cameras"]
    assert len(cameras) == 2 and all(run.picture(camera, 2.0) for camera in cameras)
