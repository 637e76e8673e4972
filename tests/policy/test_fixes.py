"""`--fix`: what it mends, that it mends no more, and that twice is once."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from specc.cli import main
from specc.cli.fix import apply_compatible, is_wrong_again
from specc.diagnostics import Diagnostic, Edit, Fix, sole_correction
from specc.diagnostics.renaming import renamed_as_written
from specc.diagnostics.report import Change, Repair, resolve
from specc.source import Place, SourceFile, Sources, Span
from tests.policy.specs import write

NOWHERE = Span("a.yaml", 1, 1, 1, 1)


def mended(path: Path) -> tuple[int, str]:
    """Exit code of `--fix`, and the text of the file."""
    return main(["validate", "--fix", path.name]), path.read_text()


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write(tmp_path / "a.yaml")


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("behaviours: {work", "behavours: {work"),
        ("functions: [send]", 'functions: ["sendd"]'),
        ("{S0: work}", "{S0: wrok}"),
        ("initial_state: S0\n    virtual", "initial_stat: S0\n    virtual"),
        ("y: {m: {d: real}}", "y: {m: {d: reall}}"),
        ("let: {other: 1}", "let: {other: sqrt(spare), more: sqrt(4) + othr}"),
    ],
)
def test_typing_errors_are_mended_and_nothing_else_is_touched(
    right: str, wrong: str, spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = spec.read_text().replace("\n  a:", "\n  a:   # odd   layout\n", 1)
    wanted = good
    spec.write_text(good.replace(right, wrong))
    code, text = mended(spec)
    if "sendd" in wrong:
        wanted = good.replace(right, 'functions: ["send"]')
    if "othr" in wrong:
        wanted = good.replace(right, "let: {other: sqrt(spare), more: sqrt(4) + other}")
    assert (code, text) == (0, wanted)
    assert "repaired a.yaml:" in capsys.readouterr().err
    assert mended(spec) == (0, wanted)
    assert "repaired" not in capsys.readouterr().err


INDEXED = """\
specc: 1.1
system: demo
agents:
  y:
    control:
      rate: 10 Hz
      y:
        sequencers_{i}: {for: {i: 1..3}, goal: int}
      memory:
        rail_{i}: {for: {i: 1..3}, type: int, init: 0}
      let:
        beacon_{k}: {for: {k: 1..3}, type: int, is: "rail_{k} + 1"}
      functions:
        send:
          y.sequencers_{i}.goal: {for: {i: 1..3}, is: "rail_{i} + beacon_{i}"}
        step:
          rail_{i}: {for: {i: 1..3}, is: "beacon_{i % 3 + 1}"}
      behaviours: {work: {functions: [send, step], terminal: never}}
      states: {S0: work}
      initial_state: S0
  sequencers:
    for: {i: 1..3}
    control:
      rate: 10 Hz
      x: {y: {goal: {type: int, init: 0}}}
      memory: {seen: {type: int, init: 0}}
      functions: {look: {seen: x.y.goal}}
      behaviours: {work: {functions: [look], terminal: never}}
      states: {S0: work}
      initial_state: S0
"""


INDEXED_SLIPS = [
    ("rail_{k}", "raill_{k}"),
    ("rail_{i} + beacon_{i}", "rial_{i} + becon_{i}"),
    ("+ beacon_{i}", "+ beacom_{i}"),
    ("beacon_{i % 3 + 1}", "Beacon_{i % 3 + 1}"),
    ("  rail_{i}: {for: {i: 1..3}, is", "  railk_{i}: {for: {i: 1..3}, is"),
    ("y.sequencers_{i}.goal", "y.sequencers_{i}.goaL"),
    ("y.sequencers_{i}.goal", "y.sequencer_{i}.goal"),
    ("y.sequencers_{i}.goal", "y.Sequencers_{i}.goal"),
    ("rail_{i}: {for: {i: 1..3}, type", "raill_{i}: {for: {i: 1..3}, type"),
    ("beacon_{k}: ", "beacn_{k}: "),
    ("sequencers_{i}: {for", "sequenceers_{i}: {for"),
]


@pytest.mark.long
def test_repairs_keep_indices(spec: Path) -> None:
    for right, wrong in INDEXED_SLIPS:
        spec.write_text(INDEXED.replace(right, wrong))
        assert INDEXED.count(right) == 1, right
        assert mended(spec) == (0, INDEXED), wrong


COPIES = """\
specc: 1.2
system: copies
agents:
  r:
    real_effectors: {"d_{i}": {for: {i: 1..3}, y: {p: int}}}
    virtual_effectors:
      "v_{i}":
        for: {i: 1..3}
        uses: ["d_{i}"]
        rate: 10 Hz
        x: {E: {p: int}}
        y: {c: {n: int}}
        let: {rail_1: x.E.p, rail_2: 4 * x.E.p, rails_1: 0, rails_2: 1, rails_3: 2}
        through: {y.c.n: "rail_{i}"}
"""


def test_copies_that_were_right_stay(spec: Path) -> None:
    for text in (COPIES, COPIES.replace("rails_", "raill_")):
        spec.write_text(text)
        assert mended(spec) == (1, text)


REWORDED: list[tuple[str, str, str, tuple[str, str] | None]] = [
    ("raill_{i} + 1", "raill_1", "rail_1", ("raill_{i}", "rail_{i}")),
    ("raill_{i % 5 + 10} + 1", "raill_12", "rail_12", ("raill_{i % 5 + 10}", "rail_{i % 5 + 10}")),
    ("{i}_raill", "3_raill", "3_rail", ("{i}_raill", "{i}_rail")),
    ("a{i}b{k}c", "a1b2c", "A1B2C", ("a{i}b{k}c", "A{i}B{k}C")),
    ("y.Left_{i}.d_{k}", "y.Left_1.d_2", "y.left_1.d_2", ("y.Left_{i}.d_{k}", "y.left_{i}.d_{k}")),
    ("rail_{i}", "rail_1", "rail_2", None),
    ("rail_{i}", "rail_1", "rails", None),
    ("rail_{i}0", "rail_1", "rial_1", None),
    ("rail_{i}s", "rail_1", "rial_1", None),
    ("rail_", "rail_1", "rial_1", None),
    ("other", "rail", "rial", None),
]


def test_letters_change_and_indices_stay() -> None:
    for raw, old, new, expected in REWORDED:
        assert renamed_as_written(raw, old, new) == expected, raw


def test_several_rounds_bring_up_what_was_hidden(spec: Path) -> None:
    good = spec.read_text()
    bad = good.replace("behaviours: {work", "behavours: {work").replace("[send]", "[sned]")
    spec.write_text(bad)
    assert mended(spec) == (0, good)


def test_what_could_mean_several_things_is_left(spec: Path) -> None:
    text = spec.read_text().replace("{send:", "{send1: {y.m.d: 1}, send2: {y.m.d: 1}, sent:")
    text = text.replace("[send]", "[sen]")
    spec.write_text(text)
    assert mended(spec) == (1, text)


def test_a_key_is_not_renamed_to_one_that_is_there(spec: Path) -> None:
    text = spec.read_text().replace(
        "      rate: 10 Hz\n      y", "      rate: 10 Hz\n      rats: 1\n      y"
    )
    spec.write_text(text)
    assert mended(spec) == (1, text)


def test_unused_ignore_comments_go(spec: Path) -> None:
    good = write(spec, " # specc: ignore[W0611] spare").read_text()
    alone = "\n      # specc: ignore[W0604] not needed\n"
    bad = good.replace("[W0611] spare", "[W0604, W0611] spare").replace(
        "\n      states", f"{alone}      states", 1
    )
    spec.write_text(bad)
    assert mended(spec) == (0, good)


@pytest.fixture
def users_of_a_library(tmp_path: Path, spec: Path) -> Path:
    """A library with a misspelt type, which a.yaml and b.yaml use."""
    library = tmp_path / "lib.yaml"
    library.write_text("specc: 1\ntypes: {Width: 'vectr[2, m]'}\n")
    for name in ("a", "b"):
        path = write(tmp_path / f"{name}.yaml")
        path.write_text(path.read_text().replace("agents:", "use: [lib.yaml]\nagents:"))
    return library


@pytest.mark.parametrize(
    "named", [["a.yaml", "b.yaml", "lib.yaml"], ["."], ["a.yaml", "l*.yaml"], ["a.yaml", "link"]]
)
def test_a_library_that_is_named_is_mended_once_for_all_who_use_it(
    named: list[str], users_of_a_library: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("link").symlink_to("lib.yaml")
    main(["validate", "--fix", *named])
    assert users_of_a_library.read_text() == "specc: 1\ntypes: {Width: 'vector[2, m]'}\n"
    assert capsys.readouterr().err.count("repaired") == 1


def test_a_file_that_is_not_named_is_not_touched(
    users_of_a_library: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = users_of_a_library.read_text()
    assert main(["validate", "--fix", "a.yaml"]) == 1
    assert users_of_a_library.read_text() == before
    told = "not repaired, since it was not named: lib.yaml (1 repair); "
    assert f"{told}`specc validate --fix a.yaml lib.yaml`" in capsys.readouterr().err


def test_settings_are_mended_with_their_directory(
    tmp_path: Path, spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings_file = tmp_path / "pyproject.toml"
    settings_file.write_text("[tool.specc]\nstrikt = false # why\n")
    assert main(["validate", "--fix", "a.yaml"]) == 1
    assert "`specc validate --fix a.yaml .`" in capsys.readouterr().err
    assert main(["validate", "--fix", "a.yaml", "."]) == 0
    assert settings_file.read_text() == "[tool.specc]\nstrict = false # why\n"


def test_line_ends_and_a_byte_order_mark_survive(spec: Path) -> None:
    good = b"\xef\xbb\xbf" + spec.read_bytes().replace(b"\n", b"\r\n")
    spec.write_bytes(good.replace(b"[send]", b"[sned]"))
    main(["validate", "--fix", "a.yaml"])
    assert spec.read_bytes() == good


def test_a_fix_is_shown_in_data(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec.write_text(spec.read_text().replace("[send]", "[sned]"))
    before = spec.read_text()
    main(["validate", "a.yaml", "--format", "json"])
    (found,) = [
        item["fix"] for item in json.loads(capsys.readouterr().out)["diagnostics"] if item["fix"]
    ]
    assert found["title"] == "write `send`"
    (edit,) = found["edits"]
    assert (edit["text"], edit["location"]["line"]) == ("send", 11)
    assert spec.read_text() == before


def test_a_file_that_cannot_be_written_stays(
    spec: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied", "a.yaml")

    text = spec.read_text().replace("[send]", "[sned]")
    spec.write_text(text)
    monkeypatch.setattr("os.replace", refuse)
    assert main(["validate", "--fix", "a.yaml"]) == 2
    assert spec.read_text() == text
    assert "error[E0090]" in capsys.readouterr().err
    assert [path.name for path in spec.parent.iterdir()] == ["a.yaml"]


def repair(*changes: tuple[int, int, str]) -> Repair:
    return Repair("", tuple(Change(start, end, NOWHERE, text) for start, end, text in changes))


def test_repairs_that_touch_are_not_made_together() -> None:
    repairs = [repair((2, 4, "X")), repair((0, 2, "Y"))]
    assert apply_compatible("abcdef", repairs, lambda *_: True) == ("Ycdef", (repairs[1],))


def test_a_repair_that_breaks_the_file_is_refused() -> None:
    repairs = [repair((0, 1, "!")), repair((3, 4, "D"))]
    text, _ = apply_compatible("abcdef", repairs, lambda t, _: "!" not in t)
    assert text == "abcDef"


@settings(deadline=None)
@given(
    st.text("abc", min_size=8, max_size=8),
    st.lists(
        st.tuples(st.integers(0, 7), st.integers(0, 2), st.text("XY", max_size=3)), max_size=5
    ),
)
def test_only_the_stretches_of_repairs_change(
    text: str, wanted: list[tuple[int, int, str]]
) -> None:
    repairs = [repair((start, min(start + size, 8), new)) for start, size, new in wanted]
    result, applied = apply_compatible(text, repairs, lambda *_: True)
    changes = sorted((c.start, c.end, c.text) for made in applied for c in made.changes)
    expected, at = "", 0
    for start, end, new in changes:
        expected += text[at:start] + new
        at = end
    assert result == expected + text[at:]


def test_what_is_wrong_again_is_found_where_repairs_moved_it() -> None:
    """In a text each repair moves what stands behind it; no other text, and no key, is moved."""

    def at(start: int | None, code: str = "E0201", route: str = "a", part: str = "value") -> Any:
        return Diagnostic(code, "m", Place("a.yaml", (route,), part, start, None))

    def slip(start: int, old: str, new: str) -> Diagnostic:
        found = at(start)
        return replace(found, fix=Fix("t", (Edit(found.primary, new, old),)))

    name = replace(at(None, part="key"), fix=Fix("t", (Edit(at(None, part="key").primary, "k"),)))
    slips = [slip(10, "countrr", "count"), slip(0, "count", "counter"), name]
    assert is_wrong_again(slips, [at(12)])
    assert is_wrong_again(slips, [at(0)])
    for elsewhere in (at(10), at(12, "E0234"), at(12, route="b")):
        assert not is_wrong_again(slips, [elsewhere])


def test_a_fix_over_several_files_is_no_repair() -> None:
    files = Sources([SourceFile("a.yaml", "a"), SourceFile("b.yaml", "b")])
    edits = tuple(Edit(Place(name, (), "text", 0, 1), "c") for name in ("a.yaml", "b.yaml"))
    (found,) = resolve([Diagnostic("E0101", "m", Place("a.yaml"), fix=Fix("t", edits))], files)
    assert found.repair is None


@pytest.mark.parametrize(
    ("name", "close", "meant"),
    [
        ("agentz", ["agents"], "agents"),
        ("agnets", ["agents"], "agents"),
        ("Agents", ["agents"], "agents"),
        ("rotatoin", ["rotation", "position"], "rotation"),
        ("agen", ["agents"], ""),
        ("rates", ["rate", "crates"], ""),
        ("q_d", ["q_c"], ""),
        ("S011", ["S010"], ""),
        ("name", [], ""),
    ],
)
def test_only_a_slip_of_one_letter_is_sure(name: str, close: list[str], meant: str) -> None:
    assert sole_correction(name, close) == meant
