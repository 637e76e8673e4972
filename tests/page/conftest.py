"""One browser for all tests of a worker, where one is installed."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.page.browser import NAMES, Browser, Page, program
from tests.page.fake_server import GATE, Code, written


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    if program() is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")
    started = Browser(tmp_path_factory.mktemp("profile"))
    try:
        yield started
    finally:
        started.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with browser.page() as opened:
        yield opened


@pytest.fixture(scope="session")
def gate(tmp_path_factory: pytest.TempPathFactory) -> Code:
    """The code of the conveyor with a gate."""
    return written(GATE, tmp_path_factory.mktemp("gate"))
