"""What goes wrong with one file hides nothing of the others."""

from pathlib import Path

import pytest

from specc import pipeline
from specc.cli.main import FAULT, main

CHAIN = "\n".join(f"  T{i}: T{i + 1}" for i in range(3000))
HOSTILE = {
    "types nested deep": f"types:\n{CHAIN}\n  T3000: int\n",
    "NUL in use": 'use: ["lib\\0.yaml"]\n',
    "NUL in files": 'files: {f: "data\\0"}\n',
    "NUL in the model": 'plant: {model: "model\\0.xml"}\n',
    "lone surrogate in use": 'use: ["\\ud800.yaml"]\n',
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SPECC_TRACEBACK", raising=False)
    (tmp_path / "wrong.yaml").write_text("specc: 1\nsystem: wrong\nwrong: 1\n")
    return tmp_path


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_is_refused_beside_others(
    text: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "hostile.yaml").write_text(f"specc: 1\nsystem: hostile\n{text}")
    assert main(["validate", "hostile.yaml", "wrong.yaml"]) in (1, 2)
    printed = capsys.readouterr().err
    assert "hostile.yaml:" in printed
    assert "unknown key `wrong`" in printed


@pytest.mark.parametrize("count", [1, 5])
def test_a_fault_of_specc_leaves_the_findings_of_others(
    count: int, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "faulty.yaml").write_text("specc: 1\nsystem: faulty\n")
    for number in range(count):
        (folder / f"{number}.yaml").write_text("specc: 1\nsystem: other\nwrong: 1\n")
    checked = pipeline.check_spec

    def failing(path: str) -> pipeline.Result:
        if path == "faulty.yaml":
            raise RecursionError("too deep")
        return checked(path)

    monkeypatch.setattr(pipeline, "check_spec", failing)
    others = [f"{number}.yaml" for number in range(count)]
    assert main(["validate", "faulty.yaml", *others]) == FAULT
    printed = capsys.readouterr().err
    assert printed.count("unknown key `wrong`") == count
    assert "a fault of specc itself" in printed
    assert "faulty.yaml: RecursionError: too deep" in printed
