"""Recordings as the page gets them: as a source, and served by `specc view`."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.writer import Writer
from specc_runtime.recording.index import Index

from specc.cli.view import recorded_run
from specc.pipeline import compile_spec
from specc.tools.page.recorded import RecordedRun
from tests.commands import ROOT
from tests.page.fake import FakeRun

KEPT = ROOT / "tests" / "recording" / "conveyor_gate.mcap"


def opened(file: Path, spec: Path | None = None) -> RecordedRun:
    """The source of the page over a file; the specification may be the user's own."""
    given = compile_spec(str(spec)) if spec else None
    return recorded_run(Index(file), given, str(spec or ""))


def why_text(run: RecordedRun, machine: str, time_s: float | None) -> str:
    """The lines of `why` as a terminal shows them."""
    return "".join(
        "  " * line["depth"]
        + line["text"]
        + (f"  ({line['place']})" if line["place"] else "")
        + "\n"
        for line in run.why(machine, time_s)["lines"]
    )


@contextmanager
def served(*arguments: object, code: int = 0, cwd: Path = ROOT) -> Iterator[FakeRun]:
    """`specc view` in a process of its own, which Ctrl-C ends with this exit code."""
    command = [sys.executable, "-m", "specc", "view", *map(str, arguments)]
    path = os.pathsep.join([str(ROOT), str(ROOT / "runtime"), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        command, cwd=cwd, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        assert line.startswith("specc: http://127.0.0.1:"), line + process.stderr.read()
        with closing(socket.socket()) as unused:
            yield FakeRun(unused, process, line.removeprefix("specc: ").strip())
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
        assert process.returncode == code and not out, err
        assert "Traceback" not in err and "fault of specc" not in err, err
    finally:
        process.kill()
        process.communicate()


def without(topic: str, source: Path, file: Path) -> Path:
    """A copy of a recording without the messages of a topic."""
    with source.open("rb") as opened, file.open("wb") as out:
        reader, writer = make_reader(opened), Writer(out)
        writer.start()
        for attached in reader.iter_attachments():
            times = attached.create_time, attached.log_time
            writer.add_attachment(*times, attached.name, attached.media_type, attached.data)
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():
            if channel.topic == topic:
                continue
            if channel.id not in channels:
                assert schema is not None
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, kind, channel.metadata
                )
            own = channels[channel.id]
            writer.add_message(own, message.log_time, message.data, message.publish_time)
        for each in reader.iter_metadata():
            writer.add_metadata(each.name, each.metadata)
        writer.finish()
    return file


STEP = {
    "stamp": 0, "time": 0.0, "before": "", "state": "going", "cause": "", "row": -1,
    "transition": "", "conditions": {}, "x": {}, "fresh": {}, "y": {}, "memory": {},
}  # fmt: skip


def forged_run(
    file: Path,
    texts: Mapping[str, str],
    steps: Mapping[str, list[Mapping[str, Any]]],
    *,
    report: Any = None,
    is_chunked: bool = True,
    others: Mapping[tuple[str, str], list[Any]] | None = None,
    **about: str,
) -> Path:
    """A recording as a stranger might make it: steps of subsystems, and other messages."""
    with file.open("wb") as out:
        writer = Writer(out, use_chunking=is_chunked)
        writer.start()
        told = {"format": "1", "set": "{}", "spec": next(iter(texts), ""), "exact": "true"}
        writer.add_metadata("specc", told | about)
        for name, text in texts.items():
            writer.add_attachment(0, 0, name, "application/yaml", text.encode())
        messages = {(f"/{name}", f"specc.Step.{name}"): own for name, own in steps.items()}
        for (topic, kind), contents in {**messages, **(others or {})}.items():
            schema = writer.register_schema(kind, "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            for number, content in enumerate(contents):
                if topic[1:] in steps:
                    content = {**STEP, "stamp": number, "time": number / 10, **content}
                data = (
                    content
                    if isinstance(content, bytes)
                    else json.dumps(content, separators=(",", ":"), ensure_ascii=False).encode()
                )
                writer.add_message(channel, number * 10**8, data, 0)
        if report is not None:
            writer.add_metadata("report", {"report": json.dumps(report)})
        writer.finish()
    return file
