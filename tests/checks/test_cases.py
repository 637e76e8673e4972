"""Small specifications, each with the report that it gets as a comment at its head.

A case is `tests/cases/FAMILY/CODE-what.yaml`, or `ok-what.yaml` for one without findings. With
`SPECC_UPDATE_CASES=1` in the environment the heads are rewritten instead of compared.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from specc.diagnostics.code import all_codes
from specc.diagnostics.render import text
from specc.diagnostics.report import report, resolve
from specc.pipeline import compile_spec

CASES = Path(__file__).resolve().parents[1] / "cases"
FILES = sorted(CASES.glob("*/*.yaml"))
UPDATE = "SPECC_UPDATE_CASES" in os.environ

NO_SPEC = {
    "E0002": "the path is a directory",
    "E0003": "the file cannot be opened",
    "E0004": "the file has more than 2 MB",
    "E0007": "the head of a case would make the file not empty for a reader of the test",
    "E0021": "its way out depends on where the project lies; see tests/policy/test_reach.py",
    "E0090": "about the output of `specc build`",
    "E0091": "about the output of `specc build`",
    "E0092": "about the output of `specc build`",
    "E0093": "takes hundreds of lets; see tests/lower/test_plan.py",
    "E0222": "takes a hundred lets; see tests/emit/test_refusals.py",
    "E0094": "about the formatter",
    **dict.fromkeys(
        (code for code in all_codes() if code[1:3] == "08"), "about the input of `specc import`"
    ),
    **dict.fromkeys(
        (code for code in all_codes() if code[1:3] == "10"),
        "found by `specc explore`; see tests/explore",
    ),
    "W0901": "comments are judged after compiling; see tests/policy",
    "E0902": "comments are judged after compiling; see tests/policy",
    "E0903": "comments are judged after compiling; see tests/policy",
    "E0904": "comments are judged after compiling; see tests/policy",
    "E0905": "about settings, not about a specification",
}
"""Codes that no specification has, with the reason."""


def found_in(case: Path) -> str:
    """The report about a case, run from its own folder."""
    result = compile_spec(case.name)
    return text.render(report(resolve(result.diagnostics, result.sources), [case.name]))


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
        renewed = with_head(content, found_in(case))
        if renewed == content:
            return
        case.write_bytes(renewed)
    raise AssertionError(f"the report about {case} does not settle")


@pytest.mark.parametrize("case", FILES, ids=lambda case: f"{case.parent.name}/{case.stem}")
def test_a_case_gets_the_report_at_its_head(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(case.parent)
    if UPDATE:
        update(case)
    expected = head_and_body(case.read_bytes())[0]
    found = found_in(case)
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


@pytest.mark.parametrize("code", all_codes())
def test_every_code_has_a_case_or_a_reason(code: str) -> None:
    has_case = any(case.name.startswith(f"{code}-") for case in FILES)
    assert has_case != (code in NO_SPEC)


def test_every_family_accepts_something() -> None:
    families = {case.parent for case in FILES}
    assert families == {case.parent for case in FILES if case.name.startswith("ok-")}


def test_reasons_are_about_existing_codes() -> None:
    assert NO_SPEC.keys() <= all_codes().keys()
