"""Recordings replay bit for bit, and after a change the first step that differs is named."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.records import Attachment, Channel, Message
from mcap.writer import Writer
from specc_runtime.forms import Misshapen
from specc_runtime.recording.cells import digest_of
from specc_runtime.recording.messages import image_of, unpacked
from specc_runtime.recording.reading import RecordFile, Recovered

from specc.cli.main import main
from tests.recording.replayed import differences
from tests.recording.runs import CONVEYOR, ROOT, messages, specc
from tests.seeds import every, short

KEPT = Path(__file__).with_name("conveyor_gate.mcap")
"""`specc run specs/conveyor_gate.yaml --duration 6 --record-exact --record …`"""
HALF = json.dumps({k: v for k, v in messages(KEPT)["/belt.c"][0][1].items() if k != "y"})
FLAGSHIP = ROOT / "specs" / "irp_picking.yaml"


def test_the_recording_that_is_kept_replays() -> None:
    done = specc("replay", KEPT, "--spec", CONVEYOR, "--check")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout == (
        "belt.c: 120 steps are the same\n"
        "belt.drive: 600 steps are the same\n"
        "gate.c: 120 steps are the same\n"
        "gate.barrier: 600 steps are the same\n"
        "gate.eye: 300 steps are the same\n"
        "met always(state(gate.c) == opening implies belt.E.drive.v_m < 0.1[rad/s]), "
        "margin 0.0957\n"
        "met always(state(gate.c) == halting implies within(patience, state(gate.c) == opening))\n"
        "contract met drive.stands: always(stays(y.E.drive.v_s, 0.5[s]) and "
        "abs(y.E.drive.v_s) <= 0 implies abs(x.E.drive.v_m) < 0.015[rad/s]), margin 0.0133\n"
    )


def test_part_of_a_recording_replays() -> None:
    done = specc("replay", KEPT, "--spec", CONVEYOR, "--subsystem", "gate.eye", "--until", "0.1")
    assert (done.returncode, done.stdout) == (0, "gate.eye: 6 steps are the same\n")


@pytest.mark.long
@pytest.mark.parametrize(("exact", "code", "periods"), [(True, 0, 6), (False, 1, 6)])
def test_the_flagship_replays_with_its_images(
    exact: bool, code: int, periods: int, tmp_path: Path
) -> None:
    """So many periods of its camera, of 0.2 s, in each of which its arm makes 100 steps."""
    file = tmp_path / "run.mcap"
    more = ["--record-exact"] * exact
    assert (
        specc("run", FLAGSHIP, "--duration", periods / 5, "--record", file, *more).returncode == 0
    )
    assert not exact or list(_named_too_early(file)) == []
    done = specc("replay", file, "--spec", FLAGSHIP, "--check")
    assert done.returncode == code, done.stdout
    assert "differs" not in done.stdout
    assert (f"irp.m: {periods}00 steps are the same\n" in done.stdout) == exact
    assert (
        f"irp.m: {periods}00 steps are the same; not recorded: R_p, arm\n" in done.stdout
    ) != exact
    assert (f"irp.k: {periods} steps are the same\n" in done.stdout) == exact
    words = "irp.k: 0 steps are the same, then it cannot be compared: stamp 0 reads x.R.I_rgb"
    assert (words in done.stdout) != exact


def _named_too_early(file: Path) -> Iterator[str]:
    """The digests that a message names before what they stand for was written."""
    written = set()
    topics = {r.id: r.topic for r in RecordFile(file) if isinstance(r, Channel)}
    for record in RecordFile(file):
        if isinstance(record, Message):
            topic = topics[record.channel_id]
            if topic == "/values":
                written.add(digest_of(unpacked(json.loads(record.data))))
            elif "/x/" in topic:
                schema = "specc.DepthImage" if topic.endswith("/I_d") else "foxglove.RawImage"
                written.add(digest_of(image_of(record.data, schema).tobytes()))
            else:
                named = re.findall(r'"(?:digest|image)":"(\w+)"', record.data.decode())
                yield from (digest for digest in named if digest not in written)


# A run of a changed specification does the same as before until its first step that differs. So
# where the two runs part is where the replay has to find it.

CHANGES = [
    ("elapsed > 2.5[s]", "elapsed > 2.4[s]"),
    ("near(x.belt.v, 0, 0.02[rad/s])", "near(x.belt.v, 0, 0.05[rad/s])"),
    ("near(x.barrier.a, up, 0.05[rad])", "near(x.barrier.a, up, 0.1[rad])"),
    ("near(x.barrier.a, 0, 0.05[rad])", "near(x.barrier.a, 0, 0.1[rad])"),
    ("parcel_came: x.eye.parcel", "parcel_came: x.eye.parcel and elapsed > 3[s]"),
    ("stuck: elapsed > patience", "stuck: elapsed > 0.1 * patience"),
    ("y.belt.go: cruise", "y.belt.go: 0.9 * cruise"),
    ("y.belt.hold: 2 * patience", "y.belt.hold: patience"),
    ("y.barrier.a_d: up", "y.barrier.a_d: 0.9 * up"),
    ("lower: {y.barrier.a_d: 0}", 'lower: {y.barrier.a_d: "0.01[rad]"}'),
    ("y.E.v_s: v_n", "y.E.v_s: 0.5 * v_n"),
    ("v_p: v_n}", "v_p: 0.5 * v_n}"),
    ("y.c.v: x.E.v_m", "y.c.v: 2 * x.E.v_m"),
    ("x.R.d < seen", "x.R.d < 2 * seen"),
    ("[halting, terminal, always, opening]", "[halting, terminal, always, passing]"),
    ("[opening, terminal, always, passing]", "[opening, terminal, always, closing]"),
    ("[passing, terminal, always, closing]", "[passing, terminal, always, closed]"),
    ("[closed,  terminal, always, halting]", "[closed,  terminal, always, opening]"),
    ("y.drive.v_d: x.gate.go", "y.drive.v_d: 0.5 * x.gate.go"),
    ("y.gate.v: x.drive.v", "y.gate.v: -x.drive.v"),
    ("stop: {y.drive.v_d: 0}", 'stop: {y.drive.v_d: "0.1[rad/s]"}'),
    ("y.E.a_d: x.c.a_d", "y.E.a_d: 0.5 * x.c.a_d"),
]
FOUND = re.compile(r"(\S+) differs first at (\S+) s \(stamp (\d+)\), in [^:]*: (\S+)\n")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the conveyor in which every state is entered."""
    file = tmp_path_factory.mktemp("replayed") / "run.mcap"
    assert specc("run", CONVEYOR, "--duration", 7, "--record", file).returncode == 0
    return file


def _changed(folder: Path, old: str, new: str) -> tuple[Path, int]:
    """The specification with a change, beside its plant, and the line of the change."""
    text = CONVEYOR.read_text()
    assert text.count(old) == 1
    spec = folder / "conveyor_gate.yaml"
    spec.write_text(text.replace(old, new))
    if not (folder / "plants").exists():
        (folder / "plants").symlink_to(CONVEYOR.parent / "plants")
    (folder / "pyproject.toml").write_text(f"[tool.specc]\nallow = ['{CONVEYOR.parent}']\n")
    return spec, text[: text.index(old)].count("\n") + 1


def _parting(one: Path, other: Path) -> tuple[float, str, int]:
    """Time, subsystem and stamp of the first step in which two runs differ."""
    told = ("transition", "state", "y", "memory")
    first, second = messages(one), messages(other)
    found = []
    for topic in first.keys() - {"/tf", "/scene", "/snapshot", "/requirements"}:
        for (_, a), (_, b) in zip(first[topic], second[topic], strict=False):
            if [json.dumps(a[key]) for key in told] != [json.dumps(b[key]) for key in told]:
                found.append((a["time"], topic[1:], a["stamp"]))
                break
    return min(found)


@pytest.mark.parametrize(
    ("old", "new"),
    short(CHANGES, 11),
)
@pytest.mark.no_replay("replayed here")
def test_the_first_step_after_a_change_is_found(
    old: str, new: str, recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec, line = _changed(tmp_path, old, new)
    other = tmp_path / "other.mcap"
    code = main(["run", str(spec), "--duration", "7", "--record", str(other)])
    assert other.exists(), (code, *capsys.readouterr())
    capsys.readouterr()
    assert main(["replay", str(recorded), "--spec", str(spec)]) == 1
    out = capsys.readouterr().out
    found = FOUND.match(out)
    assert found, out
    time_s, name, stamp = _parting(recorded, other)
    assert (found[1], int(found[3])) == (name, stamp)
    assert float(found[2]) == pytest.approx(time_s, rel=1e-4)
    assert f"{spec}:{line}: " in out.split(" differs first ")[1]


def test_other_words_are_no_difference(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec, _ = _changed(tmp_path, "title: Belt drive", "title: What drives the belt")
    assert main(["replay", str(recorded), "--spec", str(spec), "--check"]) == 0


def test_what_nothing_asked_then_is_not_made_up(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asks = "move: {y.E.a_d: 'x.c.a_d if fresh(x.c.a_d) else 0'}"
    spec, _ = _changed(tmp_path, "move: {y.E.a_d: x.c.a_d}", asks)
    assert main(["replay", str(recorded), "--spec", str(spec)]) == 0
    out = capsys.readouterr().out
    assert "gate.barrier: 0 steps are the same, then it cannot be compared" in out
    assert "whether x.c.a_d is fresh, which nothing asked then" in out


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "is no MCAP file"), (b"\x89MCAP0\r\n", "is no recording of specc")],
)
@pytest.mark.no_replay("no recordings")
def test_unusable_files(content: bytes, words: str, tmp_path: Path) -> None:
    file = tmp_path / "x.mcap"
    file.write_bytes(content)
    done = specc("replay", file)
    assert done.returncode == 2
    assert done.stderr == f"specc: {file} {words}\n"


def test_a_recording_of_a_specification_that_is_elsewhere(tmp_path: Path) -> None:
    spec, _ = _changed(tmp_path, "title: Belt drive", "title: A drive")
    assert specc("run", spec, "--duration", 1, "--record", tmp_path / "x.mcap").returncode == 0
    done = specc("replay", tmp_path / "x.mcap")
    assert done.returncode == 2
    assert f"x.mcap is of {spec.name}, which is not here; say --spec" in done.stderr
    assert str(tmp_path).encode() not in b"".join(
        item.data if isinstance(item, Attachment) else repr(item).encode()
        for item in RecordFile(tmp_path / "x.mcap")
    )


@pytest.mark.no_replay("forged")
def test_no_file_decides_which_specification_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever it names, be it a specification of the folder whose operators are no longer good."""
    monkeypatch.chdir(tmp_path)
    _forged(tmp_path / "kept.mcap", "/belt.c", HALF.encode(), spec="specs/a b.yaml")
    assert main(["replay", "kept.mcap"]) == 2
    told = capsys.readouterr().err
    assert told == "specc: kept.mcap is of specs/a b.yaml, which is not here; say --spec\n"
    (tmp_path / "specs").mkdir()
    (tmp_path / "specs" / "a b.yaml").write_text(CONVEYOR.read_text())
    assert main(["replay", "kept.mcap"]) == 2
    out, told = capsys.readouterr()
    assert not out
    assert told == (
        "specc: kept.mcap is of specs/a b.yaml; no recording decides which specification runs, "
        "so name it: specc replay kept.mcap '--spec=specs/a b.yaml'\n"
    )


def _forged(file: Path, topic: str, text: bytes, **told: str) -> None:
    """A recording of one step, that a stranger made."""
    writer = Writer(str(file))
    writer.start()
    writer.add_metadata("specc", {"format": "1", "exact": "true"} | told)
    schema = writer.register_schema(f"specc.Step.{topic[1:]}", "jsonschema", b"{}")
    writer.add_message(writer.register_channel(topic, "json", schema), 0, text, 0)
    writer.finish()


@pytest.mark.no_replay("forged")
def test_what_was_not_recorded_is_not_the_same(tmp_path: Path) -> None:
    _forged(tmp_path / "x.mcap", "/belt.x", b"{}")
    done = specc("replay", tmp_path / "x.mcap", "--spec", CONVEYOR, "--check")
    assert done.returncode == 2
    assert done.stderr == f"specc: nothing in {tmp_path}/x.mcap can be compared with {CONVEYOR}\n"
    words = "0 steps are the same, then it cannot be compared: "
    assert f"belt.x: {words}the specification does not have it\n" in done.stdout
    assert f"belt.c: {words}no step of it was recorded\n" in done.stdout


@pytest.mark.parametrize(
    "text", every(2, ["[]", '{"stamp":0}', '{"stamp":"0","time":0.0}', "{", "1e999", HALF])
)
@pytest.mark.no_replay("forged")
def test_messages_that_are_no_steps(text: str, tmp_path: Path) -> None:
    file = tmp_path / "x.mcap"
    _forged(file, "/belt.c", text.encode())
    done = specc("replay", file, "--spec", CONVEYOR)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert done.stderr.startswith(f"specc: {file}: /belt.c at 0 s: ")


def test_bytes_that_are_none_are_told() -> None:
    with pytest.raises(Misshapen, match="no bytes"):
        unpacked({"bytes": "\u00e9"})


@pytest.mark.parametrize("name", ["a\0b", "x" * 5000])
@pytest.mark.no_replay("forged")
def test_names_that_no_file_has(name: str, tmp_path: Path) -> None:
    _forged(tmp_path / "x.mcap", "/belt.c", b"{}", spec=name)
    done = specc("replay", tmp_path / "x.mcap")
    assert done.returncode == 2 and "which is not here; say --spec" in done.stderr


@pytest.mark.no_replay("forged")
def test_a_seed_that_no_run_has(tmp_path: Path) -> None:
    _forged(tmp_path / "x.mcap", "/belt.c", HALF.encode(), seed="9" * 5000)
    done = specc("run", CONVEYOR, "--duration", 1, "--from", f"{tmp_path}/x.mcap@0.0000001")
    assert done.returncode == 2 and "does not say with which seed" in done.stderr


@pytest.mark.no_replay("with another specification inside")
def test_recordings_of_tests_that_are_not_the_same_are_found(tmp_path: Path) -> None:
    class Changed(Recovered):
        def _copy(self, record: Any, *to: Any) -> None:
            if isinstance(record, Attachment):
                record.data = record.data.replace(b"elapsed > 2.5[s]", b"elapsed > 2.1[s]")
            super()._copy(record, *to)

    file = tmp_path / "x.mcap"
    Recovered(KEPT, file)
    assert not differences(file, tmp_path)
    Changed(KEPT, file)
    assert "what='row'" in " ".join(differences(file, tmp_path, until_s=6))


@pytest.mark.no_replay("its specification has a name that is no UTF-8")
def test_a_specification_whose_name_is_no_utf_8_is_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    specs = Path(__file__).resolve().parents[2] / "specs"
    (tmp_path / "plants").mkdir()
    shutil.copy(specs / "plants/conveyor_gate.xml", tmp_path / "plants")
    name = os.fsdecode(b"gate\xff.yaml")
    shutil.copy(specs / "conveyor_gate.yaml", tmp_path / name)
    monkeypatch.chdir(tmp_path)
    recording = ("--record", "r.mcap", "--record-exact", "--renderer", "raycast")
    assert main(["run", name, "--duration", "0.1", *recording]) == 0
    capsys.readouterr()
    assert main(["replay", "r.mcap", "--spec", name]) == 0
    assert "steps are the same" in capsys.readouterr().out
