"""What a user does in the page: the panel, the slider and its keys, the past and the present."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.commands import specc
from tests.page.browser import Browser, Page
from tests.page.runs import END_S, LIT, STATUS, TIME, PageRun, page_run, wait_paused

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

DESK = "tests/cases/plant/ok-panel.yaml"
GATE = "specs/conveyor_gate.yaml"
HOLD = "document.querySelector('.hold')"
SENT = """(() => {
    window.sent = [];
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (text) {
        const {type, name, value} = JSON.parse(text);
        if (["hold", "release", "panel", "set"].includes(type))
            sent.push([type, name.split(".").at(-1), value ?? null]);
        return send.call(this, text);
    };
})()"""
"""Note what the page sends of the panel."""
ALIGNED = """(() => {
    const slider = document.querySelector("input.cursor"), box = slider.getBoundingClientRect();
    const share = (slider.value - slider.min) / (slider.max - slider.min);
    const cursor = document.querySelector(".bands .cursor").getBoundingClientRect();
    return box.left + 8 + share * (box.width - 16) - (cursor.left + cursor.right) / 2;
})()"""
"""How far the middle of the thumb is beside the cursor in the bands."""


def sent(page: Page) -> list[list[Any]]:
    """What was sent since the last time."""
    found: list[list[Any]] = json.loads(page.evaluate("JSON.stringify(sent.splice(0))"))
    return found


# The panel.


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRun]:
    with page_run(tmp_path_factory.mktemp("desk"), "run", DESK, "--ui", "--duration", 60) as run:
        yield run


@pytest.fixture
def panel(page: Page, desk: PageRun) -> Page:
    page.size(1600, 1000)
    page.open(desk.url)
    page.wait_for("document.querySelectorAll('.widget').length == 7")
    page.evaluate("document.getElementById('take').click()")
    page.wait_for("document.getElementById('take').hidden")
    page.evaluate(SENT)
    return page


@pytest.mark.parametrize(
    "ending",
    [
        "window.dispatchEvent(new Event('blur'))",
        "document.dispatchEvent(new Event('visibilitychange'))",
        f"{HOLD}.dispatchEvent(new Event('pointercancel'))",
        f"{HOLD}.dispatchEvent(new Event('lostpointercapture'))",
    ],
)
def test_a_hold_button_is_released_with_the_pointer_or_the_focus(panel: Page, ending: str) -> None:
    x, y = panel.point(".hold")
    panel.press(x, y)
    panel.wait_for(f"{HOLD}.getAttribute('aria-pressed') == 'true'")
    time.sleep(0.3)
    signs = sent(panel)
    first, *others = [kind for kind, _, _ in signs]
    assert first == "release"  # of whoever held it before and is gone
    assert len(others) > 4 and {*others} == {"hold"}
    panel.evaluate(ending)
    panel.wait_for(f"{HOLD}.getAttribute('aria-pressed') == 'false'")
    panel.release(x, y)
    time.sleep(0.2)
    kinds = [kind for kind, _, _ in sent(panel)]
    assert kinds[-1] == "release" and kinds.count("release") == 1


def test_a_hold_button_is_held_by_a_key(panel: Page) -> None:
    panel.evaluate(f"{HOLD}.focus()")
    panel.key_down(" ")
    panel.wait_for(f"{HOLD}.getAttribute('aria-pressed') == 'true'")
    panel.key_up(" ")
    panel.wait_for(f"{HOLD}.getAttribute('aria-pressed') == 'false'")
    assert panel.evaluate(STATUS).startswith("running")  # the same key pauses elsewhere
    sent(panel)
    repeated = "new KeyboardEvent('keydown', {key: ' ', repeat: true, bubbles: true})"
    panel.evaluate(f"{HOLD}.dispatchEvent({repeated})")
    assert sent(panel) == []


def test_elements_send_values_in_their_range(panel: Page) -> None:
    panel.click(".switch")
    panel.wait_for("document.querySelector('.switch').getAttribute('aria-checked') == 'true'")
    panel.click(".choice label:last-child span")
    panel.click(".push:not(.hold)")
    number = "document.querySelector('.entry input')"
    for value in (1.25, 9):
        panel.evaluate(f"{number}.value = {value}, {number}.dispatchEvent(new Event('change'))")
    assert panel.evaluate(f"{number}.getAttribute('aria-invalid')") == "true"
    assert sent(panel) == [
        ["panel", "stop", True], ["panel", "mode", "automatic"], ["panel", "start", True],
        ["panel", "w", 1.25],
    ]  # fmt: skip
    panel.click(".switch")


def test_who_watches_cannot_operate_and_reads_why(
    browser: Browser, panel: Page, desk: PageRun
) -> None:
    with browser.page() as other:
        other.open(desk.url)
        other.wait_for("document.querySelectorAll('.widget').length == 7")
        assert other.evaluate("document.querySelectorAll('.widget :enabled').length") == 0
        assert "take control" in other.evaluate("document.getElementById('locked').textContent")
        other.click("#take")
        other.wait_for("document.querySelectorAll('.widget :disabled').length == 0")
        panel.wait_for(f"{HOLD}.disabled")


def test_what_is_done_in_a_pause_comes_with_the_next_step(panel: Page) -> None:
    panel.click("#pause")
    panel.wait_for(f"{STATUS}.startsWith('paused')")
    panel.click(".switch")
    later = "[...document.querySelectorAll('.later')].filter((one) => !one.hidden).length"
    assert panel.evaluate(later) == 1
    panel.click("#step")
    panel.wait_for("document.querySelector('.switch').getAttribute('aria-checked') == 'true'")
    panel.wait_for(f"{later} == 0")
    panel.click("#pause")
    panel.wait_for(f"{STATUS}.startsWith('running')")
    panel.click(".switch")


def test_a_number_out_of_range_stays_marked(panel: Page) -> None:
    number = "document.querySelector('.entry input')"
    panel.evaluate(f"{number}.value = 9, {number}.dispatchEvent(new Event('change'))")
    time.sleep(0.5)  # states come meanwhile
    assert panel.evaluate(f"{number}.value") == "9"
    assert panel.evaluate(f"{number}.nextSibling.textContent") == "has to be in 0 … 1.5"
    panel.evaluate(f"{number}.value = 1, {number}.dispatchEvent(new Event('change'))")
    assert panel.evaluate(f"{number}.nextSibling.textContent") == "0 … 1.5"


# The timeline.


@pytest.fixture(scope="module")
def paused(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageRun]:
    with page_run(tmp_path_factory.mktemp("gate"), "run", GATE, "--ui") as run:
        with browser.page() as page:
            page.open(run.url)
            page.wait_for(f"{LIT} == 'passing'", END_S)
            page.click("#pause")
            wait_paused(page, "passing")
        yield run


def test_the_past_is_looked_at_and_left(page: Page, paused: PageRun) -> None:
    page.size(1600, 1000)
    page.open(paused.url)
    page.wait_for(f"{LIT} == 'passing'")
    now = page.evaluate(TIME)
    for state in ("passing", "opening", "halting"):
        page.key("ArrowLeft")
        page.wait_for(f"{LIT} == '{state}'")
        page.wait_for(f"document.querySelector('.where b').textContent == '{state}'")
        assert abs(page.wait_for(f"[{ALIGNED}]")[0]) < 1
    assert page.evaluate(TIME) < now
    assert page.evaluate("document.getElementById('follow').hidden") is False
    page.click("#follow")
    page.wait_for(f"{LIT} == 'passing' && {TIME} == {now}")
    assert page.evaluate("document.getElementById('follow').hidden") is True


def test_of_many_moments_the_last_one_is_shown(page: Page, paused: PageRun) -> None:
    page.open(paused.url)
    page.wait_for(f"{LIT} == 'passing'")
    page.evaluate(
        """(async () => {
            const {page, on} = await import("/static/state.js");
            window.moments = [];
            on("moment", ({time_s}) => moments.push(time_s));
            for (let n = 1; n <= 40; n += 1)
                page.look(page.end_s * n / 50);
            window.last = page.cursor;
        })()"""
    )
    page.wait_for("window.last && moments.at(-1) == last", 2)
    assert page.evaluate("moments.length") < 5


def test_zoom_leaves_the_cursor_where_it_is(page: Page, paused: PageRun) -> None:
    page.open(paused.url)
    page.wait_for(f"{LIT} == 'passing'")
    place = "document.querySelector('.bands .cursor').getBoundingClientRect().left"
    end = page.evaluate(place)
    page.key("ArrowLeft")
    page.wait_for(f"{place} < {end} - 1")
    before = page.evaluate(place)
    page.key("+")
    page.wait_for("Number(document.querySelector('input.cursor').min) > 0")
    assert page.evaluate(place) == pytest.approx(before, abs=1)
    page.key("0")
    page.wait_for("Number(document.querySelector('input.cursor').min) == 0")


def test_a_recording_opens_where_it_went_wrong(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "late.mcap"
    specc("run", GATE, "--set", "patience=0.3[s]", "--record", file)
    with page_run(tmp_path, "view", file) as run:
        page.open(run.url)
        page.wait_for("document.querySelector('.mark.violation')")
        page.wait_for("location.hash.includes('t=')")
        at_s = page.evaluate(TIME)
        verdicts = "[...document.querySelectorAll('.is-violated .verdict')].map(e => e.textContent)"
        assert page.evaluate(verdicts) == [f"violated at {at_s:.2f} s"]
        tops = "[...document.querySelectorAll('.requirement{}')].map(e => e.offsetTop)"
        violated, others = (
            page.evaluate(tops.format(kind)) for kind in (".is-violated", ":not(.is-violated)")
        )
        assert others and max(violated) < min(others)
        mark = page.evaluate("document.querySelector('.mark.violation').ariaLabel")
        assert float(mark.split()[0]) == pytest.approx(at_s, abs=0.01)


# The end of a run.


def test_a_page_that_is_opened_after_the_end_says_how_it_ended(page: Page, tmp_path: Path) -> None:
    says = "document.getElementById('status')?.textContent.match(/^completed, .*exit code 0$/)?.[0]"
    with page_run(tmp_path, "run", GATE, "--ui", "--duration", 1) as run:
        page.open(run.url)
        page.wait_for(says, END_S)
        page.open("about:blank")
        page.open(run.url)
        page.wait_for(says)


# What the machine waits for.


def test_why_is_of_one_step_and_begins_with_what_is_waited_for(page: Page, paused: PageRun) -> None:
    page.size(1600, 1000)
    page.open(paused.url)
    page.wait_for(f"{LIT} == 'passing'")
    page.wait_for("document.querySelector('.where b').textContent == 'passing'")
    first = "document.querySelector('#reasons .line.condition.judged .text').textContent"
    page.wait_for(f"{first}.startsWith('terminal parcel_gone')")
    assert page.evaluate("document.querySelector('#reasons details').open") is False
    folded = "document.querySelector('#reasons details').textContent"
    assert "Would stop iferror never: False" in page.evaluate(f"{folded}.replace(/[●○–]/g, '')")
    assert page.evaluate("document.querySelectorAll('#reasons details .need').length") == 0
    assert page.evaluate("document.querySelectorAll('#reasons > .lines > .line .need').length") > 0
