"""Texts with errors lose what cannot be understood, and nothing else."""

import random

import pytest

from specc.read import read_text
from specc.schema import ROW_KEYS
from specc.tools.lsp.cursor import outline
from specc.tools.lsp.unfinished import mended
from tests.tools.lsp.workspace import SYSTEM


@pytest.mark.parametrize(
    ("old", "new", "gone"),
    [
        ("  Joints: vector", "  Joi\n  Joints: vector", "  Joi"),
        ("frames: {", "frames: [", None),
        ("        let:\n", "        let:\n          new:\n", "          new:"),
        ("        let:\n", "        let:\n          - [new\n", "          - [new"),
        ("        let:\n", '        let:\n          new: "a b\n', 'new: "a b'),
        ("        let:\n", '        let: "a\n', '"a'),
        (
            "          - [S0, terminal, going, S1]\n",
            "          - [S0, terminal]\n",
            "- [S0, terminal]",
        ),
        ('{is: "0.5[rad]", title', '{is: "0.5[rad]", unit: 1, title', "unit: 1,"),
        ("  DK: {signature", "\tx: 1\n  DK: {signature", "\tx: 1"),
    ],
)
def test_overwrites_the_error_only(old: str, new: str, gone: str | None) -> None:
    assert SYSTEM.count(old) == 1
    text = SYSTEM.replace(old, new)
    document = mended(read_text("arm.yaml", text, ROW_KEYS))
    assert document is not None
    found = document.source.text
    assert len(found) == len(text)
    lost = [a for a, b in zip(text, found, strict=True) if a != b]
    if gone is not None:
        assert "".join(lost) == gone.replace(" ", "")
    else:
        assert len(lost) < 120


@pytest.mark.parametrize("begun", ['"x', "["])
@pytest.mark.parametrize("deeper", ["", "  "])
def test_items_keep_the_key_above_them(begun: str, deeper: str) -> None:
    start, end = SYSTEM.index("          - [S0, terminal, going"), SYSTEM.index("      g: {use")
    rows = SYSTEM[start:end].replace("          - ", f"        {deeper}- ")
    above = SYSTEM[:start].rstrip("\n")
    text = f"{above} {begun}\n{rows}{SYSTEM[end:]}"
    document = mended(read_text("arm.yaml", text, ROW_KEYS))
    assert document is not None
    assert document.source.text == text.replace(f"{above} {begun}", f"{above} {' ' * len(begun)}")


def test_what_is_left_is_always_the_text() -> None:
    rng = random.Random(4)
    understood = 0
    for _ in range(80):
        at = rng.randrange(len(SYSTEM))
        typed = rng.choice(['"', "{", "[", "}", "\n  a", "- ", ": ", "\n\t", ",", "'", "\r\nb"])
        text = SYSTEM[:at] + typed + SYSTEM[at:]
        document = mended(read_text("arm.yaml", text, ROW_KEYS))
        if document is not None:
            understood += 1
            left = document.source.text
            assert all(a in (b, " ") for a, b in zip(left, text, strict=True))
    assert understood > 60


def test_a_text_without_errors_stays_as_it_is() -> None:
    document = mended(read_text("arm.yaml", SYSTEM, ROW_KEYS))
    assert document is not None
    assert document.source.text == SYSTEM


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        ("a:\n  b: [1\n  c: x", "a:\n  b: 0\n  c: x"),
        ("a:\n  b: {c: 1,\n    d: x", "a:\n  b: {c: 1,\n    d: x"),
        ("a:\n  b: >-\n    one\n    two", "a:\n  b: >-\n    one\n    two"),
        ("a: 1\nb:\n- [x\n- [y, ", "a: 0\nb:\n- 0\n- [y, "),
        ("b:\n  - c: 1\n    d: ", "b:\n  - c:\n    d: "),
        ("a: 1\n  ", "a:\n  "),
        ("  'q: r': {\n    a", "  'q: r': {\n    a"),
    ],
)
def test_the_outline_of_a_line(head: str, expected: str) -> None:
    assert outline(head) == expected
