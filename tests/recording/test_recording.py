"""What a recording has, how it ends, and what is left of it when it is cut or damaged."""

from __future__ import annotations

import json
import random
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from mcap.reader import make_reader
from specc_runtime.clock import WallClock
from specc_runtime.recording.log import Log
from specc_runtime.recording.reading import RecordFile, Recovered, Unusable

from tests.recording.runs import CONVEYOR, ROOT, begun, messages, specc
from tests.seeds import blocks, every, short

ENDLESS = ("run", CONVEYOR, "--duration", 1_000_000, "--record")
LATE_NS = 1_000_000_000
PLAIN = {"PYTHONPATH": "runtime", "PYTHONDONTWRITEBYTECODE": "1"}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short run: `run.mcap` and `run.json`."""
    folder = tmp_path_factory.mktemp("recorded")
    done = specc(
        "run", CONVEYOR, "--duration", 12, "--record", folder / "run.mcap",
        "--report", folder / "run.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder


def test_every_step_is_there(recorded: Path) -> None:
    report = json.loads((recorded / "run.json").read_text())
    found = messages(recorded / "run.mcap")
    for name, told in report["subsystems"].items():
        steps = found[f"/{name}"]
        assert [data["stamp"] for _, data in steps] == list(range(told["steps"]))
        states = [data["state"] for _, data in steps]
        assert {s: states.count(s) for s in set(states)} == told["states_visited"]
        rows = [data["transition"] for _, data in steps if data["row"] >= 0]
        assert {r: rows.count(r) for r in set(rows)} == told["transitions_taken"]
        for (_, last), (message, data) in pairwise(steps):
            assert data["before"] == last["state"]
            assert message.log_time == round(data["time"] * 1e9)
            asked = data["conditions"]
            ended = [name for name, holds in asked.items() if holds]
            assert bool(ended) == (data["row"] >= 0)


def test_what_one_sends_is_what_the_other_reads(recorded: Path) -> None:
    found = messages(recorded / "run.mcap")
    sent = {data["y"]["c"]["v"] for _, data in found["/belt.drive"]}
    read = {data["x"]["drive"]["v"] for _, data in found["/belt.c"]}
    assert len(read) > 10
    assert read <= sent | {0.0}
    assert any(data["fresh"]["gate.hold"] for _, data in found["/belt.c"])


def test_messages_have_the_schemas_that_the_file_says(recorded: Path) -> None:
    with (recorded / "run.mcap").open("rb") as file:
        kinds = set()
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None and schema.encoding == "jsonschema"
            assert channel.message_encoding == "json"
            kinds.add(schema.name)
            if message.log_time < 10**9 or channel.topic == "/snapshot":
                _checker(schema.data).validate(json.loads(message.data))
    assert {"foxglove.FrameTransforms", "specc.Snapshot", "specc.Step.belt.c"} <= kinds
    assert "foxglove.SceneUpdate" in kinds


@cache
def _checker(schema: bytes) -> jsonschema.Draft202012Validator:
    form = json.loads(schema)
    assert form["type"] == "object"
    jsonschema.Draft202012Validator.check_schema(form)
    return jsonschema.Draft202012Validator(_closed(form))


def _closed(form: dict[str, Any]) -> dict[str, Any]:
    """A schema that allows no more than it names."""
    form = {key: _closed(part) if type(part) is dict else part for key, part in form.items()}
    return form | {"additionalProperties": False} if "properties" in form else form


@pytest.mark.no_replay("replayed here")
@pytest.mark.parametrize(
    ("where", "spec"),
    every(
        4,
        [
            (".", "cells/gate/gate.yaml"),
            ("cells", "gate/gate.yaml"),
            ("cells/gate", "../gate/./gate.yaml"),
            ("elsewhere", "../cells/gate/gate.yaml"),
        ],
    ),
)
def test_names_of_attached_files_stay_in_a_folder(where: str, spec: str, tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text("[tool.specc]\nignore = ['W']\n")
    for folder in ("cells/gate/plants", "parts", "elsewhere"):
        (tmp_path / folder).mkdir(parents=True)
    text = CONVEYOR.read_text(encoding="utf-8")
    (tmp_path / "cells/gate/gate.yaml").write_text(f"use: [../../parts/lib.yaml]\n{text}")
    (tmp_path / "parts/lib.yaml").write_text("specc: 1\nconstants: {spare: 1}\n")
    (tmp_path / "cells/gate/plants/conveyor_gate.xml").write_bytes(
        (CONVEYOR.parent / "plants/conveyor_gate.xml").read_bytes()
    )
    file = tmp_path / "run.mcap"
    done = specc("run", spec, "--duration", 2, "--record", file, cwd=tmp_path / where)
    assert done.returncode == 0, done.stderr
    with file.open("rb") as opened:
        found = [item.name for item in make_reader(opened).iter_attachments()]
    assert found == ["cells/gate/gate.yaml", "parts/lib.yaml"]
    done = specc("replay", file, "--spec", spec, cwd=tmp_path / where)
    assert done.returncode == 0, done.stderr
    done = specc("run", spec, "--from", f"{file}@1.5", "--duration", 2, cwd=tmp_path / where)
    assert done.returncode == 0 and "--from" not in done.stderr


def test_specification_and_report_are_inside(recorded: Path) -> None:
    with (recorded / "run.mcap").open("rb") as file:
        reader = make_reader(file)
        attached = {item.name: item.data for item in reader.iter_attachments()}
        told = {item.name: item.metadata for item in reader.iter_metadata()}
    # As it was named, but never with the folders above it.
    assert attached == {"specs/conveyor_gate.yaml": CONVEYOR.read_bytes()}
    assert told["specc"]["seed"] == "0"
    report = json.loads((recorded / "run.json").read_text())
    inside = json.loads(told["report"]["report"])
    keys = ("records_sha256", "subsystems", "faults", "ended")
    assert {key: inside[key] for key in keys} == {key: report[key] for key in keys}


def test_a_recording_changes_no_record(recorded: Path, tmp_path: Path) -> None:
    done = specc("run", CONVEYOR, "--duration", 12, "--report", tmp_path / "run.json")
    assert done.returncode == 0
    with_it, without = (
        json.loads((folder / "run.json").read_text())["records_sha256"]
        for folder in (recorded, tmp_path)
    )
    assert with_it == without


@pytest.mark.long
def test_ctrl_c_leaves_a_finished_file(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    process = begun(*ENDLESS, file)
    _await(file, 20_000)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130
    with file.open("rb") as opened:
        told = {item.name: item.metadata for item in make_reader(opened).iter_metadata()}
    assert json.loads(told["report"]["report"])["ended"] == "interrupted"
    steps = [data["stamp"] for _, data in messages(file)["/gate.eye"]]
    assert steps == list(range(len(steps)))


def _await(file: Path, size: int) -> None:
    """Until the file is so large."""
    while not file.exists() or file.stat().st_size < size:
        time.sleep(0.01)


@pytest.mark.long
@pytest.mark.parametrize("seeds", blocks([1], long=1, each=1))
def test_a_killed_run_leaves_all_but_the_last_second(seeds: Sequence[int], tmp_path: Path) -> None:
    file, out = tmp_path / "run.mcap", tmp_path / "clean.mcap"
    process = begun(*ENDLESS, file)
    _await(file, 1)
    time.sleep(random.Random(seeds[0]).uniform(0.6, 2.6))
    process.kill()
    killed_ns = time.time_ns()
    process.communicate(timeout=60)
    done = specc("recover", file, "--out", out)
    assert done.returncode == 0 and "it had been cut" in done.stderr
    found = messages(out)
    last_ns = max(message.publish_time for steps in found.values() for message, _ in steps)
    assert killed_ns - last_ns < LATE_NS
    for name in ("/belt.c", "/gate.c", "/gate.eye"):
        stamps = [data["stamp"] for _, data in found[name]]
        assert stamps == list(range(len(stamps)))


def test_recovering_in_place_keeps_a_whole_file(recorded: Path, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    file.write_bytes((recorded / "run.mcap").read_bytes())
    done = specc("recover", file)
    assert done.returncode == 0 and "it was whole" in done.stderr
    before, after = messages(recorded / "run.mcap"), messages(file)
    assert {t: [d for _, d in m] for t, m in before.items()} == {
        t: [d for _, d in m] for t, m in after.items()
    }
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 8), long=15, each=20))
@pytest.mark.no_replay("damaged")
def test_damaged_files_are_read_as_far_as_they_go(
    seeds: Sequence[int], recorded: Path, tmp_path: Path
) -> None:
    whole = Recovered(recorded / "run.mcap", tmp_path / "whole.mcap")
    for seed in seeds:
        folder = tmp_path / str(seed)
        folder.mkdir()
        is_read_as_far_as_it_goes(seed, recorded, whole, folder)


def is_read_as_far_as_it_goes(seed: int, recorded: Path, whole: Recovered, tmp_path: Path) -> None:
    """A recording that is damaged, or cut where the seed is odd."""
    chance = random.Random(seed)
    data = bytearray((recorded / "run.mcap").read_bytes())
    if seed % 2:
        del data[chance.randrange(len(data)) :]
    for _ in range(chance.choice((0, 1, 20))):
        data[chance.randrange(len(data))] = chance.randrange(256)
    file = tmp_path / "damaged.mcap"
    file.write_bytes(data)
    try:
        saved = Recovered(file, tmp_path / "clean.mcap")
    except Unusable as why:
        is_foreign = data[:8] != (recorded / "run.mcap").read_bytes()[:8]
        assert is_foreign or "nothing is left" in str(why)
        assert list(tmp_path.iterdir()) == [file]
        return
    assert saved.messages <= whole.messages
    messages(tmp_path / "clean.mcap")


@pytest.mark.parametrize("at", [30, 0.3])
@pytest.mark.no_replay("damaged")
def test_what_is_damaged_is_passed_over_and_stays_in_place(
    at: float, recorded: Path, tmp_path: Path
) -> None:
    data = bytearray((recorded / "run.mcap").read_bytes())
    begin = int(at if at > 1 else at * len(data))
    data[begin : begin + 180] = random.Random(0).randbytes(180)
    file = tmp_path / "run.mcap"
    file.write_bytes(data)
    done = specc("recover", file)
    assert done.returncode == 2 and file.read_bytes() == data
    assert "stays as it is" in done.stderr or "nothing is left" in done.stderr
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.no_replay("damaged")
def test_a_damaged_record_hides_no_later_one(recorded: Path, tmp_path: Path) -> None:
    data = bytearray((recorded / "run.mcap").read_bytes())
    name = data.index(b"conveyor_gate.yaml")  # of the attachment
    data[name : name + 4] = b"\xff" * 4
    (tmp_path / "run.mcap").write_bytes(data)
    saved = Recovered(tmp_path / "run.mcap", tmp_path / "clean.mcap")
    whole = Recovered(recorded / "run.mcap", tmp_path / "whole.mcap")
    assert (saved.damaged, saved.messages) == (1, whole.messages)


@pytest.mark.long
@pytest.mark.no_replay("no recording")
def test_a_clean_file_takes_the_place_of_recordings_only(recorded: Path, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("specc: 1\n")
    done = specc("recover", recorded / "run.mcap", "--out", spec)
    assert done.returncode == 2 and "what is there is no recording" in done.stderr
    assert spec.read_text() == "specc: 1\n"


@pytest.mark.parametrize("content", [b"", b"hello\n", b"x" * 5000])
@pytest.mark.no_replay("no recordings")
def test_foreign_files_are_refused_and_stay(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "foreign.mcap"
    file.write_bytes(content)
    done = specc("recover", file)
    assert done.returncode == 2
    assert done.stderr == f"specc: {file} is no MCAP file\n"
    assert file.read_bytes() == content


@pytest.mark.long
@pytest.mark.no_replay("not of a run")
def test_chunks_stay_small(tmp_path: Path) -> None:
    log = Log(tmp_path / "large.mcap", WallClock())
    channel = log.channel("/a", "a", {})
    for each in range(5):
        channel.add(each, b"\0" * (1 << 24))
    log.close()
    with (tmp_path / "large.mcap").open("rb") as opened:
        summary = make_reader(opened).get_summary()
    assert summary and len(summary.chunk_indexes) >= 2
    assert all(each.uncompressed_size < 1 << 26 for each in summary.chunk_indexes)


@pytest.mark.no_replay("not of a run")
def test_what_waits_to_be_written_is_bounded_in_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("specc_runtime.recording.log.MOST_BYTES", 1 << 18)
    monkeypatch.setattr(Log, "_work", lambda log: None)  # as slow as it can be
    log = Log(tmp_path / "large.mcap", WallClock())
    channel, chance = log.channel("/a", "a", {}), random.Random(0)
    for count in range(1, 65):
        channel.add(0.0, chance.randbytes(1 << 16))
        assert log.path.stat().st_size > (count << 16) - (3 << 19)
    log.close()


@pytest.mark.parametrize("out", ["/", ".", "{}"])
def test_a_clean_file_in_the_place_of_a_folder(out: str, recorded: Path, tmp_path: Path) -> None:
    done = specc("recover", recorded / "run.mcap", "--out", out.format(tmp_path))
    assert done.returncode == 2 and "it is a folder" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--record", "{}/a", "--report", "{}/a"), "two things that are asked for go there"),
        (("--record", "{}/no/run.mcap"), "there is no folder"),
        (("--record", "{}"), "it is a folder"),
        (("--record", "/dev/null"), "it is no ordinary file"),
        (("--record-exact",), "--record-exact: the run is not recorded; add --record"),
    ],
)
def test_misuse_is_told_before_the_run(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    done = specc("run", CONVEYOR, "--duration", 1, *(a.format(tmp_path) for a in arguments))
    assert done.returncode == 2
    assert words in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("size", short([100, 30_000]))
@pytest.mark.no_replay("cut before the first step")
def test_a_full_disk_is_told_and_leaves_what_was_written(size: int, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"

    def limited() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    command = (
        "import sys; from specc_runtime.main import main; "
        f"sys.exit(main(['generated/conveyor_gate', '--base', 'specs', '--quiet', "
        f"'--duration', '12', '--record', {str(file)!r}]))"
    )

    done = subprocess.run(
        [sys.executable, "-c", command], cwd=ROOT, capture_output=True, text=True,
        preexec_fn=limited, timeout=120, check=False, env=PLAIN,
    )  # fmt: skip
    assert done.returncode == 2
    assert f"error: the recording {file} is not complete: File too large" in done.stderr
    assert "Traceback" not in done.stderr
    assert len(list(RecordFile(file))) >= (size > 10_000)


def test_without_the_library_the_extra_is_named(tmp_path: Path) -> None:

    command = (
        "import sys; sys.modules['mcap'] = None; from specc_runtime.main import main; "
        "sys.exit(main(['generated/conveyor_gate', '--base', 'specs', '--duration', '1', "
        f"'--record', {str(tmp_path / 'run.mcap')!r}]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", command], cwd=ROOT, capture_output=True, text=True,
        timeout=120, check=False, env=PLAIN,
    )  # fmt: skip
    assert done.returncode == 2
    assert re.search(r"mcap is not installed: `.* install .*\[record\]'?` brings it", done.stderr)
