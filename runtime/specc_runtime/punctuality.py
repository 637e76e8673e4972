"""What makes a run in real time punctual, as far as it is permitted, and is undone at its end.

The main thread gets the highest priority, and the other threads of the run a lower one: a thread of
ordinary priority that is woken may wait for tens of milliseconds behind processes that have just
begun, and the main thread waits for it while it holds the interpreter. Processes that begin later
stay at the ordinary priority (`SCHED_RESET_ON_FORK`). Memory is locked once the first steps have
loaded all that they need, and blocks of memory for other processes are mapped; what comes later is
locked as it is touched, so that no new mapping stalls the loop.
"""

from __future__ import annotations

import ctypes
import errno
import faulthandler
import gc
import os
import resource
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from specc_runtime.scheduling import (
    MAIN,
    THREADS,
    ThreadClass,
    class_of,
    take,
    take_for_others,
)

DONE = "done"
_NEW_OBJECTS = 700
"""Between two collections of garbage, so that most take some 0.02 ms, and not 10."""
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
_CAP_IPC_LOCK = 14


class Punctuality:
    """What is done for a run: `classes` has for each measure `DONE`, or why not.

    `scheduling` has the classes of the main thread (of "") and of processes, by subsystems.
    """

    def __init__(self, of_processes: Callable[[], Mapping[str, str]] = dict) -> None:
        self.classes: dict[str, str] = {}
        self.scheduling: dict[str, str] = {}
        self._of_processes = of_processes
        self._undo: list[Callable[[], None]] = []

    def begin(self) -> None:
        """Do it: when the first steps are made, and before the clock counts."""
        if self._undo or sys.platform != "linux":
            return
        measures = {
            "objects frozen": _freeze,
            "memory locked": _lock,
            "SCHED_FIFO": _take_priority,
        }
        for measure, do in measures.items():
            try:
                self._undo.append(do())
                self.classes[measure] = DONE
            except _NotPermitted as why:
                self.classes[measure] = str(why)
        self.scheduling = {"": class_of(), **self._of_processes()}

    def end(self) -> None:
        """Undo it: the process may go on."""
        while self._undo:
            with suppress(OSError):
                self._undo.pop()()


def in_words(classes: Mapping[str, str]) -> str:
    """What was done, and what was not and why, on one line."""
    done = [measure for measure, why in classes.items() if why == DONE]
    others = [f"not {measure} ({why})" for measure, why in classes.items() if why != DONE]
    return ", ".join((*done, *others))


class _NotPermitted(Exception):
    """Why a measure was not taken."""


def _freeze() -> Callable[[], None]:
    """What there is after the first steps stays: full collections would look at all of it.

    Others are often and short: a command may have set that they are rare and long.

    Objects that others have frozen stay so: nothing tells them from the others.
    """
    was_frozen, thresholds = gc.get_freeze_count() > 0, gc.get_threshold()
    gc.collect()
    gc.freeze()
    if thresholds[0] > _NEW_OBJECTS:
        gc.set_threshold(_NEW_OBJECTS, *thresholds[1:])

    def undo() -> None:
        gc.set_threshold(*thresholds)
        if not was_frozen:
            gc.unfreeze()

    return undo


def _take_priority() -> Callable[[], None]:
    """Have the threads run before all of ordinary priority, the calling one before the others."""
    changed: list[ThreadClass] = []
    try:
        changed.append(take(MAIN))
        changed += take_for_others(THREADS)
        # Its thread is of ordinary priority, and whoever arms it again waits for that one and
        # keeps the interpreter meanwhile. The watchdog does so soon; then it has its priority.
        faulthandler.cancel_dump_traceback_later()
    except PermissionError:
        raise _NotPermitted("not permitted: needs CAP_SYS_NICE or an rtprio limit") from None
    except OSError as error:
        raise _NotPermitted(os.strerror(error.errno or 0)) from None

    def give_back() -> None:
        for each in reversed(changed):
            with suppress(OSError):
                each.give_back()

    return give_back


def _lock() -> Callable[[], None]:
    """Keep what the process has in memory, and what it gets later, from when it is touched."""
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(_MCL_CURRENT):
        number = ctypes.get_errno()
        if number in (errno.EPERM, errno.ENOMEM, errno.EAGAIN):
            raise _NotPermitted("not permitted: needs CAP_IPC_LOCK or a memlock limit")
        raise _NotPermitted(os.strerror(number))
    # What comes later would fail, and not only be unlocked, beyond a limit.
    if _is_unlimited():
        library.mlockall(_MCL_FUTURE | _MCL_ONFAULT)

    def unlock() -> None:
        library.munlockall()

    return unlock


def _is_unlimited() -> bool:
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY:
        return True
    with suppress(OSError, ValueError, IndexError):
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        effective = status.partition("CapEff:")[2].split()[0]
        return bool(int(effective, 16) >> _CAP_IPC_LOCK & 1)
    return False
