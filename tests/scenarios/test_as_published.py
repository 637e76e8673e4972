"""What specc finds in section 4 as it was published; docs/errata.md has a line for each."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from specc.pipeline import compile_spec

ROOT = Path(__file__).parents[2]
SPEC = ROOT / "specs/irp_picking_as_published.yaml"
Found = list[tuple[str, str]]

FINDINGS: Found = [
    ("E0407", "kind: CERT"),
    ("E0319", "f_1: {eq: 5,"),
    ("E0201", "y.c.F_c: {eq: 25,"),
    ("E0314", "MR(JM(IK(DK(MJ(x.E.m_m)) @ AA(PF("),
    ("E0214", "r_p: {eq: 29,"),
    ("E0201", "q_p: {eq: 30,"),
    ("E0201", "q_p: {eq: 30,"),
    ("E0214", "m_p: {eq: 31,"),
    ("E0602", "- [S0, terminal, f_1, S1]"),
    ("E0602", "- [S2, terminal, f_1, S1]"),
    ("O0601", "g: # 4.6"),
    ("O0603", "g: # 4.6"),
    ("E0315", "y.c.O_c:"),
    ("E0319", "f_1: {eq: 52,"),
    ("E0319", "f_4: {eq: 55,"),
    ("E0319", "f_5: {eq: 56,"),
    ("E0319", "f_6: {eq: 57,"),
    ("E0319", "f_7: {eq: 58,"),
    ("E0315", "d_o: {eq: 67,"),
]

POSES = r"\1near(\2, \3, 1[mm], 1[deg])"
MENDED = (
    (r"()(DK\(MJ\(x\.E\.m_m\)\)) == (x\.c\.T_d)", POSES),
    (r"()(x\.m\.T_c) == (T_[spg])", POSES),
    (r"()(x\.g\.d_c) == (d_[mo])", r"\1near(\2, \3, 1[mm])"),
    (r"C_sift\), C_rgb, C_sift\), C_rgb", "C_sift), IC(FE(x.R.I_rgb), x.R.I_d, P), C_sift), C_rgb"),
    (r'y: \{m_m: "vector\[6, rad\]"\}', 'y: {m_m: "vector[6, rad]", F_m: "wrench[E]"}'),
    (r'E: \{m_m: "vector\[6, rad\]"\}', 'E: {m_m: "vector[6, rad]", F_m: "wrench[E]"}'),
    (r"GE\(F_m", "GE(x.E.F_m"),
    (
        r"(          m_d: \{type.*\n)",
        r'\1          r_p: {type: Velocity, init: "[0, 0, 0, 0, 0, 0]"}\n',
    ),
    (r"m_p: \{eq: 31", "m_d: {eq: 31"),
    (r"q_p\)\), x\.E\.m_m\)", "q_p)) - x.E.m_m)"),
    (r"norm\(LR\(SO\(O_c\)\)\)", "d_m"),
)
"""What an author would mend first, who is told the findings above."""

THEN: Found = [
    ("E0407", "kind: CERT"),
    ("E0315", "MR(JM(IK(DK(MJ(x.E.m_m)) @ AA(PF("),
    ("E0315", "q_p: {eq: 30,"),
    ("E0315", "m_d: {eq: 31,"),
    ("E0602", "- [S0, terminal, f_1, S1]"),
    ("E0602", "- [S1, terminal, f_1, S1]"),
    ("E0602", "- [S2, terminal, f_1, S1]"),
    ("O0601", "g: # 4.6"),
    ("O0603", "g: # 4.6"),
    ("E0701", "cc_2: {eq: 64,"),
]
"""What was hidden behind it: units in (27) to (31), and what (64) reads in the first period."""


def found_in(path: Path) -> Found:
    """Code and line of text of every finding, in the order of the file."""
    result = compile_spec(str(path))
    places = [(result.sources.span(item.primary), item.code) for item in result.diagnostics]
    lines = path.read_text(encoding="utf-8").splitlines()
    ordered = sorted((span.line, span.col, code) for span, code in places)
    return [(code, lines[line - 1].strip()) for line, _, code in ordered]


def matches(found: Found, expected: Found) -> bool:
    return len(found) == len(expected) and all(
        code == wanted and text.startswith(begin)
        for (code, text), (wanted, begin) in zip(found, expected, strict=True)
    )


def test_what_is_found_and_nothing_else() -> None:
    found = found_in(SPEC)
    assert matches(found, FINDINGS), found


def test_what_is_found_when_that_is_mended(tmp_path: Path) -> None:
    text = SPEC.read_text(encoding="utf-8").replace("objects: objects", f"objects: {ROOT}/specs/objects")
    for pattern, repair in MENDED:
        text, count = re.subn(pattern, repair, text)
        assert count, pattern
    path = tmp_path / "mended.yaml"
    path.write_text(text, encoding="utf-8")
    found = found_in(path)
    assert matches(found, THEN), found


@pytest.mark.parametrize("code", sorted({code for code, _ in FINDINGS + THEN}))
def test_the_errata_list_it(code: str) -> None:
    errata = (ROOT / "docs/errata.md").read_text(encoding="utf-8")
    section = errata.split("## What specc finds in the paper as published", 1)[1]
    assert code in section
