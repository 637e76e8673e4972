"""While a run is recorded, its file is nobody else's; once its process is gone, anybody's."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from specc_runtime.clock import WallClock
from specc_runtime.options import UsageError
from specc_runtime.recording.log import Log

from specc.cli.main import main
from tests.recording.runs import CONVEYOR, ROOT, messages

pytestmark = pytest.mark.no_replay("not of runs")


def test_a_second_run_into_the_same_file_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.mcap"
    log = Log(file, WallClock())
    channel = log.channel("/a", "a", {})
    channel.add(0.0, b"1")
    log.flush()
    size = file.stat().st_size
    for command in (["run", str(CONVEYOR), "--duration", "0.1", "--record"], ["recover"]):
        assert main([*command, str(file)]) == 2
        assert "another run is being recorded there" in capsys.readouterr().err
        assert file.stat().st_size == size
    channel.add(1.0, b"2")
    log.close()
    assert [data for _, data in messages(file)["/a"]] == [1, 2]
    assert main(["recover", str(file)]) == 0
    Log(file, WallClock()).close()
    assert messages(file) == {}


def test_the_file_of_a_process_that_was_killed_is_free(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    command = (
        "import os, signal; from pathlib import Path; from specc_runtime.clock import WallClock; "
        f"from specc_runtime.recording.log import Log; Log(Path({str(file)!r}), WallClock()); "
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", command], cwd=ROOT / "runtime", timeout=60, check=False)
    assert file.exists()
    Log(file, WallClock()).close()


def test_a_recording_does_not_follow_a_link(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """To a file that is not there, or to a recording: it may be anybody's."""
    outside, project = tmp_path / "outside", tmp_path / "project"
    outside.mkdir()
    project.mkdir()
    there = outside / "there.mcap"
    Log(there, WallClock()).close()
    before = there.read_bytes()
    for name in ("there.mcap", "new.mcap"):
        link = project / name
        link.symlink_to(outside / name)
        command = ["run", str(CONVEYOR), "--duration", "0.1", "--record", str(link)]
        assert main(command) == 2
        assert f"cannot write {link}: it is a link" in capsys.readouterr().err
        with pytest.raises(UsageError):  # it may have come since
            Log(link, WallClock())
    assert (sorted(outside.iterdir()), there.read_bytes()) == ([there], before)
