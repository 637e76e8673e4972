"""Every code's failing example has it and its passing example does not."""

import re
from pathlib import Path

import pytest

from specc.cli import main
from specc.diagnostics.code import Code, all_codes
from tests.diagnostics.splice import said_about, whole, workspace
from tests.seeds import short

pytestmark = pytest.mark.no_replay("the recording beside the examples is empty")
# An example would change the environment that tests run in, or runs; the named test has its own.
NOT_TRIED = {
    "E0094": "tests/emit/test_refusals.py",
    "W1101": "tests/coverage/test_command.py",
    "W1102": "tests/coverage/test_command.py",
}
CODES = tuple(code for code in all_codes().values() if code.id not in NOT_TRIED)
# What examples may do on the machine of somebody who tests.
HARMLESS = {"specc", "mkdir", "ln", "printf", "touch", "echo", "sed", "cp", "mv"}
FOUND = re.compile(r"^(?:error|warning|open)\[([EWO]\d{4})\]", re.MULTILINE)


def codes_found(
    code: Code, example: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> set[str]:
    if code.is_session:
        return set(FOUND.findall(said_about(example, folder)))
    (folder / "spec.yaml").write_bytes(whole(example, code.within).encode())
    # Some things are found out only while code is generated.
    command = {"E009": "build", "W100": "explore"}.get(code.id[:4], "validate")
    assert main([command, "spec.yaml"]) in (0, 1, 2)
    return set(FOUND.findall(capsys.readouterr().err))


@pytest.mark.parametrize("code", short(CODES, *range(1, len(CODES), 4)), ids=lambda code: code.id)
def test_the_failing_example_has_the_code(
    code: Code, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    failing = tmp_path / "failing"
    monkeypatch.chdir(workspace(failing))
    found = codes_found(code, code.failing, failing, capsys)
    assert code.id in found
    assert {other for other in found if other.startswith("E")} <= {code.id}


@pytest.mark.parametrize("code", short(CODES, *range(0, len(CODES), 4)), ids=lambda code: code.id)
def test_the_passing_example_has_no_error(
    code: Code, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    passing = tmp_path / "passing"
    monkeypatch.chdir(workspace(passing))
    found = codes_found(code, code.passing, passing, capsys)
    assert code.id not in found
    if code.within != "any YAML file":
        assert {other for other in found if other.startswith("E")} == set()


def test_commands_of_examples_are_harmless() -> None:
    for code in CODES:
        for example in (code.failing, code.passing) if code.is_session else ():
            lines = [line.removeprefix("$ ").split("#")[0] for line in example.splitlines()]
            programs = {part.split()[0] for line in lines for part in line.split(";")}
            assert programs <= HARMLESS, code.id


def test_the_host_is_without_findings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(workspace(tmp_path))
    (tmp_path / "spec.yaml").write_text(whole("{}", "a specification"))
    assert main(["validate", "--strict", "spec.yaml"]) == 0
    capsys.readouterr()
