"""The budget of work and memory for reading a recording, in proportion to the size of the file.

A few bytes can expand to any number of others: compressed, as records without content, as lists
without items. Unpacking and decoding are paid for here in advance.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

_FREE, _PER_BYTE = 300_000_000, 2000
"""Work for a file, and for each byte of it. The unit is about a nanosecond."""
_OF_RECORD, _OF_MESSAGE = 15_000, 6000
_OF_BYTE, _OF_ITEM = 3, 8
"""Work for a record, a message in a chunk, and a byte and an item of its content."""
_OF_ASIDE = 6
"""Work for a byte of a value stored aside, whose digest is computed."""
_OF_KIND: Mapping[int, int] = {0x04: 100, 0x07: 20, 0x0C: 100}
"""Work for a byte of records that are lists: of a channel, of a message index, of metadata."""
_ITEM_BYTES, _WIDE = 64, 4
"""Memory of an item that is decoded, and of a character of a text that is not ASCII."""
_HELD_BYTES, _HELD_PER_BYTE = 40 << 20, 8
"""Memory for the parts of a file held at once: a chunk, a message, values stored aside."""


class Unusable(Exception):
    """The file is no recording, or cannot be read; the message says why."""


class Budget:
    """The rest of the budget for reading a file.

    `most_bytes` is the memory for the parts of the file that are held at once.
    """

    def __init__(self, path: Path) -> None:
        """Raises Unusable if there is no such file."""
        try:
            size = os.stat(path).st_size
        except OSError as error:
            raise Unusable(f"cannot read {path}: {error.strerror}") from error
        except ValueError as error:  # not a file name, such as one with a NUL
            raise Unusable(f"cannot read {path}: {error}") from error
        self._path = path
        self._left = _FREE + _PER_BYTE * size
        self.most_bytes = _HELD_BYTES + _HELD_PER_BYTE * size
        self._stored_bytes = 0

    def record(self, kind: int, size: int) -> None:
        """Pay for a record of a kind, of so many bytes. Raises Unusable."""
        self._pay(_OF_RECORD + _OF_KIND.get(kind, 1) * size)

    def unpack(self, size: int) -> None:
        """Pay for a chunk that unpacks to so many bytes. Raises Unusable."""
        self._hold(size, "a chunk unpacks")
        self._pay(size)

    def decode(self, text: bytes) -> None:
        """Pay for a message, which may be decoded. Raises Unusable."""
        size, items = len(text), text.count(b",") + text.count(b"[") + text.count(b"{")
        self._pay(_OF_MESSAGE + _OF_BYTE * size + _OF_ITEM * items)
        is_wide = size > _HELD_BYTES // _WIDE and (not text.isascii() or b"\\u" in text)
        self._hold(size * (_WIDE if is_wide else 1) + _ITEM_BYTES * items, "a message unfolds")

    def skim(self, size: int) -> None:
        """Pay for a message of so many bytes that is searched, but not decoded. Raises Unusable."""
        self._pay(_OF_MESSAGE + size)

    def aside(self, size: int) -> None:
        """Pay for a value of so many bytes that is stored aside. Raises Unusable."""
        self._pay(_OF_ASIDE * size)

    def keep(self, size: int) -> None:
        """Pay for bytes that are held to the end, such as a name. Raises Unusable."""
        self._stored_bytes += size
        self._hold(self._stored_bytes, "what it names unfolds")

    def _pay(self, work: int) -> None:
        self._left -= work
        if self._left < 0:
            raise Unusable(f"{self._path} is not read: it unpacks to far more than its size")

    def _hold(self, size: int, what: str) -> None:
        if size > self.most_bytes:
            words = f"{what} to {size >> 20} MB, far more than its size"
            raise Unusable(f"{self._path} is not read: {words}")
