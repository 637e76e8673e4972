"""Whether the agent is still there: what the host knows of it besides its messages."""

from __future__ import annotations

import os

LOOK_S = 0.004
"""How often it is looked whether the agent has given up its memory."""


class Agent:
    """The process of the agent.

    The end of its connection is seen only when the system has taken back all its memory, which
    lasts 20 ms for 100 MB, and not at all while a process that it has forked keeps a copy. On Linux
    its size is 0 as soon as it begins to end.
    """

    def __init__(self, pid: int) -> None:
        try:
            self._size = os.open(f"/proc/{pid}/statm", os.O_RDONLY)
        except OSError:  # it is over, or another system
            self._size = -1

    @property
    def is_watched(self) -> bool:
        """Whether `has_ended` can tell."""
        return self._size >= 0

    def has_ended(self) -> bool:
        """Whether the process is known to have ended."""
        if self._size < 0:
            return False
        try:
            return os.pread(self._size, 2, 0) == b"0 "
        except OSError:
            return True
