"""`specc run`: what reaches the runtime and what comes back."""

import sys
from pathlib import Path
from types import ModuleType

import pytest
from specc_runtime.options import Options

from specc.cli import main

pytestmark = pytest.mark.usefixtures("pipeline")


class Runtime(ModuleType):
    """Stands for `specc_runtime.main`; notes its options and the files it was given."""

    outcome: int | BaseException | None = 0
    options: Options

    def run(self, options: Options, page: object = None) -> int | None:
        assert page is None
        self.options = options
        self.files = {path.name for path in options.directory.rglob("*.py")}
        if isinstance(self.outcome, BaseException):
            raise self.outcome
        return self.outcome


@pytest.fixture
def runtime(monkeypatch: pytest.MonkeyPatch) -> Runtime:
    module = Runtime("specc_runtime.main")
    monkeypatch.setitem(sys.modules, "specc_runtime.main", module)
    return module


def test_the_runtime_gets_the_code_the_base_and_the_options(
    workspace: Path, runtime: Runtime
) -> None:
    (workspace / "specs").mkdir()
    (workspace / "good.yaml").rename(workspace / "specs/good.yaml")
    asked = ["--seed", "7", "--cycles", "2", "--report", "r.json", "--video", "v.mp4"]
    asked += ["--renderer", "gl", "--viewer", "--inline"]
    assert main(["run", "specs/good.yaml", *asked]) == 0
    directory = runtime.options.directory
    assert directory.parts[-2:] == ("generated", "good")
    assert runtime.options == Options(
        directory,
        Path("specs"),
        spec="specs/good.yaml",
        seed=7,
        cycles=2,
        report=Path("r.json"),
        video=Path("v.mp4"),
        renderer="gl",
        viewer=True,
        inline=True,
    )
    assert runtime.files == {"__init__.py", "c.py"}
    assert not directory.exists()


def test_options_that_are_not_given_are_left_to_the_runtime(
    workspace: Path, runtime: Runtime, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "good.yaml", "--duration", "1.5"]) == 0
    assert runtime.options == Options(runtime.options.directory, duration_s=1.5, spec="good.yaml")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("outcome", "code"), [(0, 0), (1, 1), (None, 0)])
def test_the_exit_code_is_that_of_the_run(
    workspace: Path, runtime: Runtime, outcome: int | None, code: int
) -> None:
    runtime.outcome = outcome
    assert main(["run", "good.yaml"]) == code


def test_an_exit_of_the_runtime_passes(workspace: Path, runtime: Runtime) -> None:
    runtime.outcome = SystemExit(2)
    with pytest.raises(SystemExit) as stop:
        main(["run", "good.yaml"])
    assert stop.value.code == 2
    assert not runtime.options.directory.exists()


def test_an_exception_of_an_operator_is_shown_in_full(
    workspace: Path, runtime: Runtime, capsys: pytest.CaptureFixture[str]
) -> None:
    runtime.outcome = ZeroDivisionError("in the user's operator")
    assert main(["run", "good.yaml"]) == 1
    assert "ZeroDivisionError: in the user's operator" in capsys.readouterr().err


def test_an_interrupt_ends_the_run(workspace: Path, runtime: Runtime) -> None:
    runtime.outcome = KeyboardInterrupt()
    assert main(["run", "good.yaml"]) == 130
    assert not runtime.options.directory.exists()


def test_a_wrong_spec_is_not_run(
    workspace: Path, runtime: Runtime, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "wrong.yaml"]) == 1
    assert not hasattr(runtime, "options")
    assert "error[E0101]" in capsys.readouterr().err


def test_warnings_are_shown_before_the_run(
    workspace: Path, runtime: Runtime, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "odd.yaml"]) == 0
    assert "warning[W0001]" in capsys.readouterr().err
    assert runtime.options


def test_a_missing_runtime_is_said_so(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "specc_runtime", None)
    monkeypatch.setitem(sys.modules, "specc_runtime.options", None)
    with pytest.raises(SystemExit) as stop:
        main(["run", "good.yaml"])
    assert stop.value.code == 2
    assert "not installed" in capsys.readouterr().err
