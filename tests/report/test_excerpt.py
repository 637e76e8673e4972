"""What a report has of a run is what the page's source says, within its bounds."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from random import Random
from typing import Any

import pytest

from specc.tools.page.messages import json_text
from specc.tools.page.recorded import RecordedRun
from specc.tools.report.excerpt import NoRoom, changes, excerpt, spread, without_near
from tests.page.recordings import KEPT, forged_run, opened
from tests.recording.runs import CONVEYOR

pytestmark = pytest.mark.no_replay("of strangers")
PARTS = ("states", "values", "requirements")
ROOM = 4_000_000


def unpacked(moments: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Moments that say all, of moments that say what is another than before."""
    now: dict[str, dict[str, Any]] = {part: {} for part in PARTS}
    for moment in moments:
        for part in PARTS:
            now[part] = {
                n: v for n, v in {**now[part], **moment.get(part, {})}.items() if v is not None
            }
        yield {"time_s": moment["t"], **{part: dict(now[part]) for part in PARTS}}


def as_json(data: Any) -> Any:
    return json.loads(json_text(data))


@pytest.fixture(scope="module")
def run() -> RecordedRun:
    return opened(KEPT)


@pytest.fixture(scope="module")
def data(run: RecordedRun) -> Any:
    return json.loads(excerpt(run, (), ROOM))


def test_moments_are_those_of_the_page(run: RecordedRun, data: Any) -> None:
    names = [signal["name"] for signal in data["hello"]["signals"]]
    every = list(unpacked(data["moments"]))
    assert len(every) > 700
    for shown in Random(1).sample(every, 50):
        said = as_json(run.moment(shown["time_s"], names))
        assert shown["states"] == said["states"]
        assert shown["values"] == said["values"]
        assert [*shown["requirements"].values()] == said["requirements"]
    assert data["spans"] == as_json(run.spans())
    assert data["marks"] == as_json(run.marks())


def test_all_that_happens_is_a_moment_with_its_reasons(run: RecordedRun, data: Any) -> None:
    times = [moment["t"] for moment in data["moments"]]
    assert times == sorted(times)
    happened = [mark["time_s"] for mark in run.marks()]
    for name, spans in run.spans().items():
        changed = [begin_s for begin_s, _, _ in spans[1:]]
        happened += changed
        reasons = {why["t"]: why["lines"] for why in data["whys"][name]}
        for time_s in changed:
            assert reasons[time_s] == as_json(run.why(name, time_s)["lines"])
    assert happened and all(any(abs(t - h) < 1e-6 for t in times) for h in happened)


def test_lines_are_those_of_the_page(run: RecordedRun, data: Any) -> None:
    hello = run.hello()
    begin_s, end_s = hello["begin_s"], hello["end_s"]
    drawn = data["series"]["gate.c.x.belt.v"]
    said = as_json(run.series("gate.c.x.belt.v", None, end_s - begin_s))
    assert (drawn["t"], drawn["lines"]) == (said["t"], said["lines"])


def test_chosen_signals_come_in_their_order(tmp_path: Path) -> None:
    names = ("gate.c", "gate.c.x.belt.v", "belt.c.x.drive.v")
    texts = {"gate.yaml": CONVEYOR.read_text(encoding="utf-8")}
    run = opened(forged_run(tmp_path / "run.mcap", texts, {"gate.c": [{"state": "closed"}]}))
    hello = json.loads(excerpt(run, names, ROOM))["hello"]
    assert hello["usual"] == [*names]
    machines = {machine["name"] for machine in hello["machines"]}
    assert {signal["name"] for signal in hello["signals"]} == {*names, *machines}


@pytest.mark.long  # each half of a run is read anew
@pytest.mark.parametrize("room", [400_000, 120_000, 60_000])
def test_a_run_takes_no_more_room_than_it_has(room: int, run: RecordedRun) -> None:
    text = excerpt(run, (), room)
    assert len(text.encode()) <= room
    data = json.loads(text)
    moments = [moment["t"] for moment in data["moments"]]
    assert moments[0] == 0.0 and moments[-1] == pytest.approx(6.0)


def test_a_run_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    run = opened(_with_faults(tmp_path / "run.mcap", 60))
    with pytest.raises(NoRoom, match="specc view"):
        excerpt(run, (), 1_000)


def _with_faults(file: Path, count: int) -> Path:
    steps: list[Mapping[str, Any]] = [{} for _ in range(count)]
    faults = [{"culprit": "a.c", "message": f"no. {n}", "time_s": n / 10} for n in range(count)]
    report = {"faults": faults, "simulated_s": count / 10}
    return forged_run(file, {}, {"a.c": steps}, report=report)


def test_of_many_faults_the_first_are_shown_and_the_others_counted(tmp_path: Path) -> None:
    data = json.loads(excerpt(opened(_with_faults(tmp_path / "run.mcap", 60)), (), ROOM))
    assert [one["time_s"] for one in data["incidents"]] == [n / 10 for n in range(20)]
    assert data["more_incidents"] == 40
    assert {*data["incidents"][0]["machines"]} == {"a.c"}


def test_times_are_spread_and_told_apart() -> None:
    assert spread(1.0, 2.0, 3) == [1.0, 1.5, 2.0]
    assert spread(1.0, 2.0, 1) == []
    assert without_near([2.0, 1.0, 1.0 + 1e-8, 2.5]) == [1.0, 2.0, 2.5]


def test_changes_make_the_next_of_the_one_before() -> None:
    chance = Random(3)
    before: dict[str, int] = {}
    for _ in range(200):
        now = {name: chance.randrange(3) for name in "abcd" if chance.random() < 0.7}
        news = changes(before, now)
        assert {n: v for n, v in {**before, **news}.items() if v is not None} == now
        assert all(before.get(n) != v for n, v in news.items())
        before = now
