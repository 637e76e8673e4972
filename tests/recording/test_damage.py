"""One damaged byte, wherever it is, loses at most one simulated second; a cut what lies behind."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader
from specc_runtime.recording.messages import recorded
from specc_runtime.recording.reading import Channel, Message, RecordFile, Recovered, Unusable
from specc_runtime.recording.spans import FRAME, MAGIC, Spans

from specc.cli.main import main
from tests.recording.runs import CONVEYOR, ROOT, messages, specc
from tests.seeds import SOAK, short

KEPT = Path(__file__).with_name("conveyor_gate.mcap")
FLAGSHIP = ROOT / "specs" / "irp_picking.yaml"
MOST_NS = 10**9
Found = set[tuple[str, int, bytes]]
pytestmark = pytest.mark.no_replay("damaged")


def _read(file: Path) -> tuple[Found, RecordFile]:
    """Topics, times in ns and data of all messages that can be read."""
    topics: dict[int, str] = {}
    found: Found = set()
    reading = RecordFile(file)
    for record in reading:
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            found.add((topics[record.channel_id], record.log_time, record.data))
    return found, reading


def _records(data: bytes) -> Iterator[int]:
    """Where the records of a whole file begin."""
    place = len(MAGIC)
    while place < len(data) - len(MAGIC):
        yield place
        place += FRAME.size + FRAME.unpack_from(data, place)[1]


def _structural(data: bytes) -> list[int]:
    """Places that say where something else is: all of the ends, and the heads of all records."""
    places = {*range(len(MAGIC)), *range(len(data) - 40, len(data))}
    for begin in _records(data):
        places.update(range(begin, min(begin + FRAME.size + 45, len(data))))
    return sorted(places)


def _one_flipped(file: Path, places: list[int], scratch: Path) -> None:
    """Hold a recording to the law for each of these places."""
    data, chance = file.read_bytes(), random.Random(0)
    whole, _ = _read(file)
    told, texts = recorded(file)
    damaged = scratch / "damaged.mcap"
    for place in places:
        flipped = bytearray(data)
        flipped[place] ^= 1 << chance.randrange(8)
        damaged.write_bytes(flipped)
        found, reading = _read(damaged)
        assert found <= whole, f"what is read at {place} was not written"
        times = [time_ns for _, time_ns, _ in whole - found]
        assert not times or max(times) - min(times) < MOST_NS, place
        assert not times or reading.damaged == 1, place
        assert not reading.cut, place
        again, once_more = recorded(damaged)
        assert (again, [*once_more.items()]) == (told, [*texts.items()]), place


@pytest.mark.parametrize(("many", "heads"), short([(10, 25), (30, 60)], 0))
def test_one_flipped_byte(many: int, heads: int, tmp_path: Path) -> None:
    data, chance = KEPT.read_bytes(), random.Random(1)
    anywhere = [chance.randrange(len(data)) for _ in range(many)]
    ends = [0, 7, 9, 20, len(data) - 1, len(data) - 12, len(data) - 30]
    structural = chance.sample(_structural(data), heads)
    _one_flipped(KEPT, [*anywhere, *ends, *structural], tmp_path)


@pytest.mark.parametrize(
    ("duration_s", "count"),
    [pytest.param(2, 60, marks=pytest.mark.long), pytest.param(8, 200, marks=SOAK)],
)
def test_one_flipped_byte_of_the_flagship(duration_s: int, count: int, tmp_path: Path) -> None:
    file, chance = tmp_path / "run.mcap", random.Random(1)
    assert specc("run", FLAGSHIP, "--duration", duration_s, "--record", file).returncode == 0
    data = file.read_bytes()
    anywhere = [chance.randrange(len(data)) for _ in range(count)]
    heads = [begin + chance.randrange(50) for begin in _records(data)]
    places = [*anywhere, *(p for p in heads if p < len(data)), *range(len(data) - 40, len(data))]
    _one_flipped(file, places, tmp_path)


def test_a_cut_loses_no_more_than_a_second_before(tmp_path: Path) -> None:
    data, chance = KEPT.read_bytes(), random.Random(2)
    whole, _ = _read(KEPT)
    before = 0
    for size in sorted(chance.randrange(2000, len(data)) for _ in range(30)):
        (tmp_path / "cut.mcap").write_bytes(data[:size])
        found, reading = _read(tmp_path / "cut.mcap")
        assert found <= whole and reading.damaged == 0
        assert len(found) >= before, "more of the file has less"
        before = len(found)
        last_ns = max((time_ns for _, time_ns, _ in found), default=0)
        missing = {one for one in whole - found if one[1] < last_ns - MOST_NS}
        assert not missing, size


def test_what_is_recovered_can_be_damaged_again(tmp_path: Path) -> None:
    data = bytearray(KEPT.read_bytes())
    data[len(data) // 2] ^= 4
    (tmp_path / "damaged.mcap").write_bytes(data)
    clean = tmp_path / "clean.mcap"
    saved = Recovered(tmp_path / "damaged.mcap", clean)
    found, _ = _read(tmp_path / "damaged.mcap")
    assert (saved.damaged, saved.cut, saved.messages) == (1, False, len(found))
    assert sum(map(len, messages(clean).values())) == len(found)
    size = clean.stat().st_size
    _one_flipped(clean, [random.Random(3).randrange(size) for _ in range(15)], tmp_path)


def test_readers_of_others_see_everything_once() -> None:
    with KEPT.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        names = [item.name for item in reader.iter_attachments()]
        told = [item.name for item in reader.iter_metadata()]
        count = sum(1 for _ in reader.iter_messages())
    assert summary and summary.statistics
    assert count == summary.statistics.message_count == len(_read(KEPT)[0])
    assert names == [*recorded(KEPT)[1]] and told == ["specc", "report"]
    for chunk in summary.chunk_indexes:
        assert chunk.message_end_time - chunk.message_start_time <= MOST_NS // 2


def _damaged_at(time_s: float, file: Path) -> None:
    """The kept recording without the chunk with the steps of that time."""
    data, chance = bytearray(KEPT.read_bytes()), random.Random(0)
    with KEPT.open("rb") as opened:
        summary = make_reader(opened).get_summary()
    assert summary
    for chunk in summary.chunk_indexes:
        if chunk.message_start_time <= time_s * 1e9 <= chunk.message_end_time:
            begin = chunk.chunk_start_offset + chance.randrange(chunk.chunk_length)
            data[begin] ^= 1
    file.write_bytes(data)


def test_a_replay_goes_on_behind_what_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "damaged.mcap"
    _damaged_at(2.3, file)
    assert main(["replay", str(file), "--spec", str(CONVEYOR)]) == 3
    out, err = capsys.readouterr()
    assert "damaged parts left out: 1" in err
    lines = [line for line in out.splitlines() if "steps are the same" in line]
    assert len(lines) == 5
    for line in lines:
        assert "; lost from 2" in line and "compared again from 3 s" in line
        assert "cannot be compared" not in line


@pytest.mark.long
def test_a_difference_behind_what_is_lost_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, spec = tmp_path / "damaged.mcap", CONVEYOR
    other = tmp_path / spec.name
    other.write_text(spec.read_text().replace("elapsed > 2.5[s]", "elapsed > 2.4[s]"))
    (tmp_path / "plants").symlink_to(spec.parent / "plants")
    (tmp_path / "pyproject.toml").write_text(f"[tool.specc]\nallow = ['{spec.parent}']\n")
    assert main(["replay", str(KEPT), "--spec", str(other)]) == 1
    expected = capsys.readouterr().out.splitlines()[0]
    _damaged_at(1.2, file)
    assert main(["replay", str(file), "--spec", str(other)]) == 1
    assert capsys.readouterr().out.splitlines()[0] == expected


def test_a_cut_recording_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = KEPT.read_bytes()
    file = tmp_path / "cut.mcap"
    file.write_bytes(data[: len(data) * 2 // 3])
    assert main(["replay", str(file), "--spec", str(CONVEYOR)]) == 3
    out, err = capsys.readouterr()
    assert "it was cut after " in err and "differs" not in out


def test_heads_that_are_none_take_no_time(tmp_path: Path) -> None:
    data = KEPT.read_bytes()
    begin = next(_records(data[:200])) + FRAME.size
    head = data[begin + 13 : begin + 13 + 54]
    forged = tmp_path / "forged.mcap"
    forged.write_bytes(MAGIC + head * 20_000)
    with forged.open("rb") as file:
        spans = Spans(file)
        assert list(spans) == [] and not spans.found
    with pytest.raises(Unusable, match="nothing is left"):
        Recovered(forged, tmp_path / "clean.mcap")
