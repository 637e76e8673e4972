"""A report in a browser: it opens from disk, asks for nothing, and says what the page says."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from random import Random
from typing import Any

import pytest

from tests.commands import specc
from tests.page.browser import Page
from tests.page.recordings import forged_run, served
from tests.recording.runs import CONVEYOR
from tests.recording.test_why_told import MOVING, _changed
from tests.report.test_results import RUN, SCENARIO, _written

pytestmark = [
    pytest.mark.no_replay("of strangers, or of a specification that is gone"),
    pytest.mark.long,  # a browser: seconds each
]
SHOWN = """(() => {
    const texts = (selector) => [...document.querySelectorAll(selector)].map((e) => e.textContent);
    const reasons = document.querySelector("#reasons").textContent;
    return {
        time: document.querySelector("#time").textContent,
        verdicts: texts("#verdict-list .that").map((that, n) => [
            that, texts("#verdict-list .verdict")[n], texts("#verdict-list .margin")[n]]),
        values: texts("#plots .name").map((name, n) => [name, texts("#plots .value")[n]]),
        spans: [...document.querySelectorAll("#timeline .band")].map((e) => e.ariaLabel),
        reasons: reasons.includes("Why is in this report") ? null : reasons,
    };
})()"""
LOOK = """(() => {
    const slider = document.querySelector("#timeline input.cursor");
    slider.value = %r;
    slider.dispatchEvent(new Event("input"));
    slider.dispatchEvent(new Event("change"));
})()"""
TIME = 'Number(document.querySelector("#timeline input.cursor").value)'
WIDTHS = "[document.documentElement.scrollWidth, innerWidth]"
REST_S = 0.3
MOMENTS = 13
MARKUP = "</script><img src=x onerror=alert(1)>"


def _shown(page: Page, wanted: Any, has_reasons: bool) -> Any:
    """What a page shows, as soon as that is what is wanted."""
    end = time.monotonic() + 20
    while True:
        found = page.evaluate(SHOWN)
        if not has_reasons:
            found["reasons"] = None
        if found == wanted or time.monotonic() > end:
            return found
        time.sleep(REST_S / 4)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_report_and_page_say_the_same(seed: int, page: Page, browser: Any, tmp_path: Path) -> None:
    """The same verdicts, margins, spans, values and reasons, at 52 moments of four runs."""
    change = (MOVING, "always(state(gate.c) != opening)")
    spec = _changed(tmp_path / "own", change) if seed % 2 else CONVEYOR
    file, out = tmp_path / "run.mcap", tmp_path / "run.html"
    specc("run", spec, "--duration", 8, "--seed", seed, "--record", file)
    assert specc("report", file, "--out", out).returncode == 0
    chance, has_reasons, times = Random(seed), 0, set()
    with served(file) as run, browser.page() as own:
        for shown, url in ((page, run.url), (own, out.as_uri())):
            shown.size(1280, 900)
            shown.open(url)
            shown.wait_for("document.querySelector('#timeline .band')")
        for number in range(MOMENTS):
            at_s = chance.uniform(0, 8)
            own.evaluate(LOOK % at_s)
            if number % 3 == 0:
                own.key("ArrowRight")
            time.sleep(REST_S)  # reasons are asked for at rest
            report = own.evaluate(SHOWN)
            page.evaluate(LOOK % own.evaluate(TIME))
            assert _shown(page, report, report["reasons"] is not None) == report
            assert report["values"] and report["spans"] and len(report["verdicts"]) == 3
            has_reasons += report["reasons"] is not None
            times.add(report["time"])
        assert own.errors() == page.errors() == []
    assert len(times) > MOMENTS // 2 and has_reasons > 1


def _opened(page: Page, file: Path, width: int, scheme: Any) -> None:
    page.size(width, 900)
    page.media(scheme)
    page.open(file.as_uri())
    page.wait_for("document.querySelector('#tables .table, #timeline .band')")
    time.sleep(REST_S)


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_report_opens_from_disk(width: int, scheme: str, page: Page, tmp_path: Path) -> None:
    spec = _changed(tmp_path / "own", (MOVING, "always(state(gate.c) != opening)"))
    file = tmp_path / "stop-1.mcap"
    specc("run", spec, "--duration", 4, "--record", file)
    results, out = _written(tmp_path, SCENARIO), tmp_path / "run.html"
    assert specc("report", results, file, "--out", out).returncode == 3, "one is missing"
    _opened(page, out, width, scheme)
    assert page.errors() == []
    assert page.requests() == [out.as_uri()]
    scroll, window = page.evaluate(WIDTHS)
    assert scroll <= window
    assert "violated at 2.25 s" in page.evaluate("document.querySelector('#cards').innerText")
    heads = page.evaluate(
        "[...document.querySelectorAll('#incidents b.when')].map(e => e.innerText)"
    )
    assert heads == ["2.25 s Violated"]
    reasons = page.evaluate("document.querySelector('#incidents .reasons').innerText")
    assert reasons.startswith("the barrier moves up only beside a belt that stands")
    assert "at 2.25 s: state(gate.c) != opening did not hold" in reasons
    assert "gate.c at 2.25 s" in reasons
    assert page.evaluate("document.querySelectorAll('.stretch .band').length") > 0
    plots, lines = (f"[...document.querySelectorAll('#incidents .plot{x}')]" for x in ("", " path"))
    count = page.evaluate(f"{plots}.length")
    assert count and page.evaluate(f"new Set({lines}.map(e => e.closest('.plot'))).size") == count
    page.evaluate("document.querySelector('#plots').scrollIntoView({behavior: 'instant'})")
    page.wait_for("document.querySelectorAll('#plots svg').length > 1")
    assert page.evaluate("document.querySelector('#tables a').textContent") == "stop, seed 1"


def test_a_table_leads_to_the_section_of_each_run(page: Page, tmp_path: Path) -> None:
    files = []
    for name in ("one", "two"):
        steps: list[Mapping[str, Any]] = [{"state": name}, {"before": name, "state": "end"}]
        files.append(forged_run(tmp_path / f"{name}.mcap", {}, {f"{name}.c": steps}, seed=name))
    out = tmp_path / "both.html"
    assert specc("report", *files, "--out", out).returncode == 0
    _opened(page, out, 1280, "light")
    bands = "[...document.querySelectorAll('#timeline .band .name')].map((e) => e.textContent)"
    for number, name in ((1, "two"), (0, "one"), (1, "two")):
        page.click(f"#tables a[href='#run={number}']")
        page.wait_for(f"{bands}.join() === '{name}.c'")
        facts = page.evaluate("document.querySelector('#facts').innerText")
        assert f"{name}.mcap" in facts
    page.open(f"{out.as_uri()}#run=1&machine=two.c&t=0.05")
    page.wait_for(f"{bands}.join() === 'two.c'")
    assert page.evaluate(TIME) == pytest.approx(0.05, abs=0.01)
    assert page.errors() == []


def test_names_of_strangers_are_texts(page: Page, tmp_path: Path) -> None:
    steps: list[Mapping[str, Any]] = [{"state": MARKUP}, {"before": MARKUP, "state": "b"}]
    report = {
        "faults": [{"culprit": MARKUP, "message": MARKUP, "time_s": 0.1}],
        "requirements": [{"that": MARKUP, "verdict": "violated", "time_s": 0.0, "because": MARKUP}],
        "ended": MARKUP,
    }
    file = tmp_path / "run <img src=x onerror=alert(2)>.mcap"
    forged_run(file, {}, {MARKUP: steps}, report=report, system=MARKUP, seed=MARKUP)
    named = {**SCENARIO, "name": MARKUP, "because": MARKUP, "runs": [{**RUN, "fault": MARKUP}]}
    results, out = _written(tmp_path, named), tmp_path / "run.html"
    assert specc("report", file, results, "--out", out).returncode == 0
    _opened(page, out, 390, "light")
    assert page.evaluate("document.querySelectorAll('img').length") == 0
    scripts = page.evaluate("[...document.scripts].map((e) => e.type)")
    assert scripts == ["application/json", "application/json", ""]
    assert MARKUP in page.evaluate("document.querySelector('#cards').textContent")
    assert MARKUP in page.evaluate("document.querySelector('#tables').textContent")
    assert page.errors() == [] and page.requests() == [out.as_uri()]
    scroll, window = page.evaluate(WIDTHS)
    assert scroll <= window


def test_a_picture_of_a_camera_is_shown(page: Page, tmp_path: Path) -> None:
    pixel = (
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJ"
        "RU5ErkJggg=="
    )
    steps: list[Mapping[str, Any]] = [{"state": "a"}, {"before": "a", "state": "b"}]
    others = {("/a.c/x/m/I", "foxglove.CompressedImage"): [{"format": "png", "data": pixel}]}
    file = forged_run(tmp_path / "run.mcap", {}, {"a.c": steps}, others=others)
    out = tmp_path / "run.html"
    assert specc("report", file, "--out", out).returncode == 0
    _opened(page, out, 1280, "dark")
    page.wait_for("document.querySelector('#frames img').naturalWidth === 1")
    caption = page.evaluate("document.querySelector('#frames figcaption').innerText")
    assert "a.c: a → b" in caption
    assert page.errors() == []
