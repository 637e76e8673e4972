"""Random tests draw the same examples for the same seed; signals reach what tests start.

Whatever tests recorded is replayed, and the garbage of proofs does not pile up.
"""

import gc
import os
import signal
from collections import deque
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, core, settings

from tests import compiled, seeds
from tests.memory import settle
from tests.seeds import SEED, how_many

# No test asserts a time: on a busy machine any example may be slow.
settings.register_profile(
    "same",
    derandomize=SEED is None,
    database=None,
    deadline=None,
    max_examples=how_many(100),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("same")
core.global_force_seed = SEED  # as --hypothesis-seed does

# A shell's background job ignores these, and so would every process that a test starts.
for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, signal.SIG_DFL)

compiled.once()

# Whatever is made while tests are collected stays.
gc.disable()


def pytest_configure(config: pytest.Config) -> None:
    """Seeds are named in reports."""
    if not config.pluginmanager.is_registered(seeds):
        config.pluginmanager.register(seeds)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Share out tests of minutes, first in what each worker begins with: short ones end last."""
    heavy = [item for item in items if "/scenarios/" in item.nodeid and _is_long(item)]
    rare = set(heavy)
    others = deque(item for item in items if item not in rare)
    workers, count = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")), len(items)
    items.clear()
    for worker in range(workers):
        items += heavy[worker::workers]
        items += [others.popleft() for _ in range(count * (worker + 1) // workers - len(items))]


def _is_long(item: pytest.Item) -> bool:
    return item.get_closest_marker("long") is not None


def pytest_collection_finish() -> None:
    """Leave what was collected out of every later look for garbage, and look more rarely."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 10, 5)
    gc.enable()


def pytest_runtest_logfinish() -> None:
    """Look for garbage when a worker has become larger."""
    settle()


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
