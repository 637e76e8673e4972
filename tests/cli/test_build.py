"""`specc build`: all of the output or none of it, and comparing without writing."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from specc import output
from specc.atomic_files import remove_stale
from specc.cli import main

pytestmark = pytest.mark.usefixtures("pipeline")


def tree(directory: Path) -> dict[str, str]:
    return {
        path.relative_to(directory).as_posix(): path.read_text()
        for path in sorted(directory.rglob("*"))
        if path.is_file() and path.name != output.MARKER
    }


def test_build_writes_a_directory_per_system(workspace: Path) -> None:
    assert main(["build", "good.yaml", "odd.yaml"]) == 0
    assert tree(workspace / "generated") == {
        "good/__init__.py": "",
        "good/arm/c.py": "system\n",
        "odd/__init__.py": "",
        "odd/arm/c.py": "system\nodd\n",
    }
    assert main(["build", "good.yaml", "--out", "else/where"]) == 0
    assert (workspace / "else/where/good/arm/c.py").is_file()


def test_without_out_code_goes_into_the_project_and_its_place_is_said(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    inner = workspace / "robot/specs"
    inner.mkdir(parents=True)
    (inner / "good.yaml").write_text("system: good\n")
    assert main(["build", "robot/specs/good.yaml"]) == 0
    assert "\nbuilt robot/specs/generated/good\n" in capsys.readouterr().err
    (workspace / "robot/pyproject.toml").touch()
    monkeypatch.chdir(inner)
    assert main(["build", "good.yaml"]) == 0
    assert f"\nbuilt {workspace}/robot/generated/good\n" in capsys.readouterr().err
    assert main(["build", "good.yaml", "--check"]) == 0
    assert "built" not in capsys.readouterr().err
    assert main(["build", "good.yaml", "--format", "json"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("more", [[], ["--check"]])
def test_systems_of_one_name_do_not_replace_each_other(
    more: list[str], workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (workspace / "sub").mkdir()
    (workspace / "pyproject.toml").touch()
    (workspace / "sub/good.yaml").write_text("system: good\nodd: 1\n")
    main(["build", "good.yaml"])
    before = tree(workspace / "generated")
    assert main(["build", "good.yaml", "sub/good.yaml", "./good.yaml", *more]) == 2
    assert "the system of good.yaml goes here" in capsys.readouterr().err
    assert tree(workspace / "generated") == before


def test_a_directory_of_output_is_open_to_others(workspace: Path) -> None:
    main(["build", "good.yaml"])
    ordinary = workspace / "ordinary"
    ordinary.mkdir()
    assert (workspace / "generated/good").stat().st_mode == ordinary.stat().st_mode


def test_a_wrong_spec_writes_nothing_and_keeps_what_was_there(workspace: Path) -> None:
    main(["build", "good.yaml"])
    before = tree(workspace / "generated")
    (workspace / "good.yaml").write_text("system: good\nwrong: 1\n")
    assert main(["build", "good.yaml"]) == 1
    assert tree(workspace / "generated") == before


def test_files_of_an_earlier_build_do_not_survive(workspace: Path) -> None:
    main(["build", "good.yaml"])
    (workspace / "generated/good/old.py").write_text("")
    assert main(["build", "good.yaml"]) == 0
    assert not (workspace / "generated/good/old.py").exists()
    assert [path.name for path in (workspace / "generated").iterdir()] == ["good"]


def test_output_that_is_up_to_date_is_not_touched(workspace: Path) -> None:
    main(["build", "good.yaml"])
    path = workspace / "generated/good/arm/c.py"
    os.utime(path, (1, 1))
    assert main(["build", "good.yaml"]) == 0
    assert path.stat().st_mtime == 1


def test_check_lists_stale_missing_and_left_over_files(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", "good.yaml", "--check"]) == 1
    assert not (workspace / "generated").exists()
    assert capsys.readouterr().err.count("nothing has been built here yet") == 1
    main(["build", "good.yaml"])
    assert main(["build", "good.yaml", "--check"]) == 0
    good = workspace / "generated/good"
    (good / "arm/c.py").write_text("edited")
    (good / "__init__.py").unlink()
    (good / "old.py").write_text("")
    (good / "__pycache__").mkdir()
    (good / "__pycache__/c.pyc").write_bytes(b"")
    before = tree(good)
    capsys.readouterr()
    assert main(["build", "good.yaml", "--check", "--format", "json"]) == 1
    found = json.loads(capsys.readouterr().out)["diagnostics"]
    assert [(item["location"]["file"], item["message"]) for item in found] == [
        ("generated/good/__init__.py", "the file is missing"),
        ("generated/good/arm/c.py", "the file is stale"),
        ("generated/good/old.py", "the file is left over"),
    ]
    assert {item["code"] for item in found} == {"E0092"}
    assert tree(good) == before


def test_a_directory_of_somebody_else_is_not_replaced(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    theirs = workspace / "generated/good"
    theirs.mkdir(parents=True)
    (theirs / "thesis.tex").write_text("years of work")
    assert main(["build", "good.yaml"]) == 2
    assert "error[E0091]" in capsys.readouterr().err
    assert tree(theirs) == {"thesis.tex": "years of work"}
    (workspace / "generated/odd").write_text("a file")
    assert main(["build", "odd.yaml"]) == 2
    assert (workspace / "generated/odd").read_text() == "a file"


def test_a_refusal_of_the_system_is_a_diagnostic(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (workspace / "file").write_text("")
    assert main(["build", "good.yaml", "--out", "file/below"]) == 2
    assert "error[E0090]" in capsys.readouterr().err


@pytest.mark.parametrize("fault", [KeyboardInterrupt, PermissionError(13, "Permission denied")])
def test_output_survives_a_write_that_does_not_end(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, fault: BaseException
) -> None:
    main(["build", "good.yaml"])
    before = tree(workspace / "generated")
    (workspace / "good.yaml").write_text("system: good\nmore: 1\n")

    def refuse(*_arguments: object) -> None:
        raise fault

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", refuse)
        assert main(["build", "good.yaml"]) in (2, 130)
    assert tree(workspace / "generated") == before
    original = Path.rename

    def refuse_new(path: Path, target: Path) -> Path:
        if path.name == "new":
            raise fault
        return original(path, target)

    monkeypatch.setattr(Path, "rename", refuse_new)
    assert main(["build", "good.yaml"]) in (2, 130)
    assert tree(workspace / "generated") == before


@pytest.mark.parametrize("renamed", [0, 1, 2])
def test_what_gives_way_is_back_after_a_kill_between_two_renames(
    renamed: int, tmp_path: Path
) -> None:
    """The next process that writes beside it puts it back, unless the new one is there."""
    old, new, where = {"a.py": "old\n"}, {"b.py": "new\n"}, tmp_path / "generated/good"
    assert not output.write(where, old)
    code = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "from specc import output\n"
        "rename, left = Path.rename, [int(sys.argv[1])]\n"
        "def counted(path, target):\n"
        "    if not left[0]: os.kill(os.getpid(), signal.SIGKILL)\n"
        "    left[0] -= 1\n"
        "    return rename(path, target)\n"
        "Path.rename = counted\n"
        "output.write(Path(sys.argv[2]), {'b.py': 'new\\n'})\n"
    )
    command = [sys.executable, "-c", code, str(renamed), str(where)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(command, env=environment, check=False)
    assert done.returncode == (0 if renamed == 2 else -signal.SIGKILL)
    assert where.exists() == (renamed != 1)
    remove_stale.cache_clear()  # of another process
    remove_stale(str(where.parent))
    assert tree(where) == (new if renamed == 2 else old)
    assert [path.name for path in where.parent.iterdir()] == ["good"]
    assert not output.write(where, new)
    assert tree(where) == new


def test_a_link_keeps_pointing_to_the_output(workspace: Path) -> None:
    real = workspace / "real"
    real.mkdir()
    (workspace / "generated").mkdir()
    (workspace / "generated/good").symlink_to(real)
    assert main(["build", "good.yaml"]) == 0
    assert (workspace / "generated/good").is_symlink()
    assert tree(real) == {"__init__.py": "", "arm/c.py": "system\n"}
