"""Unpacks a chunk of an MCAP file."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from io import BytesIO
from struct import Struct

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema

from specc_runtime.recording.budget import Budget

_FRAME, MESSAGE = Struct("<BQ"), Struct("<HIQQ")
"""Beginning of a record, and of the content of a message: channel, number, times in ns."""


def unpacked_chunk(chunk: Chunk, budget: Budget) -> Iterator[McapRecord]:
    """The schemas, channels and messages in a chunk; other records are not allowed there.

    Raises Unusable if the budget is exceeded. A damaged chunk raises ValueError or an error of
    the libraries.
    """
    plain = plain_chunk(chunk, budget)
    for kind, begin, end in records_within(plain):
        if kind == Opcode.MESSAGE and end - begin >= MESSAGE.size:
            channel, sequence, log, publish = MESSAGE.unpack_from(plain, begin)
            data = plain[begin + MESSAGE.size : end]
            budget.decode(data)
            yield Message(channel, log, data, publish, sequence)
        elif found := form_of(kind, plain[begin:end], budget):
            yield found


def records_within(plain: bytes) -> Iterator[tuple[int, int, int]]:
    """The kind of each record of an unpacked chunk, and where its content begins and ends."""
    begin, size = 0, len(plain)
    while begin + _FRAME.size <= size:
        kind, length = _FRAME.unpack_from(plain, begin)
        begin += _FRAME.size
        if begin + length > size:
            return
        yield kind, begin, begin + length
        begin += length


def form_of(kind: int, content: bytes, budget: Budget) -> Schema | Channel | None:
    """The schema or channel in a record; None if it is another one. Raises as `unpacked_chunk`."""
    budget.record(kind, len(content))
    if kind not in (Opcode.SCHEMA, Opcode.CHANNEL):
        return None
    budget.keep(len(content))
    made = Schema if kind == Opcode.SCHEMA else Channel
    return made.read(ReadDataStream(BytesIO(content)))


def plain_chunk(chunk: Chunk, budget: Budget) -> bytes:
    """The content of a chunk; raises as `unpacked_chunk` does."""
    plain: bytes = chunk.data
    if chunk.compression == "zstd":
        size = chunk.uncompressed_size
        if size != zstandard.frame_content_size(plain):
            raise ValueError("the chunk is not as large as it says")
        budget.unpack(size)
        plain = zstandard.ZstdDecompressor().decompress(plain, max_output_size=size)
    elif chunk.compression:
        raise ValueError("another compression")
    if chunk.uncompressed_crc and zlib.crc32(plain) != chunk.uncompressed_crc:
        raise ValueError("the chunk is damaged")
    return plain
