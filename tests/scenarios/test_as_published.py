"""What specc finds in section 4 as it was published; docs/errata.md has a line for each."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from specc.pipeline import compile_spec

ROOT = Path(__file__).parents[2]
SPEC = ROOT / "specs/irp_picking_as_published.yaml"
Found = list[tuple[str, str]]

WRONG: Found = [
    ("E0407", "kind: CERT"),
    ("E0319", "f_1: {eq: 5,"),
    ("E0315", "MR(JM(IK(DK(MJ(m_c)) @ AA(PF("),  # (27)
    ("E0315", "MR(JM(IK(DK(MJ(m_c)) @ AA(PF("),
    ("E0315", "q_p: {is:"),  # (30)
    ("E0315", "m_p: {is:"),
    ("E0602", "- [S0, terminal, f_1, S1]"),
    ("E0315", "y.c.O_c: HV(HP("),  # (51)
    ("E0404", "m: {T_d:"),
    ("E0319", "f_1: {eq: 52,"),
    ("E0319", "f_4: {eq: 55,"),
    ("E0319", "f_5: {eq: 56,"),
    ("E0319", "f_7: {eq: 58,"),
    ("E0310", "ce_1: {eq: 62,"),
    ("E0315", "d_o: {is: norm(LR("),  # (67)
    ("E0312", "T_d_Ep: {is:"),  # (69)
    ("E0310", "ce_4: {eq: 71,"),
]
OPEN = {"O0201": 21, "O0202": 18, "O0205": 5, "O0404": 1, "O0601": 3, "O0603": 1}
"""Code -> how often something is not there: T_c, F_m, r_p, m_p, CE; values, the gripper.

T_g, which is compared with a T_c that is not there, may be a member of the enum that T_c is of.
"""

NOTATION = (
    (r"(g: \{d_c: .*\n)        m: \{T_d.*", r'\1        m: {T_c: "pose[B, E]", F_c: "wrench[E]"}'),
    (r"when: T_c == x", "when: DK(MJ(m_c)) == x"),
    (r"T_c == T_g or", "T_c == T_d_Eg or"),
    (r"\bCE\(F_m", "GE(F_m"),
    (r"pose\[B, E[gps]\]", "pose[B, E]"),
    (r"pose\[P, G\]", "pose[E, E]"),
    (r"(?m)^  (E[gps]|P|G): .*\n", ""),
)
"""One name and one frame for each thing, and the buffer that the control subsystem reads."""
THEN_WRONG: Found = [
    ("E0407", "kind: CERT"),
    ("E0319", "f_1: {eq: 5,"),
    ("E0315", "MR(JM(IK(DK(MJ(m_c)) @ AA(PF("),
    ("E0315", "MR(JM(IK(DK(MJ(m_c)) @ AA(PF("),
    ("E0315", "q_p: {is:"),
    ("E0315", "m_p: {is:"),
    ("E0602", "- [S0, terminal, f_1, S1]"),
    ("E0315", "y.c.O_c: HV(HP("),
    ("E0319", "f_1: {eq: 52,"),
    ("E0319", "f_4: {eq: 55,"),
    ("E0319", "f_5: {eq: 56,"),
    ("E0319", "f_6: {eq: 57,"),
    ("E0702", "f_6: {eq: 57,"),
    ("E0319", "f_7: {eq: 58,"),
    ("E0701", "cc_2: {eq: 64,"),
    ("E0315", "d_o: {is: norm(LR("),
]
"""What is wrong whatever things are called: (57) and (64) show once (52) and (57) can be read."""

MENDED = (
    (
        r"when: (DK\(MJ\(m_c\)\)|x\.m\.T_c) == ([\w.]+)([^}]*)\}",
        r'when: "near(\1, \2, 1[mm], 1[deg])\3"}',
    ),
    (r"when: (x\.g\.d_c) == (\w+)([^}]*)\}", r'when: "near(\1, \2, 1[mm])\3"}'),
    (r"SIFT\(C\)\), RGB\(C\), SIFT\(C\)\), RGB", "SIFT(C)), C_c, SIFT(C)), RGB"),
    (r'y: \{m_m: "vector\[6, rad\]"\}', 'y: {m_m: "vector[6, rad]", F_m: "wrench[E]"}'),
    (r'E: \{m_m: "vector\[6, rad\]"\}', 'E: {m_m: "vector[6, rad]", F_m: "wrench[E]"}'),
    (r"GE\(F_m", "GE(x.E.F_m"),
    (r"(          m_d: \{type.*\n)", r"\1          r_p: {type: Velocity}\n"),
    (r"m_p: \{is", "m_d: {is"),
    (r"q_p\)\), m_c\)", "q_p)) - m_c)"),
    (r"norm\(LR\(SO\(O_c\)\)\)", "d_m"),
    (r"m/s, 1/s\]", "m/s, rad/s]"),
    (r"kind: CERT", "kind: CER"),
    (r"y\.c\.T_c: DK\(MJ\(m_c\)\)\}", "y.c.T_c: DK(MJ(m_c)), y.c.F_c: m_f}"),
    (r"(          m_d: \{type.*\n)", r'\1          m_f: {type: "wrench[E]"}\n'),
    (r"x\.k\.O_c\)\)", "x.k.O_c)) if fresh(x.k.O_c) else O_c"),
    (
        r"when: not fresh\(x\.c\.T_d\) or not fresh\(x\.c\.b\) or",
        "when: not fresh(x.c.T_d) and not fresh(x.c.b) or",
    ),
    (r"when: fresh\(x\.c\.T_d\)\}", "when: fresh(x.c.T_d) and not fresh(x.c.b)}"),
)
"""What an author would mend who is told the findings above."""


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


def wrong_in(found: Found) -> Found:
    return [(code, text) for code, text in found if not code.startswith("O")]


def test_what_is_wrong_and_nothing_else() -> None:
    found = wrong_in(found_in(SPEC))
    assert matches(found, WRONG), found


def test_what_is_not_there() -> None:
    assert Counter(code for code, _ in found_in(SPEC) if code.startswith("O")) == OPEN


def mended(path: Path, *repairs: tuple[str, str]) -> Found:
    """What is wrong once the paper is mended."""
    text = SPEC.read_text(encoding="utf-8")
    for pattern, repair in repairs:
        text, count = re.subn(pattern, repair, text)
        assert count, pattern
    path.write_text(text, encoding="utf-8")
    return wrong_in(found_in(path))


def test_what_is_wrong_whatever_things_are_called(tmp_path: Path) -> None:
    found = mended(tmp_path / "mended.yaml", *NOTATION)
    assert matches(found, THEN_WRONG), found


def test_nothing_else_was_hidden_behind_what_was_wrong(tmp_path: Path) -> None:
    assert mended(tmp_path / "mended.yaml", *NOTATION, *MENDED) == []


def test_the_overlap_of_the_published_conditions_is_told_whole(tmp_path: Path) -> None:
    mended(tmp_path / "mended.yaml", *NOTATION)
    for path, states in (
        (SPEC, "`S0` and `S2`"),
        (tmp_path / "mended.yaml", "`S0`, `S1` and `S2`"),
    ):
        (told,) = [d for d in compile_spec(str(path)).diagnostics if d.code == "E0602"]
        assert told.message == (
            f"two rows of states {states} apply when "
            "`fresh(x.c.T_d) or fresh(x.c.b) and all(v in {u, c, g} for v in x.c.b)`"
        )


@pytest.mark.parametrize("code", sorted({*(code for code, _ in WRONG), *OPEN}))
def test_the_errata_list_it(code: str) -> None:
    errata = (ROOT / "docs/errata.md").read_text(encoding="utf-8")
    section = errata.split("## What specc finds in the paper as published", 1)[1]
    assert code in section
