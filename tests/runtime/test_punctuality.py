"""Priority, locked memory and frozen objects: as far as permitted, told, and undone."""

from __future__ import annotations

import ctypes
import errno
import faulthandler
import gc
import os
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from specc_runtime.punctuality import DONE, Punctuality, in_words
from specc_runtime.scheduling import MAIN, THREADS

from tests.seeds import every

CALLS: list[tuple[Any, ...]] = []
FROZEN = [0]
"""How many objects."""


@pytest.fixture(autouse=True)
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """What the system is asked; it permits all, and nothing is done."""
    CALLS.clear()
    library = SimpleNamespace(
        mlockall=lambda flags: CALLS.append(("lock", flags)) or 0,
        munlockall=lambda: CALLS.append(("unlock",)),
    )
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: library)
    monkeypatch.setattr(os, "sched_setscheduler", lambda *asked: CALLS.append(asked[:2]))
    monkeypatch.setattr(gc, "get_freeze_count", lambda: FROZEN[0])
    monkeypatch.setattr(gc, "freeze", lambda: FROZEN.__setitem__(0, FROZEN[0] + 7))
    monkeypatch.setattr(gc, "unfreeze", lambda: FROZEN.__setitem__(0, 0))
    FROZEN[0] = 0
    return CALLS


def test_all_that_is_permitted_is_done_and_undone(calls: list[tuple[Any, ...]]) -> None:
    before = os.sched_getscheduler(0)
    punctuality = Punctuality()
    punctuality.begin()
    assert set(punctuality.classes.values()) == {DONE}
    assert FROZEN == [7]
    assert (0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK) in calls
    punctuality.end()
    assert FROZEN == [0]
    assert calls[-2:] == [(0, before), ("unlock",)]
    punctuality.end()
    assert calls[-2:] == [(0, before), ("unlock",)]


@pytest.mark.long
def test_other_threads_go_before_ordinary_ones_and_behind_the_main_one(
    calls: list[tuple[Any, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    over, asked = threading.Event(), list[tuple[int, ...]]()
    other = threading.Thread(target=over.wait)
    other.start()

    def note(thread: int, policy: int, parameters: os.sched_param) -> None:
        asked.append((thread, policy, parameters.sched_priority))

    monkeypatch.setattr(os, "sched_setscheduler", note)
    monkeypatch.setattr(faulthandler, "cancel_dump_traceback_later", lambda: asked.append((-1,)))
    punctuality = Punctuality()
    punctuality.begin()
    assert asked[0] == (0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, MAIN)
    # What waits for the next stack dump with the interpreter in hand waits for a prompt thread.
    assert asked[-1] == (-1,)
    assert (other.native_id, os.SCHED_FIFO, THREADS) in asked
    punctuality.end()
    assert (other.native_id, os.SCHED_OTHER, 0) in asked and asked[-1][0] == 0
    over.set()
    other.join()


def test_what_others_have_frozen_stays_so() -> None:
    gc.freeze()
    punctuality = Punctuality()
    punctuality.begin()
    punctuality.end()
    assert FROZEN == [14]


@pytest.mark.parametrize(("given", "then"), every(3, [(100_000, 700), (300, 300), (0, 0)]))
def test_collections_are_short_whatever_a_command_has_set(given: int, then: int) -> None:
    before = gc.get_threshold()
    try:
        gc.set_threshold(given, 11, 12)
        punctuality = Punctuality()
        punctuality.begin()
        assert gc.get_threshold() == (then, 11, 12)
        punctuality.end()
        assert gc.get_threshold() == (given, 11, 12)
    finally:
        gc.set_threshold(*before)


def test_what_is_not_permitted_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: SimpleNamespace(mlockall=lambda _: -1))
    monkeypatch.setattr(ctypes, "get_errno", lambda: errno.ENOMEM)
    punctuality = Punctuality()
    punctuality.begin()
    punctuality.end()
    assert punctuality.classes == {
        "objects frozen": DONE,
        "memory locked": "not permitted: needs CAP_IPC_LOCK or a memlock limit",
        "SCHED_FIFO": "not permitted: needs CAP_SYS_NICE or an rtprio limit",
    }
    assert in_words(punctuality.classes) == (
        "objects frozen, "
        "not memory locked (not permitted: needs CAP_IPC_LOCK or a memlock limit), "
        "not SCHED_FIFO (not permitted: needs CAP_SYS_NICE or an rtprio limit)"
    )
