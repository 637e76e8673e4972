"""A package of `specc build --ament`: colcon of both distributions builds it, and robots run it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from specc.cli import main
from tests.ros2.conftest import Start, says
from tests.ros2.launching import launched

pytestmark = [pytest.mark.long, pytest.mark.no_replay("nothing is recorded")]


def test_two_robots_run_a_package_that_colcon_has_built(
    arm: Start, ros: str, spec: Callable[..., Path], tmp_path: Path
) -> None:
    colcon = Path(ros).with_name("colcon")
    if not colcon.is_file():
        pytest.skip(f"no colcon beside {ros}: make ros")
    path = spec(("action: /grasp", "action: grasp"), name="retry")
    workspace = tmp_path / "workspace"
    workspace.mkdir()
    build = ["build", str(path), "--ament", str(workspace / "src/act")]
    assert main(build) == 0
    subprocess.run([str(colcon), "build"], cwd=workspace, check=True)
    assert main([*build, "--check"]) == 0
    for file in (path, path.with_name("grasping.py")):
        file.unlink()

    installed = workspace / "install/act"
    file = installed / "share/act/launch/act.launch.py"
    runs = []
    search = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    (tmp_path / "without/specc.py").parent.mkdir()
    (tmp_path / "without/specc.py").write_text("raise ImportError('the compiler is not needed')")
    robots = (
        ("/left/grasp", {"namespace": "/left"}),
        ("/lab/grasp", {"namespace": "right", "remappings": "grasp:=/lab/grasp"}),
    )
    servers = [arm("server", action, "succeed", program="nodes.py") for action, _ in robots]
    for _, given in robots:
        (command,) = launched(file, installed, **given)
        in_ros = ["sh", "-c", '. install/setup.sh; exec "$0" "$@"', *command]
        environment = {**os.environ, "PATH": search, "PYTHONPATH": str(tmp_path / "without")}
        runs.append(subprocess.Popen(in_ros, cwd=workspace, env=environment))
    try:
        assert all(says(server, "succeeded") for server in servers * 2)
    finally:
        for run in runs:
            run.send_signal(signal.SIGINT)
    assert [run.wait(timeout=60) for run in runs] == [0, 0]
