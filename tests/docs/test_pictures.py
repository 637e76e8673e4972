"""Pictures of specifications in the documentation show what the specifications are now."""

from __future__ import annotations

import re

import pytest

from tests.docs.pictures import FOLDER, PICTURES, ROOT, dot
from tests.seeds import every


@pytest.mark.parametrize("name", every(3, list(PICTURES)))
def test_a_picture_is_of_the_specification_as_it_is(name: str) -> None:
    renew = "python -m tests.docs.pictures renews it"
    assert (FOLDER / f"{name}.dot").read_text(encoding="utf-8") == dot(name), renew
    assert (FOLDER / f"{name}.svg").is_file(), renew


def test_every_picture_is_shown_and_there() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    shown = re.compile(r"pictures/graph/(\w+)\.svg")
    named = {name for page in pages for name in shown.findall(page.read_text(encoding="utf-8"))}
    assert named == set(PICTURES) == {path.stem for path in FOLDER.iterdir()}
