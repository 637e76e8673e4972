"""The driver sees what a page does."""

from __future__ import annotations

import time
from pathlib import Path
from struct import unpack

import pytest

from tests.page.browser import Browser, Page

DOCUMENT = """<!doctype html>
<style>
  body { background: white; }
  @media (prefers-color-scheme: dark) { body { background: black; } }
</style>
<button id=b onclick="n.textContent = 'clicked'">B</button><p id=n></p><input id=i>
"""


def test_a_click_and_keys(page: Page) -> None:
    page.show(DOCUMENT)
    page.click("#b")
    assert page.wait_for("n.textContent") == "clicked"
    page.key("Tab")
    for letter in "ab":
        page.key(letter)
    assert page.evaluate("[document.activeElement.id, i.value]") == ["i", "ab"]
    page.key("Tab", shift=True)
    page.evaluate("n.textContent = ''")
    page.key(" ")
    assert page.wait_for("n.textContent") == "clicked"
    assert page.errors() == []


def test_size_and_colours(page: Page, tmp_path: Path) -> None:
    page.show(DOCUMENT)
    page.size(390, 300)
    page.media("dark", reduced_motion=True)
    assert page.evaluate("innerWidth") == 390
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(0, 0, 0)"
    assert page.evaluate("matchMedia('(prefers-reduced-motion: reduce)').matches")
    page.screenshot(tmp_path / "dark.png")
    assert unpack(">II", (tmp_path / "dark.png").read_bytes()[16:24]) == (390, 300)


def test_errors_and_requests_are_seen(page: Page) -> None:
    page.open("data:text/html,<script>console.error('one'); nothing();</script>")
    page.wait_for("document.readyState == 'complete'")
    one, two = page.errors()
    assert one == "one" and "nothing is not defined" in two
    page.evaluate("fetch('http://127.0.0.1:9/x').catch(() => 1)")
    assert "http://127.0.0.1:9/x" in page.requests()


def test_what_does_not_come_is_an_error(page: Page) -> None:
    with pytest.raises(AssertionError, match=r"after 0\.1 s: false is False"):
        page.wait_for("false", 0.1)
    with pytest.raises(AssertionError, match="is not defined"):
        page.evaluate("nothing()")


def test_a_stopped_browser_goes_on(browser: Browser, page: Page) -> None:
    page.evaluate("n = 0; setInterval(() => n++, 10)")
    browser.stop()
    time.sleep(0.5)
    browser.resume()
    before = page.evaluate("n")
    assert before < 40
    page.wait_for(f"n > {before}")
