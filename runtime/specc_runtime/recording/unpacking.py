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

_FRAME, _MESSAGE = Struct("<BQ"), Struct("<HIQQ")


def unpacked_chunk(chunk: Chunk, budget: Budget) -> Iterator[McapRecord]:
    """The schemas, channels and messages in a chunk; other records are not allowed there.

    Raises Unusable if the budget is exceeded. A damaged chunk raises ValueError or an error of
    the libraries.
    """
    plain = _plain(chunk, budget)
    begin, size = 0, len(plain)
    while begin + _FRAME.size <= size:
        kind, length = _FRAME.unpack_from(plain, begin)
        begin += _FRAME.size
        if begin + length > size:
            return
        if kind == Opcode.MESSAGE and length >= _MESSAGE.size:
            channel, sequence, log, publish = _MESSAGE.unpack_from(plain, begin)
            data = plain[begin + _MESSAGE.size : begin + length]
            budget.decode(data)
            yield Message(channel, log, data, publish, sequence)
        else:
            budget.record(kind, length)
            if kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                budget.keep(length)
                made = Schema if kind == Opcode.SCHEMA else Channel
                stream = BytesIO(plain[begin : begin + length])
                yield made.read(ReadDataStream(stream))
        begin += length


def _plain(chunk: Chunk, budget: Budget) -> bytes:
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
