"""What the code of a specification leaves running when its run is over: threads and processes."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from pathlib import Path

from specc_runtime.printing import say


class Leftovers:
    """What is there now is not left over by what comes."""

    def __init__(self) -> None:
        self._threads = set(threading.enumerate())
        self._children = _children()

    def end(self) -> bool:
        """Name threads and processes that are new, and end those; whether threads still run."""
        for child in _children() - self._children:
            say(f"the run has left the process {_named(child)} behind: it is ended")
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)
        threads = [t for t in threading.enumerate() if t not in self._threads and not t.daemon]
        for thread in threads:
            say(f"the run has left the thread {thread.name!r} behind: the process does not wait")
        return bool(threads)


def leave(code: int) -> None:
    """End the process with the code, whatever threads still run: Python would wait for them."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)


def _children() -> set[int]:
    """The processes that this one has begun, where the system tells."""
    found: set[int] = set()
    with contextlib.suppress(OSError):
        for task in Path("/proc/self/task").glob("*/children"):
            found |= set(map(int, task.read_text(encoding="ascii").split()))
    return found


def _named(process: int) -> str:
    try:
        words = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
    except OSError:
        return str(process)
    return f"{process} ({ascii(os.path.basename(words[0]).decode(errors='replace'))[1:-1]})"
