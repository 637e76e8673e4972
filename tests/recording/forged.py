"""Recordings as a stranger might make them, with the library's own writer."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from mcap.writer import Writer


def forged(
    file: Path,
    texts: Mapping[str, str],
    *,
    snapshot: object = None,
    values: Mapping[str, str] | None = None,
    simulated_s: float = 10.0,
) -> Path:
    """A recording of a specification, the first of these texts, and of files that it uses."""
    with file.open("wb") as opened:
        writer = Writer(opened)
        writer.start()
        told = {"format": "1", "seed": "0", "set": json.dumps(values or {}), "exact": "true"}
        writer.add_metadata("specc", told | {"spec": next(iter(texts), "")})
        for name, text in texts.items():
            writer.add_attachment(0, 0, name, "application/yaml", text.encode())
        if snapshot is not None:
            schema = writer.register_schema("specc.Snapshot", "jsonschema", b"{}")
            channel = writer.register_channel("/snapshot", "json", schema)
            writer.add_message(channel, 10**9, json.dumps(snapshot).encode(), 10**9)
        writer.add_metadata("report", {"report": json.dumps({"simulated_s": simulated_s})})
        writer.finish()
    return file
