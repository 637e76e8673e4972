"""Scheduling classes of the threads of a run in real time: who goes before whom.

Only the standard library, Python 3.10: the device host may run in another Python than the agent.
"""

from __future__ import annotations

import os
import sys
import threading
from contextlib import suppress

MAIN, HOST, THREADS, PROCESSES = 20, 10, 5, 1
"""Priorities by `SCHED_FIFO`: of the main thread, below the threads that serve interrupts, which
have 50; of the device host; of other threads of the run, which the main one waits for while they
hold the interpreter; and of processes that compute steps, which are long."""
_NAMES = ("SCHED_OTHER", "SCHED_FIFO", "SCHED_RR", "SCHED_BATCH", "SCHED_IDLE", "SCHED_DEADLINE")
_RESET_ON_FORK = 0x40000000


class ThreadClass:
    """The scheduling class that a thread had before."""

    def __init__(self, thread: int) -> None:
        """Of a thread by its number in the system; 0 is the calling one. Raises OSError."""
        self._thread = thread
        self._policy = os.sched_getscheduler(thread)
        self._parameters = os.sched_getparam(thread)

    def give_back(self) -> None:
        """Have the thread scheduled as it was; raises OSError if it has ended."""
        try:
            os.sched_setscheduler(self._thread, self._policy, self._parameters)
        except PermissionError:  # who has no privilege cannot let children inherit again
            policy = self._policy | os.SCHED_RESET_ON_FORK
            os.sched_setscheduler(self._thread, policy, self._parameters)


def take(priority: int, thread: int = 0, *, inherited: bool = False) -> ThreadClass:
    """Have a thread run before all of ordinary priority; returns what it had before.

    What it begins later does so as well if that is `inherited`. Raises OSError, PermissionError if
    it is not permitted.
    """
    before = ThreadClass(thread)
    policy = os.SCHED_FIFO if inherited else os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    os.sched_setscheduler(thread, policy, os.sched_param(priority))
    return before


def take_for_others(priority: int) -> list[ThreadClass]:
    """The same for the other threads of Python and what they begin, as far as it is permitted."""
    found = []
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and thread.native_id is not None:
            with suppress(OSError):  # it has just ended
                found.append(take(priority, thread.native_id, inherited=True))
    return found


def class_of(thread: int = 0) -> str:
    """The scheduling class of a thread or process in words; empty where nothing is known of it."""
    if sys.platform != "linux":
        return ""
    try:
        policy = os.sched_getscheduler(thread) & ~_RESET_ON_FORK
        priority = os.sched_getparam(thread).sched_priority
    except OSError:
        return ""
    name = _NAMES[policy] if policy < len(_NAMES) else str(policy)
    return f"{name} {priority}" if priority else name
