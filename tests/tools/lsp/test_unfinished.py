"""Of a text that was never understood, lines with errors are blank, and no other character."""

import random

import pytest

from specc.read import read_text
from specc.schema import ROW_KEYS
from specc.tools.lsp.unfinished import without_errors
from tests.tools.lsp.workspace import SYSTEM


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        ("  Joints: vector", "  Joi\n  Joints: vector", ["  Joi"]),
        ("        let:\n", "        let:\n          new:\n", ["          new:"]),
        ("        let:\n", "        let:\n          - [new\n", ["          - [new"]),
        ("  DK: {signature", "\tx: 1\n  DK: {signature", ["\tx: 1"]),
    ],
)
def test_overwrites_the_error_only(old: str, new: str, lines: list[str]) -> None:
    assert SYSTEM.count(old) == 1
    text = SYSTEM.replace(old, new)
    found = without_errors(read_text("arm.yaml", text, ROW_KEYS)).source.text
    pairs = zip(text.split("\n"), found.split("\n"), strict=True)
    assert [before for before, after in pairs if before != after] == lines


def test_what_is_left_is_always_the_text() -> None:
    rng = random.Random(4)
    understood = 0
    for _ in range(80):
        at = rng.randrange(len(SYSTEM))
        typed = rng.choice(['"', "{", "[", "}", "\n  a", "- ", ": ", "\n\t", ",", "'", "\r\nb"])
        text = SYSTEM[:at] + typed + SYSTEM[at:]
        document = without_errors(read_text("arm.yaml", text, ROW_KEYS))
        understood += document.ok
        left = document.source.text
        assert all(a in (b, " ") for a, b in zip(left, text, strict=True))
    assert understood > 60


def test_a_text_without_errors_stays_as_it_is() -> None:
    document = without_errors(read_text("arm.yaml", SYSTEM, ROW_KEYS))
    assert document.source.text == SYSTEM
