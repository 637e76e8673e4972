"""The registry of codes and what its entries promise."""

import re

import pytest

from specc.diagnostics import nearest
from specc.diagnostics.code import Code
from specc.diagnostics.registry import all_codes
from specc.diagnostics.render.explanation import explanation, overview
from specc.read import read_text

READ_FROM_TEXT = [
    code
    for code in all_codes().values()
    if code.id.startswith("E00") and code.id >= "E0007" and not code.failing.startswith("$")
]


@pytest.mark.parametrize("code", all_codes().values(), ids=lambda code: code.id)
def test_every_entry_is_complete(code: Code) -> None:
    assert re.fullmatch(r"[EW]\d{4}", code.id)
    assert not code.title.endswith(".")
    assert code.explanation.endswith(".")
    assert code.failing.strip() != code.passing.strip()
    assert code.severity == ("error" if code.id.startswith("E") else "warning")


@pytest.mark.parametrize("code", READ_FROM_TEXT, ids=lambda code: code.id)
def test_examples_of_reading_fail_and_pass_as_they_say(code: Code) -> None:
    found = read_text("a.yaml", code.failing).diagnostics
    assert [item.code for item in found] == [code.id]
    assert read_text("a.yaml", code.passing).ok


def test_ids_are_in_order_and_listed() -> None:
    codes = all_codes()
    assert list(codes) == sorted(codes)
    assert overview(codes).count("\n") == len(codes)


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
