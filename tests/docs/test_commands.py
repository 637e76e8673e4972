"""README.md names every command, and no page names one that there is not."""

import re
from pathlib import Path

import pytest

from specc.cli.arguments import COMMANDS, IMPORTERS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("**/*.md")]
CODE = re.compile(r"^```.*?^```|`[^`\n]+`", re.DOTALL | re.MULTILINE)
COMMENT = re.compile("# .*")
CALLED = re.compile(r"(?<![\w/.-])(?:\.venv/bin/)?specc ((?:import )?[a-z]+)")
NAMES = {c.name for c in COMMANDS} | {f"import {c.name}" for c in IMPORTERS}


def named(page: Path) -> set[str]:
    """The commands that a page calls in code."""
    code = " ".join(CODE.findall(page.read_text(encoding="utf-8")))
    return set(CALLED.findall(COMMENT.sub("", code)))


def test_the_start_page_names_every_command() -> None:
    assert NAMES - named(ROOT / "README.md") == {"import"}, "its formats are named instead"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_that_pages_name_are_there(page: Path) -> None:
    assert named(page) <= NAMES
