"""`specc witness`: what it writes, refuses and says."""

from pathlib import Path

import pytest

from specc.cli import main
from specc.tools.witness.subject import Refutation
from specc.tools.witness.text import file_name

CASES = Path(__file__).resolve().parents[1] / "cases"
OVERLAP = CASES / "machines" / "E0602-both-fresh.yaml"
NAME = "test_a__m__S0__terminal__E0602.py"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_says_what_it_wrote(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["witness", str(OVERLAP)]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"specc: wrote witnesses/{NAME}: E0602: a.m: two rows of state `S0`")
    assert [path.name for path in (here / "witnesses").iterdir()] == [NAME]


def test_its_own_file_is_written_anew_and_no_other(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = here / "out" / NAME
    assert main(["witness", str(OVERLAP), "--out", "out"]) == 1
    written = path.read_text(encoding="utf-8")
    path.write_text(written + "\n# changed\n", encoding="utf-8")
    assert main(["witness", str(OVERLAP), "--out", "out"]) == 1
    assert path.read_text(encoding="utf-8") == written
    path.write_text("# mine\n", encoding="utf-8")
    assert main(["witness", str(OVERLAP), "--out", "out"]) == 2
    assert path.read_text(encoding="utf-8") == "# mine\n"
    assert "is not a test for this specification and is left as it is" in capsys.readouterr().err
    other = here / "other.yaml"
    other.write_text(OVERLAP.read_text(encoding="utf-8"), encoding="utf-8")
    path.write_text(written, encoding="utf-8")
    assert main(["witness", str(other), "--out", "out"]) == 2
    assert path.read_text(encoding="utf-8") == written
    path.unlink()
    path.mkdir()
    assert main(["witness", str(OVERLAP), "--out", "out"]) == 2


def test_nothing_is_refuted(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["witness", str(CASES / "machines" / "ok-counter.yaml")]) == 0
    assert "there is no error that a run can show" in capsys.readouterr().err
    assert main(["witness", str(CASES / "machines" / "E0608-two-writers.yaml")]) == 0
    assert "errors of other kinds" in capsys.readouterr().err
    assert main(["witness", str(OVERLAP), "--code", "e0601"]) == 0
    assert "without these there is E0602 in a.m, state S0" in capsys.readouterr().err
    assert main(["witness", str(CASES / "open" / "O0401-no-agents.yaml")]) == 0
    assert not (here / "witnesses").exists()


@pytest.mark.parametrize(
    ("option", "value", "hint"),
    [
        ("--code", "E0604", "did you mean"),
        ("--code", "x", "there are E0601, E0602"),
        ("--subsystem", "a.n", "did you mean a.m"),
        ("--subsystem", "b", "there are a.c, a.m"),
        ("--state", "s1", "there are S0"),
    ],
)
def test_unknown_names(
    here: Path, capsys: pytest.CaptureFixture[str], option: str, value: str, hint: str
) -> None:
    assert main(["witness", str(OVERLAP), option, value]) == 2
    said = capsys.readouterr().err
    assert repr(value) in said and hint in said
    assert list(here.iterdir()) == []


def test_options_choose(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen = ["--code", "e0602", "--subsystem", "a.m", "--state", "S0"]
    assert main(["witness", str(OVERLAP), *chosen]) == 1
    assert (here / "witnesses" / NAME).exists()


def test_a_file_that_cannot_be_read(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["witness", "missing.yaml"]) == 2
    (here / "broken.yaml").write_text("a: [\n", encoding="utf-8")
    assert main(["witness", "broken.yaml"]) in (1, 2)
    assert "error[" in capsys.readouterr().err


def test_a_folder_that_cannot_be_written(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "out").write_text("a file\n", encoding="utf-8")
    assert main(["witness", str(OVERLAP), "--out", "out"]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_tests_of_different_inputs_have_different_names() -> None:
    inputs = [("p", "q_r"), ("p_q", "r"), ("p_", "q"), ("p", "_q"), ("p__q", "r"), ("p", "q__r")]
    found = [Refutation("E0701", "a.m", "S0", None, "", absent=name) for name in inputs]
    assert len(set(map(file_name, found))) == len(inputs)
