"""The memory of a worker of tests: garbage goes before there is much of it."""

from __future__ import annotations

import ctypes
import gc
import resource
from contextlib import suppress
from pathlib import Path

# Contexts of z3 are large, and Python's collector counts each as one small object.
GROWN_MB = 100
_settled_mb = 0.0


def settle() -> None:
    """Look for garbage if the process has become larger by some 100 MB since it last did."""
    global _settled_mb
    if resident_mb() > _settled_mb + GROWN_MB:
        gc.collect()
        with suppress(OSError, AttributeError):  # another C library keeps what it has
            ctypes.CDLL(None).malloc_trim(0)
        _settled_mb = resident_mb()


def resident_mb() -> float:
    """Memory of this process; 0 where none can tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return 0.0
    return pages * resource.getpagesize() / 1e6
