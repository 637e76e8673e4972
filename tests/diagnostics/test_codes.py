"""The registry of codes and what its entries promise."""

import re
from pathlib import Path

import pytest

from specc.diagnostics import nearest
from specc.diagnostics.code import Code
from specc.diagnostics.registry import all_codes
from specc.diagnostics.render.explanation import explanation, overview
from specc.diagnostics.render.page import page

PAGE = Path(__file__).parents[2] / "docs/diagnostics.md"


@pytest.mark.parametrize("code", all_codes().values(), ids=lambda code: code.id)
def test_every_entry_is_complete(code: Code) -> None:
    assert re.fullmatch(r"[EWO]\d{4}", code.id)
    assert not code.title.endswith(".")
    assert code.explanation.endswith(".")
    assert code.failing.strip() != code.passing.strip()
    assert code.severity == {"E": "error", "W": "warning", "O": "open"}[code.id[0]]


def test_ids_are_in_order_and_listed() -> None:
    codes = all_codes()
    assert list(codes) == sorted(codes)
    assert overview(codes).count("\n") == len(codes)


def test_the_page_of_codes_is_fresh() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(all_codes()), (
        "print it anew: specc explain --page > docs/diagnostics.md"
    )


def test_an_explanation_shows_both_examples_and_no_raw_control_character() -> None:
    text = explanation(Code("E0006", "t", "Why.", 'a: "\x07"\n', "b:\n  c: 1\n"))
    assert text.startswith("E0006 (error): t\n\nWhy.\n")
    assert '    a: "\\x07"\n' in text
    assert text.endswith("    b:\n      c: 1\n")


def test_nearest_names() -> None:
    assert nearest("rat", ["rate", "x", "table"]) == ["rate"]
    assert nearest("FRAMES", ["frames"]) == ["frames"]
    assert nearest("zzz", ["rate"]) == []
    assert len(nearest("state10", [f"state{n}" for n in range(10)])) == 3
    assert nearest("a" * 100_000, ["a" * 99_999]) == []
