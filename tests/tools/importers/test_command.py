"""`specc import` on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.cli.main import main
from tests.tools.importers.conftest import FILES

PRESS = str(FILES / "press.xml")


def test_a_specification_goes_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", "fabric", PRESS]) == 0
    printed = capsys.readouterr()
    assert "\nspecc: 1\nsystem: press\n" in printed.out
    assert printed.err.endswith("1 file checked: 0 errors, 8 warnings\n")


@pytest.mark.parametrize(
    ("source", "file"),
    [("fabric", path) for path in sorted(FILES.glob("*.xml"))]
    + [("scxml", path) for path in sorted(FILES.glob("*.scxml"))],
    ids=lambda value: getattr(value, "name", value),
)
def test_what_is_written_is_in_the_canonical_layout(
    source: str, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if main(["import", source, str(file), "--out", "a.yaml"]) == 0:
        assert main(["fmt", "--check", "a.yaml"]) == 0


def test_what_cannot_be_written_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    out = tmp_path / "a.yaml"
    out.write_text("# by hand\n")
    assert main(["import", "fabric", PRESS, "--out", str(out), "--force"]) == 2
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [
        ("a.yaml", "# by hand\n")
    ]


def test_a_file_that_is_there_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "press.yaml"
    assert main(["import", "fabric", PRESS, "--out", str(out)]) == 0
    out.write_text("# by hand\n")
    assert main(["import", "fabric", PRESS, "--out", str(out)]) == 2
    assert "`--force` replaces it" in capsys.readouterr().err
    read = tmp_path / "press.xml"
    read.write_bytes(Path(PRESS).read_bytes())
    assert main(["import", "fabric", str(read), "--out", str(read), "--force"]) == 2
    assert "is an input of this command" in capsys.readouterr().err
    assert out.read_text() == "# by hand\n"
    assert main(["import", "fabric", PRESS, "--out", str(out), "--force"]) == 0
    assert "system: press" in out.read_text()
    assert main(["import", "fabric", PRESS, "--out", str(tmp_path / "no" / "dir.yaml")]) == 2


def test_errors_and_unreadable_files_have_their_exit_codes(tmp_path: Path) -> None:
    broken = tmp_path / "a.xml"
    broken.write_text("<subsystem_definition/>")
    assert main(["import", "fabric", str(broken)]) == 1
    assert main(["import", "scxml", str(tmp_path / "none.scxml")]) == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ["import"],
        ["import", "uml", "a.xml"],
        ["import", "fabric", PRESS, "--period", "0"],
        ["import", "fabric", PRESS, "--connect", "a=b"],
        ["import", "scxml"],
    ],
)
def test_wrong_usage(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
