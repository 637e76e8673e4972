"""The picture of the page in the documentation: `python -m tests.docs.page_picture` renews it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2

from tests.house.tree import ROOT
from tests.page.browser import Browser
from tests.page.runs import STATUS, page_run, wait_paused

FILE = ROOT / "docs/pictures/page.webp"
SPEC = "specs/examples/tray_cell.yaml"
STATE = "carrying"
"""Where the run stops for the picture."""
CHOSEN = json.dumps(["plant.part", "cell.c.x.hand.w", "cell.c.x.arm.X_BE"])
BREAKPOINT = f"""
    document.querySelector("#states [id$=-s-{STATE}]")
        .dispatchEvent(new MouseEvent("click", {{bubbles: true}}))
"""
REST_S = 2.0
"""Until all is drawn."""
WIDTH, HEIGHT, SHOWN_WIDTH = 1600, 1000, 1280
QUALITY = 78


def renew() -> None:
    """Write the picture anew, of a run that stops at a breakpoint."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        shot = folder / "page.png"
        browser = Browser(folder / "profile")
        try:
            words = "run", SPEC, "--ui", "--duration", 30
            with page_run(folder, *words) as run, browser.page() as page:
                page.size(WIDTH, HEIGHT)
                page.media("light")
                page.open(run.url)
                page.wait_for("document.querySelector('#states .state')")
                page.key(" ")
                page.wait_for(f"{STATUS}.startsWith('paused')")
                page.evaluate(f"localStorage.setItem('specc signals of tray_cell', '{CHOSEN}')")
                page.open(f"{run.url}&again#machine=cell.c")
                page.wait_for(f"document.querySelector('#states [id$=-s-{STATE}]')")
                page.evaluate(BREAKPOINT)
                page.wait_for("document.getElementById('breaks').textContent.endsWith('1')")
                page.key(" ")
                wait_paused(page, STATE)
                page.wait_for("document.querySelectorAll('#plots article').length == 3")
                time.sleep(REST_S)
                page.screenshot(shot)
        finally:
            browser.close()
        picture = cv2.imread(str(shot))
        size = SHOWN_WIDTH, HEIGHT * SHOWN_WIDTH // WIDTH
        small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(FILE), small, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])


if __name__ == "__main__":
    renew()
