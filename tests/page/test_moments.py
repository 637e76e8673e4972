"""What the page says of moments of a run, and what `specc why` and `specc plot` say of them."""

from __future__ import annotations

import csv
import io
import math
from collections import defaultdict
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import pytest
from specc_runtime.recording.index import Index
from specc_runtime.recording.moment import seen_at

from specc.tools.page.moments import MOST_POINTS, decimated
from tests.commands import specc
from tests.page.fake import FakeRun, fake_run
from tests.recording.runs import CONVEYOR, ROOT, messages

pytestmark = pytest.mark.long  # many pictures and reasons: seconds each

KEPT = ROOT / "tests" / "recording" / "conveyor_gate.mcap"
MACHINES = "belt.c", "belt.drive", "gate.c", "gate.barrier", "gate.eye"
MOMENTS = [0.0, 0.05, 0.77, 1.5, 1.55, 2.25, 2.3, 2.7, 3.1, 4.0, 5.2, 5.25, 5.95]


def state_at(index: Index, time_s: float) -> dict[str, Any]:
    """The steps of a moment, as a run sends them."""
    return {
        one.name: {
            "step": one.step, "memory": one.memory, "entered_s": one.entered_s,
            "since_s": one.since_s, "row": one.row, "stamp": one.step["stamp"],
        }
        for one in seen_at(index, time_s)
    }  # fmt: skip


def changes() -> list[list[Any]]:
    """The changes of states in the recording."""
    found = []
    for name in MACHINES:
        for _, step in messages(KEPT)[f"/{name}"]:
            if step["row"] >= 0 or not step["before"]:
                found.append([name, step["time"], step["state"], step["transition"]])
    return sorted(found, key=lambda change: change[1])


@pytest.fixture(scope="module")
def run() -> Iterator[FakeRun]:
    """A run that has sent what the recording has, at the moments."""
    with fake_run(str(CONVEYOR)) as started:
        started.begin(exact=True)
        started.send("spans", changes=changes())
        index = Index(KEPT)
        for time_s in MOMENTS:
            started.state(time_s, state_at(index, time_s))
        yield started


def test_why_is_what_the_terminal_says(run: FakeRun) -> None:
    with run.visit() as visitor:
        visitor.next("hello")
        for time_s in MOMENTS:
            for machine in MACHINES:
                answer = visitor.ask("why", machine=machine, time_s=time_s)
                printed = specc("why", f"{KEPT}@{time_s}", machine, "--spec", CONVEYOR).stdout
                assert "".join(f"{text_of(line)}\n" for line in answer["lines"]) == printed


def text_of(line: Any) -> str:
    place = f"  ({line['place']})" if line["place"] else ""
    return "  " * line["depth"] + line["text"] + place


def test_lines_have_roles_truths_and_places(run: FakeRun) -> None:
    with run.visit() as visitor:
        visitor.next("hello")
        lines = visitor.ask("why", machine="gate.c", time_s=3.1)["lines"]
        roles: dict[str, list[Any]] = defaultdict(list)
        for line in lines:
            roles[line["role"]].append(line)
        assert lines[0]["role"] == "state" and lines[0]["depth"] == 0
        (condition,) = (c for c in roles["condition"] if "parcel_gone" in c["text"])
        assert condition["truth"] is False and condition["place"].endswith("conveyor_gate.yaml:108")
        assert {line["depth"] for line in roles["reason"]} == {3}
        assert [line["text"] for line in roles["read"]] == ["read x.eye.parcel = False"]
        assert len(roles["sent"]) == 2 and roles["past"][0]["text"] == "last transitions:"
        taken = visitor.ask("why", machine="gate.c", time_s=1.5)["lines"]
        (row,) = (line for line in taken if line["role"] == "row" and line["truth"] is not None)
        assert row["truth"] is True


def test_states_and_values_are_those_of_the_step(run: FakeRun) -> None:
    steps = messages(KEPT)
    with run.visit() as visitor:
        names = ["gate.c.x.eye.parcel", "gate.eye.x.R.d", "belt.drive.v_p", "gate.c"]
        visitor.send("watch", signals=names)
        for time_s in MOMENTS:
            answer = visitor.ask("look", time_s=time_s)
            step = [s for _, s in steps["/gate.c"] if s["time"] <= time_s + 1e-9][-1]
            drive = [s for _, s in steps["/belt.drive"] if s["time"] <= time_s + 1e-9][-1]
            eyes = [s for _, s in steps["/gate.eye"] if s["time"] <= time_s + 1e-9]
            distance = eyes[-1]["x"].get("R", {}).get("d")
            assert answer["states"]["gate.c"]["state"] == step["state"]
            assert answer["values"] == {
                "gate.c.x.eye.parcel": str(step["x"].get("eye", {}).get("parcel", "")),
                "gate.eye.x.R.d": "" if distance is None else f"{distance:.6g} m",
                "belt.drive.v_p": f"{drive['memory']['v_p']:.6g} rad/s",
                "gate.c": step["state"],
            }
        assert visitor.ask("look", time_s=2.26)["states"]["gate.c"]["state"] == "opening"


def test_series_are_what_plot_writes(run: FakeRun) -> None:
    names = "gate.eye.x.R.d", "belt.drive.v_p", "gate.c.x.eye.parcel"
    rows = list(csv.DictReader(io.StringIO(specc("plot", KEPT, *names, "--csv").stdout)))
    with run.visit() as visitor:
        visitor.next("hello")
        for name in names:
            series = visitor.ask("series", name=name, time_s=3.0, window_s=6.0)
            (line,) = series["lines"]
            assert series["t"] == MOMENTS and (series["begin_s"], series["end_s"]) == (0.0, 6.0)
            (column,) = (key for key in rows[0] if key.startswith(name))
            for time_s, value in zip(series["t"], line, strict=True):
                known = [
                    r[column] for r in rows if float(r["time_s"]) <= time_s + 1e-9 and r[column]
                ]
                if value is None:
                    assert not known
                elif series["words"]:
                    assert series["words"][int(value)] == known[-1]
                else:
                    assert f"{value:.12g}" == known[-1]


def test_the_plot_of_a_signal_that_is_followed_grows() -> None:
    name, index = "gate.eye.x.R.d", Index(KEPT)
    with fake_run(str(CONVEYOR)) as run, run.visit() as visitor:
        visitor.next("hello")
        for number, time_s in enumerate(MOMENTS, start=1):
            if time_s == 4.0:  # a state that is replaced by one of the same time
                run.state(time_s)
                visitor.next("now")
                visitor.ask("series", name=name, window_s=3.0)
            run.state(time_s, state_at(index, time_s))
            visitor.next("now")
            window_s = 100.0 if number % 5 == 0 else 3.0
            grown = visitor.ask("series", name=name, window_s=window_s)
            begin_s = time_s - window_s
            middle_s = (begin_s + time_s) / 2 + 1e-7
            once = visitor.ask("series", name=name, time_s=middle_s, window_s=window_s)
            assert (grown["t"], grown["lines"]) == (once["t"], once["lines"])
            assert grown["t"][-1] == time_s


def test_the_arcs_on_which_something_went(run: FakeRun) -> None:
    with run.visit() as visitor:
        hello = visitor.next("hello")
        ids = ids_of(run.get(hello["structure"]).read())
        flow = visitor.ask("look", time_s=3.1)["flow"]
        assert flow and set(flow) <= ids
        for machine in hello["machines"]:
            parts = *machine["states"], *machine["rows"], *machine["modes"]
            assert {part["id"] for part in parts} <= ids_of(run.get(machine["svg"]).read())


def ids_of(svg: bytes) -> set[str]:
    return {node.get("id", "") for node in ElementTree.fromstring(svg.decode()).iter()}


def test_of_many_points_the_least_and_the_greatest_stay() -> None:
    times = [number / 1000 for number in range(100_000)]
    values = [math.sin(time_s) for time_s in times]
    values[54_321], values[54_400] = 7.0, -7.0
    values[70_000:71_000] = [math.nan] * 1000
    thin_times, (thin,) = decimated(times, [values])
    assert len(thin_times) == len(thin) == MOST_POINTS
    assert list(thin_times) == sorted(thin_times)
    assert (thin_times[0], thin_times[-1]) == (times[0], times[-1])
    assert {7.0, -7.0} <= set(thin) and any(map(math.isnan, thin))
    assert decimated(times[:5], [values[:5]]) == (times[:5], [values[:5]])
