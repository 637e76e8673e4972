"""The registry of codes and what its entries promise."""

import re
from pathlib import Path
from textwrap import fill

from specc.diagnostics import nearest
from specc.diagnostics.code import MERGED, PAGES, Code, all_codes, explanation, overview

ROOT = Path(__file__).parents[2]
FAMILY = re.compile(r"^\| `([EWO]\d\d)xx`", re.MULTILINE)


def test_every_entry_is_complete() -> None:
    for code in all_codes().values():
        assert re.fullmatch(r"[EWO]\d{4}", code.id)
        assert not code.title.endswith("."), code.id
        assert code.explanation.endswith("."), code.id
        assert code.failing.strip() != code.passing.strip(), code.id
        assert code.severity == {"E": "error", "W": "warning", "O": "open"}[code.id[0]], code.id


def test_ids_are_in_order_and_listed() -> None:
    codes = all_codes()
    assert list(codes) == sorted(codes)
    assert overview(codes).count("\n") == len(codes)


def test_a_former_code_is_part_of_one_with_its_severity() -> None:
    codes = all_codes()
    for former, code in MERGED.items():
        assert former not in codes
        assert former[0] == codes[code].id[0], "settings and exit codes go by the letter"
        assert not former.startswith("W"), "an old ignore comment would suppress too much"


def test_a_page_is_laid_out_as_it_is_read() -> None:
    for code in all_codes().values():
        text = (PAGES / f"{code.id}.md").read_text(encoding="utf-8")
        prose = fill(code.explanation, 100, break_long_words=False, break_on_hyphens=False)
        assert text.split("\n\n")[1] == prose, code.id
        assert text.count(f"```{'console' if code.is_session else 'yaml'}\n") == 2, code.id


def test_the_index_names_every_family() -> None:
    families = FAMILY.findall((ROOT / "docs/diagnostics.md").read_text(encoding="utf-8"))
    assert families == sorted({code[:3] for code in all_codes()}, key=lambda f: (f[1:], f))


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
