"""Recordings of a few bytes that stand for far more: each is a way to make a reader do too much."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Callable, Iterator
from hashlib import sha256
from struct import pack

import zstandard

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _INDEX = 1, 2, 3, 4, 5, 6, 7
_ATTACHMENT, _METADATA, _END, _OWN = 9, 12, 15, 0xA0
_COMPRESS = zstandard.ZstdCompressor(1).compress


def _text(text: str | bytes) -> bytes:
    data = text.encode() if isinstance(text, str) else text
    return pack("<I", len(data)) + data


def _record(kind: int, *content: bytes) -> bytes:
    data = b"".join(content)
    return pack("<BQ", kind, len(data)) + data


def _map(told: dict[str, str]) -> bytes:
    return _text(b"".join(_text(part) for item in told.items() for part in item))


def schema(number: int, name: str, data: bytes = b"{}") -> bytes:
    """A schema, in JSON Schema."""
    return _record(_SCHEMA, pack("<H", number), _text(name), _text("jsonschema"), _text(data))


def channel(number: int, topic: str, of: int, told: bytes = _map({})) -> bytes:
    """A channel of messages in JSON."""
    return _record(_CHANNEL, pack("<HH", number, of), _text(topic), _text("json"), told)


def message(number: int, data: bytes, time_ns: int = 0) -> bytes:
    """A message."""
    return _record(_MESSAGE, pack("<HIQQ", number, 0, time_ns, time_ns), data)


def chunk(*records: bytes, claims: int | None = None, last_ns: int = 0) -> bytes:
    """A chunk, which may claim another size."""
    plain = b"".join(records)
    size = len(plain) if claims is None else claims
    head = pack("<QQQI", 0, last_ns, size, 0)
    packed = _COMPRESS(plain)
    return _record(_CHUNK, head, _text("zstd"), pack("<Q", len(packed)), packed)


def attachment(name: str, data: bytes) -> bytes:
    """An attached file."""
    named = _text(name) + _text("text/yaml")
    return _record(_ATTACHMENT, bytes(16), named, pack("<Q", len(data)), data, bytes(4))


def metadata(name: str, told: dict[str, str]) -> bytes:
    """Names and texts."""
    return _record(_METADATA, _text(name), _map(told))


def recording(*records: bytes, spec: str = "", **told: str) -> bytes:
    """A file of a megabyte that begins like one of specc."""
    about = {"format": "1", "seed": "0", "set": "{}", "exact": "true", "spec": "talk.yaml"} | told
    ours = metadata("specc", about) + attachment("talk.yaml", spec.encode())
    head = _record(_HEADER, _text(""), _text("bomb"))
    end = _record(_END, bytes(4)) + _record(_FOOTER, bytes(20))
    whole = head + ours + b"".join(records)
    # What the size allows is used up: the rest is a record that costs nothing.
    rest = _record(_OWN, bytes(max(0, MB - len(whole))))
    return MAGIC + whole + rest + end + MAGIC


_STEP = (
    b'{"stamp":0,"time":0.0,"state":"","transition":"","conditions":{},"x":%b,"fresh":{},'
    b'"y":{},"memory":{}}'
)
_STEPS = schema(1, "specc.Step.talker.c") + channel(1, "/talker.c", 1)
_SNAPSHOTS = schema(1, "specc.Snapshot") + channel(1, "/snapshot", 1)
_PIECES = schema(2, "specc.Value") + channel(2, "/snapshot/values", 2)
_VALUES = schema(2, "specc.Value") + channel(2, "/values", 2)
_IMAGES = schema(2, "foxglove.RawImage") + channel(2, "/talker.c/x/i", 2)
MB = 1 << 20


def _piece(data: bytes) -> bytes:
    return json.dumps({"type": "T", "bytes": b64encode(data).decode()}).encode()


def _image(data: bytes, **more: object) -> bytes:
    told = {
        "encoding": "rgb8",
        "width": 1,
        "height": len(data) // 3,
        "data": b64encode(data).decode(),
    }
    return json.dumps(told | more).encode()


def _snapshot(**parts: object) -> bytes:
    empty = {part: {} for part in ("subsystems", "stamps", "sensors", "commands")}
    return json.dumps({"tick": 10, "time": 1.0} | empty | parts).encode()


def _digest(data: bytes) -> str:
    return sha256(data).hexdigest()[:16]


def bombs() -> Iterator[tuple[str, Callable[[], bytes]]]:
    """The name of each, and what makes it."""
    yield "zeros", lambda: MAGIC + bytes(10 * MB)
    for name, opened, size in (("steps", _STEPS, 200), ("snapshots", _SNAPSHOTS, 200)):
        yield (
            f"{name} of zeros",
            lambda o=opened, s=size: recording(o, chunk(message(1, b"0" * s * MB))),
        )
        for item in (b"[],", b"0,", b'"",', b'{"a":0},'):

            def many(o: bytes = opened, i: bytes = item) -> bytes:
                inside = b'{"a":[' + i * (60 * MB // len(i)) + b"0]}"
                return recording(o, chunk(message(1, _STEP % inside)))

            yield f"{name} with {item.decode()}", many

            def often(o: bytes = opened, i: bytes = item) -> bytes:
                inside = _STEP % (b'{"a":[' + i * (MB // 2 // len(i)) + b"0]}")
                return recording(o, *[chunk(*[message(1, inside)] * 10)] * 300)

            yield f"many {name} with {item.decode()}", often
        yield (
            f"{name} without content",
            lambda o=opened: recording(o, chunk(*[message(1, b"")] * 2_000_000)),
        )
        yield (
            f"many chunks of {name} without content",
            lambda o=opened: recording(o, *[chunk(*[message(1, b"{}")] * 30_000)] * 300),
        )
        yield (
            f"{name} of wide letters",
            lambda o=opened: recording(
                o, chunk(message(1, b'"' + b"a" * 35 * MB + "\U0001f600".encode() + b'"'))
            ),
        )
        yield (
            f"{name} of wide escapes",
            lambda o=opened: recording(
                o, chunk(message(1, b'"' + b"a" * 35 * MB + b'\\ud83d\\ude00"'))
            ),
        )
        yield f"{name} nested", lambda o=opened: recording(o, chunk(message(1, b"[" * 30 * MB)))
        yield (
            f"{name} with long numbers",
            lambda o=opened: recording(o, chunk(message(1, b"1" * 30 * MB))),
        )
    yield "a chunk that claims more", lambda: recording(chunk(b"", claims=1 << 40))
    yield "a chunk that claims less", lambda: recording(chunk(bytes(100 * MB), claims=1))
    yield "chunks of nothing", lambda: recording(*[chunk()] * 20_000)
    yield "a chunk of zeros", lambda: recording(chunk(bytes(250 * MB)))
    yield "chunks of zeros", lambda: recording(*[chunk(bytes(30 * MB))] * 300)
    yield (
        "empty records in chunks",
        lambda: recording(*[chunk(pack("<BQ", 99, 0) * 3_000_000)] * 30),
    )
    yield "empty records", lambda: recording(pack("<BQ", 99, 0) * 110_000)
    yield "wrong records", lambda: recording(pack("<BQ", _SCHEMA, 0) * 110_000)
    yield "wrong chunks", lambda: recording(pack("<BQ", _CHUNK, 0) * 110_000)
    yield "schemas in chunks", lambda: recording(*[chunk(schema(1, "s") * 300_000)] * 20)
    yield (
        "large schemas",
        lambda: recording(*[chunk(schema(i, "s", b" " * 20 * MB)) for i in range(30)]),
    )
    yield (
        "long topics",
        lambda: recording(*[chunk(channel(i, "t" * 20 * MB, 1)) for i in range(30)]),
    )
    yield (
        "channels that are told much of",
        lambda: recording(chunk(channel(1, "t", 1, _text(_text("") * 2 * 4_000_000)))),
    )
    yield (
        "many channels",
        lambda: recording(
            schema(1, "specc.Step.x"),
            *(chunk(*(channel(i, f"/{'t' * 300}{i}", 1) for i in range(60_000))) for _ in range(3)),
            chunk(*(message(i, _STEP % b"{}") for i in range(60_000))),
        ),
    )
    yield "attachments in chunks", lambda: recording(*[chunk(attachment("a", bytes(30 * MB)))] * 30)
    yield (
        "metadata in chunks",
        lambda: recording(*[chunk(metadata("a", {"b": "c" * 30 * MB}))] * 30),
    )
    yield (
        "chunks in chunks",
        lambda: recording(*[chunk(chunk(chunk(message(1, bytes(10 * MB))) * 1000) * 20)] * 10),
    )
    yield "nested values that were set", lambda: recording(set="[" * MB)
    yield (
        "many values that were set",
        lambda: recording(set=json.dumps({f"a{i}": "1" for i in range(60_000)})),
    )
    for name, opened in (("pieces", _PIECES), ("values", _VALUES)):
        yield (
            f"large {name}",
            lambda o=opened: recording(
                o, *[chunk(message(2, _piece(bytes([i]) * 20 * MB))) for i in range(30)]
            ),
        )
    yield (
        "large images",
        lambda: recording(
            _IMAGES, *[chunk(message(2, _image(bytes([i]) * 12 * MB))) for i in range(40)]
        ),
    )
    yield (
        "images of absurd shapes",
        lambda: recording(
            _IMAGES, *[chunk(message(2, _image(b"", width=1 << 62, height=0)))] * 1000
        ),
    )
    data = bytes(20 * MB)
    part = {"type": "T", "digest": _digest(data), "dtype": "|u1", "shape": [len(data)]}
    yield (
        "an array that is named often",
        lambda: recording(
            _SNAPSHOTS,
            _PIECES,
            chunk(message(2, _piece(data))),
            chunk(
                message(
                    1, _snapshot(subsystems={"talker.c": {"memory": {"arrays": [part] * 5000}}})
                )
            ),
        ),
    )
    yield (
        "absurd stamps",
        lambda: recording(
            _SNAPSHOTS,
            chunk(message(1, _snapshot(stamps={"talker.c": 1 << 62, "hearer.c": 1 << 62}), 10**9)),
            **{"from": "10"},
        ),
    )
    yield (
        "a long topic of control characters",
        lambda: recording(
            schema(1, "specc.Step.x"),
            chunk(channel(1, "/" + "\x1b" * 3 * MB, 1), message(1, _STEP % b"{}")),
        ),
    )
    yield (
        "long names of states",
        lambda: recording(
            _STEPS,
            chunk(
                message(
                    1, (_STEP % b"{}").replace(b'"state":""', b'"state":"%b"' % (b"\x7f" * 8 * MB))
                )
            ),
        ),
    )
    yield "a long name of the specification", lambda: recording(spec="", **{"spec_": "x" * MB})
    yield "much metadata", lambda: recording(*[metadata("report", {"report": "[" * 1000})] * 900)
    yield (
        "a report with much in it",
        lambda: recording(metadata("report", {"report": "[" + "[]," * 300_000 + "0]"})),
    )
