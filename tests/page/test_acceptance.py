"""What a user sees and does in the page of a run, in a browser."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import pytest

from tests.commands import specc
from tests.page.browser import Browser, Page
from tests.page.looks import FAINT, OUTSIDE, SIDEWAYS
from tests.page.runs import (
    END_S,
    ENDED,
    LIT,
    STATUS,
    TIME,
    PageRun,
    page_run,
    set_speed,
    wait_paused,
)

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

GATE = "specs/conveyor_gate.yaml"
KEPT = "tests/recording/conveyor_gate.mcap"
MACHINE = "gate.c"
PERIOD_S = 0.05
HOSTILE = "<img src=x onerror=evil()></text></svg><script>evil()</script>"


def report_of(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def repeatable(report: dict[str, Any]) -> dict[str, Any]:
    """What two runs have in common: all but wall times and memory."""
    machines = {
        name: {key: value for key, value in one.items() if key != "mean_step_us"}
        for name, one in report["subsystems"].items()
    }
    rest = {key: report[key] for key in ("simulated_s", "cycles", "records_sha256", "requirements")}
    return rest | {"subsystems": machines}


def stop_s(folder: Path, state: str) -> float:
    """When `--stop-when` stops the run at a state of the gate."""
    path = folder / "stopped.json"
    formula = f"state({MACHINE}) == {state}"
    assert specc("run", GATE, "--stop-when", formula, "--report", path).returncode == 0
    return round(report_of(path)["simulated_s"], 6)


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The report of the run without a page."""
    path = tmp_path_factory.mktemp("alone") / "report.json"
    assert specc("run", GATE, "--report", path).returncode == 0
    return report_of(path)


# One run from its beginning to its end, with all kinds of clients.


@pytest.mark.long
def test_a_run_is_the_same_whoever_looks_and_stops_it(
    browser: Browser, page: Page, alone: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "report.json"
    with page_run(tmp_path, "run", GATE, "--ui", "--speed", 0.1, "--report", path) as run:
        page.size(1600, 1000)
        page.open(run.url)
        page.wait_for(f"{LIT}.includes('closed')")
        with run.deaf_client(), browser.page() as other:
            other.open(run.url)
            _stop(page, tmp_path)
            other.wait_for(f"{LIT}.includes('closing')")
            assert other.evaluate("document.getElementById('take').hidden") is False
            assert [page.errors(), other.errors()] == [[], []]
            hosts = {url.split("/")[2] for url in page.requests() + other.requests()}
            assert hosts == {f"127.0.0.1:{run.port}"}
            page.click("#pause")
            browser.stop()
            _wait_for_file(path)
            browser.resume()
        page.wait_for(ENDED)
        assert f"records {alone['records_sha256']}" in run.end()
    assert repeatable(report_of(path)) == repeatable(alone)


def _stop(page: Page, folder: Path) -> None:
    """Stop at a row and at a state, step, and stop at a condition."""
    click = "dispatchEvent(new Event('click'))"  # the middle of an arc may be beside it
    page.evaluate(f"document.querySelector('#states [id$=-r-1]').{click}")
    page.wait_for("document.querySelector('#states .row.breakpoint')")
    page.click("#states [id$=-s-passing]")
    page.wait_for("document.querySelector('#states .state.breakpoint')")
    set_speed(page, "max")
    assert wait_paused(page, "opening") == stop_s(folder, "opening")
    page.wait_for(f"{STATUS}.startsWith('paused: gate.c')")
    page.click("#pause")
    time_s = wait_paused(page, "passing")
    assert time_s == stop_s(folder, "passing")
    page.click("#step")
    page.wait_for(f"{TIME} > {time_s}")
    assert wait_paused(page, "passing") == pytest.approx(time_s + PERIOD_S)
    page.click("[aria-label='Stop when: parcel_gone decides in gate.c']")
    page.wait_for("document.getElementById('breaks').textContent == 'Breakpoints 3'")
    page.click("#pause")
    assert wait_paused(page, "closing") == stop_s(folder, "closing")


def _wait_for_file(path: Path) -> None:
    end = time.monotonic() + END_S
    while not path.is_file():
        assert time.monotonic() < end
        time.sleep(0.05)


# A run that has been stopped, with a title of a stranger.


@pytest.fixture(scope="module")
def stopped(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRun]:
    folder = tmp_path_factory.mktemp("stopped")
    (folder / "plants").mkdir()
    shutil.copy("specs/plants/conveyor_gate.xml", folder / "plants")
    text = Path(GATE).read_text(encoding="utf-8")
    for title in ("Conveyor with a gate", "Belt drive", "the barrier moves up"):
        assert title in text
        text = text.replace(title, f"{title} {HOSTILE}", 1)
    (folder / "gate.yaml").write_text(text, encoding="utf-8")
    with page_run(folder, "run", folder / "gate.yaml", "--ui", "--speed", 0.1) as run:
        with browser.page() as page:
            page.size(1600, 1000)
            page.open(run.url)
            page.click("#states [id$=-s-halting]")
            page.wait_for("document.querySelector('#states .state.breakpoint')")
            set_speed(page, "max")
            wait_paused(page, "halting")
            set_speed(page, "0.1")
        yield run


def open_stopped(page: Page, run: PageRun) -> None:
    page.open(run.url)
    page.wait_for(f"{LIT} == 'halting'")
    page.wait_for("document.querySelector('#parts .node') && document.querySelector('.line')")


def assert_legible(page: Page, scheme: Literal["light", "dark"]) -> None:
    """Nothing leaves its box or scrolls the page to the side, and texts have contrast."""
    page.media(scheme)
    for width in (1600, 1000, 390):
        page.size(width, 900)
        page.wait_for(f"{SIDEWAYS} <= 0")
        for measure in (OUTSIDE, FAINT):
            count, found = page.evaluate(measure)
            assert count > 9 and found == [], width


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_is_legible_on_screens_of_three_widths(
    scheme: Literal["light", "dark"], page: Page, stopped: PageRun
) -> None:
    open_stopped(page, stopped)
    assert_legible(page, scheme)


@pytest.mark.long
@pytest.mark.parametrize("name", ["irp_picking", "architectures/two_cells"])
def test_large_systems_are_legible(name: str, page: Page, tmp_path: Path) -> None:
    words = ("--ui", "--speed", 100, "--duration", 2)
    with page_run(tmp_path, "run", f"specs/{name}.yaml", *words) as run:
        page.open(run.url)
        page.wait_for(f"{LIT}.length && {ENDED}", END_S)
        assert_legible(page, "light")
        assert_legible(page, "dark")
        assert page.errors() == []


def test_titles_of_strangers_are_texts(page: Page, stopped: PageRun) -> None:
    open_stopped(page, stopped)
    assert page.evaluate("document.getElementById('title').textContent").endswith(HOSTILE)
    assert page.evaluate("document.querySelectorAll('main img:not(#picture)').length") == 0
    assert page.evaluate("document.querySelectorAll('body script').length") == 0
    assert page.errors() == []


def test_the_keyboard_is_enough(page: Page, stopped: PageRun) -> None:
    page.media(reduced_motion=True)
    open_stopped(page, stopped)
    page.evaluate("document.getElementById('take').click()")
    page.wait_for("document.getElementById('take').hidden")
    for _ in range(60):
        page.key("Tab")
        focused = page.evaluate("document.activeElement.getAttribute('aria-label') ?? ''")
        if focused.startswith("state passing"):
            break
    assert focused == "state passing"
    page.key("Enter")
    page.wait_for("document.activeElement.getAttribute('aria-label').endsWith('breakpoint')")
    assert page.evaluate("document.activeElement.getAttribute('aria-pressed')") == "true"
    page.key(" ")
    page.wait_for(f"{STATUS}.startsWith('running')")
    page.key(" ")
    page.wait_for(f"{STATUS}.startsWith('paused')")
    roles = page.roles()
    assert ("button", "state passing, breakpoint") in roles
    assert {("toolbar", "Control of the run"), ("tablist", "Machines")} <= roles
    page.evaluate("document.querySelector('#states .row').classList.add('flash')")
    assert page.evaluate("document.getAnimations().length") == 0


# A recording.


def test_dragging_through_a_recording_ends_where_it_stops(page: Page, tmp_path: Path) -> None:
    """However many moments were asked for on the way."""
    scrub = """(async () => {
        const slider = document.querySelector("input.cursor");
        for (let number = 0; number <= 40; number += 1) {
            slider.value = 1 + (number * 37) % 41 / 10;
            slider.dispatchEvent(new Event("input"));
            await new Promise((done) => setTimeout(done, 25));
        }
    })()"""
    with page_run(tmp_path, "view", KEPT) as run:
        page.open(run.url)
        page.wait_for(f"{LIT}.length")
        page.evaluate(scrub)
        last_s = 1 + 40 * 37 % 41 / 10
        page.wait_for(f"{TIME} == {last_s}")
        done = specc("why", f"{KEPT}@{last_s}", MACHINE, "--spec", GATE)
        state = done.stdout.partition(": in ")[2].split()[0]
        page.wait_for(f"{LIT} == '{state}'")
        lines = "[...document.querySelectorAll('#reasons .line.condition .text')]"
        told = json.dumps(done.stdout)
        page.wait_for(f"{lines}.length && {lines}.every(e => {told}.includes(e.textContent))")
        assert_legible(page, "dark")
        assert page.errors() == []
