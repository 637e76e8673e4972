"""Random tests draw the same examples in every run; signals reach what tests start.

Whatever tests recorded is replayed.
"""

import signal
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# No test asserts a time: on a busy machine any example may be slow.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("same")

# A shell's background job ignores these, and so would every process that a test starts.
for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, signal.SIG_DFL)

replayed: set[tuple[Path, int]] = set()
"""Recordings, each with its date."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Replay what a test has recorded in the folders that it was given, unless it says why not."""
    result = yield
    folders = [f for f in getattr(item, "funcargs", {}).values() if isinstance(f, Path)]
    for folder in folders if item.get_closest_marker("no_replay") is None else ():
        for file in sorted(folder.rglob("*.mcap")):
            known = file, file.stat().st_mtime_ns
            if known not in replayed:
                replayed.add(known)
                replay(file, folder)
    return result


def replay(file: Path, folder: Path) -> None:
    """Compare a recording with what the specification in it does."""
    from tests.recording.replayed import differences

    found = differences(file, folder)
    assert not found, f"{file} is not what its replay is: {'; '.join(found)}"
