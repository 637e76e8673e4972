"""Memory that processes have in common: each has it by a descriptor, and it has no name.

So the kernel frees it with the last of them, however they end.
"""

from __future__ import annotations

import mmap
import os

_PAGE = mmap.PAGESIZE


def anonymous_file() -> int:
    """A file without a name, in memory where the system has that; returns its descriptor."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("specc")
    import tempfile

    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


class Block:
    """Memory that grows; every page of it is mapped when it is made.

    `bytes` are all of it, `words` and `times` the same in parts of 8 bytes, integers and floats:
    these are read and written as one, which `struct` does not promise. What was taken of them
    stays what it is when the block grows.
    """

    def __init__(self, descriptor: int, *, is_read_only: bool = False) -> None:
        """The memory behind a descriptor, which the block closes."""
        self.descriptor = descriptor
        self._access = mmap.PROT_READ | (0 if is_read_only else mmap.PROT_WRITE)
        self._map()

    @classmethod
    def of_bytes(cls, size: int) -> Block:
        """New memory, which another process has by its descriptor. Raises OSError."""
        descriptor = anonymous_file()
        _grow(descriptor, size)
        return cls(descriptor)

    def _map(self) -> None:
        self.size = os.fstat(self.descriptor).st_size
        flags = mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0)
        self.bytes = memoryview(mmap.mmap(self.descriptor, self.size, flags, self._access))
        self.words, self.times = self.bytes.cast("Q"), self.bytes.cast("d")

    def hold(self, size: int, wanted: int = 0) -> None:
        """Be at least that large, whoever made it grow; who does takes `wanted`, if that is more.

        Raises OSError if there is no memory.
        """
        if size > self.size:
            if size > os.fstat(self.descriptor).st_size:
                _grow(self.descriptor, max(size, wanted))
            self._map()

    def close(self) -> None:
        """Give it up; other processes, and who has taken a part of it, still have it."""
        os.close(self.descriptor)


def _grow(descriptor: int, size: int) -> None:
    """Make it so large, in whole pages."""
    size = max(1, -(-size // _PAGE)) * _PAGE
    if hasattr(os, "posix_fallocate"):  # a lack of room is an error here, and a signal later
        before = os.fstat(descriptor).st_size
        os.posix_fallocate(descriptor, before, size - before)
    os.ftruncate(descriptor, size)
