"""Spans, the units of a recording: damage to one byte loses at most one span.

Each span has a head before it, a record of its own kind that readers of MCAP skip: the number of
the span, its place, its length, and checksums of span and head. After damage, reading goes on at
the next head.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from struct import Struct
from typing import IO, NamedTuple
from zlib import crc32

MAGIC = b"\x89MCAP0\r\n"
"""The first and the last bytes of every file."""
COPIES = 0x91
"""Opcode of the record with copies of records that occur once: the last span of a file."""
LARGEST_BYTES = 1 << 28
"""Size of one span or record, packed or unpacked."""
FRAME = Struct("<BQ")
"""Beginning of every record: opcode, and length of the rest."""

_HEAD = Struct("<IQQI")
_CRC = Struct("<I")
_MARK = b"\x9especc\r\n"
_BEGINNING = FRAME.pack(0x90, len(_MARK) + _HEAD.size + _CRC.size) + _MARK
_HEAD_BYTES = len(_BEGINNING) + _HEAD.size + _CRC.size
_BLOCK_BYTES = 1 << 20


def headed(number: int, place: int, span: bytes) -> bytes:
    """A span with its head, for a place in the file."""
    head = _HEAD.pack(number, place + _HEAD_BYTES, len(span), crc32(span))
    return _BEGINNING + head + _CRC.pack(crc32(head)) + span


def is_copies(span: bytes) -> bool:
    """Whether it is the span with the copies, the last one."""
    return span[:1] == bytes([COPIES])


class _Head(NamedTuple):
    number: int
    place: int
    length: int
    checksum: int


class Spans:
    """The undamaged spans of a file.

    `found`: there is at least one. `damaged` counts the damaged ones. `cut`: the file has no end.
    `place` is where the last one begins in the file.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self.found = False
        self.damaged = 0
        self.cut = False
        self.place = 0
        self._file = file
        self._size = os.fstat(file.fileno()).st_size

    def __iter__(self) -> Iterator[bytes]:
        """Each span without its head; damaged ones are skipped."""
        end, number, is_last = 0, 0, False
        while (head := self._next(end)) is not None:
            self.found, end = True, head.place + head.length
            self.damaged += max(0, head.number - number)
            number = head.number + 1
            if end > self._size:
                break
            span = self._read(head)
            if span is None:
                self.damaged += 1
            else:
                is_last, self.place = is_copies(span), head.place
                yield span
        if self.found and not is_last:
            self._judge_end(end)

    def _read(self, head: _Head) -> bytes | None:
        """The span after a head, None if damaged."""
        if head.length > LARGEST_BYTES:
            return None
        self._file.seek(head.place)
        span = self._file.read(head.length)
        return span if crc32(span) == head.checksum else None

    def _judge_end(self, end: int) -> None:
        """The last span is missing: damaged if the file ends properly, else cut."""
        self._file.seek(-len(MAGIC), os.SEEK_END)
        self.cut = end > self._size or self._file.read() != MAGIC
        if not self.cut and not self.damaged:
            self.damaged = 1

    def _next(self, begin: int) -> _Head | None:
        """The first head from a place on."""
        text, wanted = b"", _HEAD_BYTES
        self._file.seek(begin)
        while block := self._file.read(wanted):
            text += block
            at = text.find(_BEGINNING)
            while 0 <= at <= len(text) - _HEAD_BYTES:
                if head := _head(text[at : at + _HEAD_BYTES], begin + at):
                    return head
                at = text.find(_BEGINNING, at + 1)
            done = max(0, len(text) - _HEAD_BYTES + 1)
            text, begin, wanted = text[done:], begin + done, _BLOCK_BYTES
        return None


def _head(text: bytes, place: int) -> _Head | None:
    """The head at a place of a file, None if there is none for this place."""
    content = text[len(_BEGINNING) : -_CRC.size]
    head = _Head(*_HEAD.unpack(content))
    is_whole = text[-_CRC.size :] == _CRC.pack(crc32(content))
    return head if is_whole and head.place == place + _HEAD_BYTES else None
