"""Unpacks a chunk of an MCAP file."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from io import BytesIO
from struct import Struct
from typing import IO, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema

from specc_runtime.recording.budget import Budget
from specc_runtime.recording.spans import LARGEST_BYTES

_FRAME, _MESSAGE = Struct("<BQ"), Struct("<HIQQ")


class Inside(NamedTuple):
    """A message in the content of a chunk: its channel and so on, and where its data is."""

    channel: int
    sequence: int
    log_ns: int
    publish_ns: int
    begin: int
    end: int


def unpacked_chunk(chunk: Chunk, budget: Budget) -> Iterator[McapRecord]:
    """The schemas, channels and messages in a chunk; other records are not allowed there.

    Raises Unusable if the budget is exceeded. A damaged chunk raises ValueError or an error of
    the libraries.
    """
    plain = plain_chunk(chunk, budget)
    for found in records_within(plain, budget):
        if isinstance(found, Inside):
            data = plain[found.begin : found.end]
            budget.decode(data)
            yield Message(found.channel, found.log_ns, data, found.publish_ns, found.sequence)
        else:
            yield found


def records_within(plain: bytes, budget: Budget) -> Iterator[Schema | Channel | Inside]:
    """The records in the content of a chunk; messages are not paid for. Raises as above."""
    begin, size = 0, len(plain)
    while begin + _FRAME.size <= size:
        kind, length = _FRAME.unpack_from(plain, begin)
        begin += _FRAME.size
        end = begin + length
        if end > size:
            return
        if kind == Opcode.MESSAGE and length >= _MESSAGE.size:
            channel, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(plain, begin)
            begin += _MESSAGE.size
            yield Inside(channel, sequence, log_ns, publish_ns, begin, end)
        else:
            budget.record(kind, length)
            if kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                budget.keep(length)
                made = Schema if kind == Opcode.SCHEMA else Channel
                yield made.read(ReadDataStream(BytesIO(plain[begin:end])))
        begin = end


def content_at(file: IO[bytes], place: int, budget: Budget) -> bytes:
    """The content of the chunk at a place of a file, or the message there as it is.

    Raises as above; the file may be read by several threads.
    """
    kind, length = _FRAME.unpack(head := os.pread(file.fileno(), _FRAME.size, place))
    if kind not in (Opcode.CHUNK, Opcode.MESSAGE) or length > LARGEST_BYTES:
        raise ValueError("neither a chunk nor a message")
    content = os.pread(file.fileno(), length, place + _FRAME.size)
    if kind != Opcode.CHUNK:
        return head + content
    return plain_chunk(Chunk.read(ReadDataStream(BytesIO(content))), budget)


def plain_chunk(chunk: Chunk, budget: Budget) -> bytes:
    """The content of a chunk. Raises as above."""
    plain: bytes = chunk.data
    if chunk.compression == "zstd":
        size = chunk.uncompressed_size
        if size != zstandard.frame_content_size(plain):
            raise ValueError("the chunk is not as large as it says")
        budget.unpack(size)
        plain = zstandard.ZstdDecompressor().decompress(plain, max_output_size=size)
    elif chunk.compression == "lz4":  # of bags, which others record
        from lz4.frame import LZ4FrameDecompressor

        budget.unpack(chunk.uncompressed_size)
        plain = LZ4FrameDecompressor().decompress(plain, max_length=chunk.uncompressed_size)
    elif chunk.compression:
        raise ValueError("another compression")
    if chunk.uncompressed_crc and zlib.crc32(plain) != chunk.uncompressed_crc:
        raise ValueError("the chunk is damaged")
    return plain
