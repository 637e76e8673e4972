"""While a text is no YAML or lacks its shape, what was found before stays where it is."""

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from tests.tools.lsp.workspace import SYSTEM, opened

BROKEN = [
    ("constants:\n", "constants:\n  twice: 1\n  twice: 2\n"),
    ("        let:\n", "        let:\n          new\n"),
    ("        let:\n", '        let:\n          new: {is: "a\n'),
    ("          - [S0, terminal, going, S1]\n", "          - [S0, terminal]\n"),
    ("        states: {", "        stats: 1\n        states: {"),
]


def told(project: Project, path: str, text: str) -> set[tuple[str, str]]:
    """Codes, each with the text at its place."""
    project.put(path, text)
    for root in project.find_roots(path):
        project.analyse(root)
    notes = features.notes(project)[path]
    return {(n.diagnostic.code, text[n.range.start : n.range.end]) for n in notes}


@pytest.mark.parametrize(("old", "new"), BROKEN)
def test_other_errors_stay_where_they_are(old: str, new: str, tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    assert SYSTEM.count(old) == 1
    wrong = SYSTEM.replace("y.c.X_c: T_c, grip", "y.c.X_c: limit, grip")
    assert ("E0310", "limit") in told(project, system, wrong)
    found = told(project, system, wrong.replace(old, new))
    assert ("E0310", "limit") in found
    assert any(code < "E02" for code, _ in found)
    # A second change, elsewhere, moves nothing.
    second = wrong.replace(old, new).replace("frames: {", "# a comment\nframes: {")
    assert ("E0310", "limit") in told(project, system, second)
    # Where the text has changed, nothing is known of it.
    changed = wrong.replace(old, new).replace("y.c.X_c: limit, grip", "grip")
    assert "E0310" not in {code for code, _ in told(project, system, changed)}


@pytest.mark.parametrize(("old", "new"), BROKEN)
def test_nothing_is_told_that_follows_from_the_error(old: str, new: str, tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    before = {code for code, _ in told(project, system, SYSTEM)}
    found = {code for code, _ in told(project, system, SYSTEM.replace(old, new))}
    assert {code for code in found if code >= "E02"} <= before


def test_what_is_missing_is_not_unknown(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    before = {code for code, _ in told(project, system, SYSTEM)}
    text = SYSTEM.replace('          T_c: {is: "DK', '          T_c: {is: ""DK')
    found = told(project, system, text)
    assert {code for code, _ in found} == {"E0009"} | before
