"""Bags as other tools record them, for tests: folders of rosbag2 and single files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Nodetype
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

BEGIN_S = 1_700_000_000
Written = tuple[float, str, str, dict[str, Any]]
"""When it was received, s after `BEGIN_S`; topic, type, and the fields of the message."""


def write(
    folder: Path,
    messages: Iterable[Written],
    storage: StoragePlugin = StoragePlugin.MCAP,
    definitions: dict[str, str] | None = None,
) -> Path:
    """Write a bag, with the definitions of types that ROS itself does not have."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in (definitions or {}).items():
        store.register(get_types_from_msg(text, name))
    with Writer(folder, version=9, storage_plugin=storage) as writer:
        connections: dict[tuple[str, str], Any] = {}
        for at_s, topic, type_, fields in sorted(messages, key=lambda each: each[0]):
            key = topic, type_
            if key not in connections:
                connections[key] = writer.add_connection(topic, type_, typestore=store)
            data = store.serialize_cdr(made(store, type_, fields), type_)
            writer.write(connections[key], time_ns(at_s), data)
    return folder


def read(bag: Path) -> list[tuple[str, int, Any]]:
    """All messages of a bag, by `rosbags`: topic, time in ns, and the message."""
    with AnyReader([bag]) as reader:
        return [
            (connection.topic, at_ns, reader.deserialize(data, connection.msgtype))
            for connection, at_ns, data in reader.messages()
        ]


def time_ns(at_s: float) -> int:
    return BEGIN_S * 10**9 + round(at_s * 1e9)


def header(at_s: float, frame: str = "") -> dict[str, Any]:
    """A header, stamped so many seconds after `BEGIN_S`."""
    sec, nanosec = divmod(time_ns(at_s), 10**9)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def made(store: Any, type_: str, fields: dict[str, Any]) -> Any:
    """A message; fields that are not said are those of an empty one."""
    import numpy as np

    values = {}
    for name, (kind, of) in store.fielddefs[type_][1]:
        given = fields.get(name)
        if kind == Nodetype.NAME:
            values[name] = made(store, of, given or {})
        elif kind == Nodetype.BASE:
            empty: Any = "" if of[0] == "string" else 0
            values[name] = empty if given is None else given
        elif of[0][0] == Nodetype.NAME:
            values[name] = [made(store, of[0][1], each) for each in given or []]
        elif of[0][1][0] == "string":
            values[name] = given or []
        else:
            size = of[1] if kind == Nodetype.ARRAY else 0
            values[name] = np.array([0] * size if given is None else given, of[0][1][0])
    return store.types[type_](**values)
