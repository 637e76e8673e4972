"""Every specification of the tree keeps the laws; a case has its report as a comment at its head.

A case is `tests/cases/FAMILY/CODE-what.yaml`, or `ok-what.yaml` for one without findings. With
`SPECC_UPDATE_CASES=1` in the environment the heads are rewritten instead of compared.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from specc.diagnostics import text
from specc.diagnostics.code import all_codes
from specc.diagnostics.report import report, resolve
from tests.corpus import CASES, LAWS, ROOT, SPECS, Law, Subject

UPDATE = "SPECC_UPDATE_CASES" in os.environ

NO_SPEC = {
    "E0004": "the file has more than 2 MB",
    "E0021": "its way out depends on where the project lies; see tests/policy/test_reach.py",
    "E0090": "about the output of `specc build`",
    "E0091": "about the output of `specc build`",
    "E0092": "about the output of `specc build`",
    "E0093": "takes hundreds of lets; see tests/lower/test_plan.py",
    "E0094": "about the formatter",
    "E0095": "about the output of `specc build`",
    **dict.fromkeys(
        (code for code in all_codes() if code[1:3] == "08"), "about the input of `specc import`"
    ),
    **dict.fromkeys(
        (code for code in all_codes() if code[1:3] == "10"),
        "found by `specc explore`; see tests/explore",
    ),
    **dict.fromkeys(
        (code for code in all_codes() if code[1:3] == "11"),
        "found by `specc coverage`; see tests/coverage",
    ),
    "W0901": "comments are judged after compiling; see tests/policy",
    "E0903": "comments are judged after compiling; see tests/policy",
    "E0905": "about settings, not about a specification",
}
"""Codes that no specification has, with the reason."""


def told_of(subject: Subject) -> str:
    """The report about a specification, as it is printed in its own folder."""
    found = resolve(subject.result.diagnostics, subject.result.sources)
    return text.render(report(found, [subject.name]))


def head_and_body(content: bytes) -> tuple[str, bytes]:
    """The leading comment without its marks, and the rest."""
    lines = content.removeprefix(b"\xef\xbb\xbf").splitlines(keepends=True)
    count = next((i for i, line in enumerate(lines) if not line.startswith(b"#")), len(lines))
    head = b"".join(line[1:].removeprefix(b" ") for line in lines[:count])
    return head.decode(), b"".join(lines[count:])


def with_head(content: bytes, head: str) -> bytes:
    """The content of a case with another leading comment."""
    mark = b"\xef\xbb\xbf" if content.startswith(b"\xef\xbb\xbf") else b""
    comment = "".join(f"# {line}".rstrip() + "\n" for line in head.splitlines())
    return mark + comment.encode() + head_and_body(content)[1]


def update(case: Path) -> None:
    """Rewrite the head until it is the report about the file that begins with it."""
    for _ in range(5):
        content = case.read_bytes()
        renewed = with_head(content, told_of(Subject(case.name)))
        if renewed == content:
            return
        case.write_bytes(renewed)
    raise AssertionError(f"the report about {case} does not settle")


FILES = [*CASES, *SPECS]
TURNS = 8


@pytest.mark.parametrize("number", range(len(FILES)), ids=lambda number: name_of(FILES[number]))
def test_a_file_keeps_the_laws(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The short form of the test below: of the laws each file keeps an eighth, by turns."""
    keeps(FILES[number], LAWS[number % TURNS :: TURNS], monkeypatch)


@pytest.mark.long
@pytest.mark.parametrize("path", FILES, ids=lambda path: name_of(path))
def test_a_file_keeps_every_law(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keeps(path, LAWS, monkeypatch)


def name_of(path: Path) -> str:
    return f"{path.parent.name}/{path.stem}"


def keeps(path: Path, laws: Sequence[Law], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    is_case = path.is_relative_to(ROOT / "tests")
    if UPDATE and is_case:
        update(path)
    subject = Subject(path.name)
    if is_case:
        the_report_is_at_the_head(path, subject)
    for law in laws:
        law(subject)


def the_report_is_at_the_head(case: Path, subject: Subject) -> None:
    expected = head_and_body(case.read_bytes())[0]
    found = told_of(subject)
    assert found.splitlines() == expected.splitlines()
    wanted = case.stem.split("-")[0]
    # A small specification leaves much open that is not its subject.
    heads = ("error[", "open[") if wanted.startswith("O") else SEVERITIES
    codes = {line.split("[")[1][:5] for line in found.splitlines() if line.startswith(heads)}
    codes -= EVERYWHERE - {wanted}
    assert codes == (set() if wanted == "ok" else {wanted})


SEVERITIES = ("error[", "warning[")
EVERYWHERE = {"O0503"}
"""Most plants of cases have no task."""


def test_every_code_has_a_case_or_a_reason() -> None:
    with_case = {case.stem.split("-")[0] for case in CASES} - {"ok"}
    assert with_case | NO_SPEC.keys() == all_codes().keys()
    assert not with_case & NO_SPEC.keys()


def test_every_family_accepts_something() -> None:
    families = {case.parent for case in CASES}
    assert families == {case.parent for case in CASES if case.name.startswith("ok-")}
