"""Losses that a specification answers, of real nodes that fall silent, end or are killed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from threading import Thread

import pytest

from specc.cli import main
from tests.recording.runs import messages
from tests.ros2.conftest import Start, end, says

pytestmark = [pytest.mark.long, pytest.mark.no_replay("a test here replays its own recording")]
Spec = Callable[..., Path]
SHORT_LEASE = """\
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="soon" is_default_profile="true">
    <rtps><builtin><discovery_config>
      <leaseDuration><sec>2</sec></leaseDuration>
      <leaseAnnouncement><sec>0</sec><nanosec>500000000</nanosec></leaseAnnouncement>
    </discovery_config></builtin></rtps>
  </participant>
</profiles>
"""
"""For how long a process may say nothing until it is gone: not 20 s, as in ROS, but 2 s."""


def states(record: Path) -> list[str]:
    """The states of the control subsystem, one after the other."""
    steps = [data for _, data in messages(record)["/a.c"]]
    return [data["state"] for data in steps if data["before"] != data["state"]]


def losses(record: Path) -> int:
    """How many goals were lost before one succeeded."""
    seen = states(record)
    count = len(seen) // 2 - 1
    assert seen == ["S0", "waiting"] * count + ["S0", "done"]
    return count


def test_topics_that_fall_silent_and_come_back(arm: Start, spec: Spec, tmp_path: Path) -> None:
    arm("moody", "/losses/a/c", "fast", program="nodes.py")
    path, record = spec(name="losses"), tmp_path / "run.mcap"
    assert main(["run", str(path), "--cycles", "2", "--record", str(record)]) == 0
    assert states(record) == ["slow", "fast", "slow", "fast", "slow"]
    assert main(["replay", str(record), "--spec", str(path), "--check"]) == 0


def test_a_server_that_ends_and_one_that_is_replaced(
    arm: Start, spec: Spec, tmp_path: Path
) -> None:
    served = ["/grasp", "/restarted/a/c", "waiting", "leave", "swap", "serve"]
    server = arm("mortal", *served, program="nodes.py")
    path, record = spec(name="restarted"), tmp_path / "run.mcap"
    assert main(["run", str(path), "--cycles", "1", "--record", str(record)]) == 0
    assert end(server).splitlines()[:3] == ["leave", "swap", "succeed"]
    # A goal was lost with the server, others before there was one again, one with the next server.
    assert losses(record) >= 3
    assert main(["replay", str(record), "--spec", str(path), "--check"]) == 0


def test_a_server_that_is_killed_and_started_again(
    arm: Start, spec: Spec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    profile = tmp_path / "profile.xml"
    profile.write_text(SHORT_LEASE, encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))
        server = arm("server", "/grasp", "wait", program="nodes.py")
    path, record = spec(name="restarted"), tmp_path / "run.mcap"

    def restart() -> None:
        assert says(server, "wait 200")
        server.kill()
        arm("server", "/grasp", "succeed", program="nodes.py")

    restarting = Thread(target=restart)
    restarting.start()
    assert main(["run", str(path), "--cycles", "1", "--record", str(record)]) == 0
    restarting.join()
    assert losses(record) >= 1  # others before the new one was there
