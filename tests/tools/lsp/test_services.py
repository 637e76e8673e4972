"""Outline, repairs, layout and signatures: what an editor offers for a file."""

from pathlib import Path

import pytest

from specc.lang.builtins import BUILTIN_NAMES
from specc.tools.fmt import format_text
from specc.tools.lsp import features
from specc.tools.lsp.cursor import signature
from specc.tools.lsp.describe import OutlineEntry
from specc.tools.lsp.features import Action
from specc.tools.lsp.project import Project
from tests.house.tree import ROOT
from tests.policy.test_fixes import INDEXED
from tests.tools.lsp.workspace import SYSTEM, opened, place


def edited(text: str, action: Action) -> str:
    for change in sorted(action.changes, key=lambda c: c.start, reverse=True):
        text = text[: change.start] + change.text + text[change.end :]
    return text


def offered(project: Project, path: str, text: str, marked: str) -> list[Action]:
    project.put(path, text)
    project.analyse(path)
    at = place(text, marked)
    return features.repairs(project, path, at, at)


def codes(project: Project, path: str, text: str) -> list[str]:
    project.put(path, text)
    return sorted(d.code for d in project.analyse(path).diagnostics)


def test_the_one_repair_of_a_finding_is_preferred(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    expected = codes(project, system, SYSTEM)
    text = SYSTEM.replace("near_goal and", "near_goa and")
    (action,) = offered(project, system, text, 'reached: "|near_goa and')
    assert action.preferred
    assert edited(text, action) == SYSTEM
    assert codes(project, system, edited(text, action)) == expected


def test_a_repair_is_of_the_side_that_is_misspelt(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("Joints: vector", "Jionts: vector")
    (action,) = offered(project, system, text, "m: {x: {q_d: |Joints}")
    assert edited(text, action) == SYSTEM


def test_a_repair_keeps_indices(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = INDEXED.replace("rail_{i} + beacon_{i}", "rail_{i} + becon_{i}")
    (action,) = offered(project, system, text, '"rail_{i} + |becon_{i}"')
    assert edited(text, action) == INDEXED
    assert "beacon_{i}" in action.title


def test_a_repair_keeps_quotes(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("terminal, going, S1", 'terminal, "goign", S1')
    (action,) = offered(project, system, text, 'terminal, "|goign"')
    assert edited(text, action) == SYSTEM.replace("terminal, going, S1", 'terminal, "going", S1')


@pytest.mark.parametrize("break_", ["\n", "\r\n"])
def test_inserts_the_missing_row(break_: str, tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    whole = SYSTEM.replace("\n", break_)
    expected = codes(project, system, whole)
    text = whole.replace(f"          - [S0, terminal, resting, S0]{break_}", "")
    assert "E0601" in codes(project, system, text)
    (action,) = offered(project, system, text, "{S0|: idle, S1")
    assert not action.preferred
    mended = edited(text, action)
    assert f"- [S0, terminal, going, S1]{break_}          - [S0, terminal, otherwise, S0]" in mended
    # `resting` is not used any more; nothing else is new.
    assert set(codes(project, system, mended)) - set(expected) <= {"W0611"}


def test_inserts_no_row_where_otherwise_is_a_condition_of_its_own(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("          - [S0, terminal, resting, S0]\n", "")
    text = text.replace("resting:", "otherwise:")
    assert "E0601" in codes(project, system, text)
    assert offered(project, system, text, "{S0|: idle, S1") == []


def test_inserts_the_missing_row_of_all_states_that_lack_it(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    rows = "          - {from: S1, cause: terminal, when: always, to: S0}\n"
    text = SYSTEM.replace("- [S0, terminal, resting, S0]", "- [S1, terminal, going, S0]")
    text = text.replace(rows, "").replace("S1: motion", "S1: idle")
    (action,) = offered(project, system, text, "{S0|: idle, S1")
    assert "S0, S1" in action.title
    mended = edited(text, action)
    assert "[S0, terminal, otherwise, S0]" in mended
    assert "[S1, terminal, otherwise, S1]" in mended
    assert "E0601" not in codes(project, system, mended)


def test_inserts_the_row_of_a_cause_without_any(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("terminal: reached}", "terminal: reached, error: far}").replace(
        "          terminal: {reached",
        '          error: {far: "not near_goal"}\n          terminal: {reached',
    )
    (action,) = offered(project, system, text, "idle, S1|: motion")
    assert "error condition of S1" in action.title
    mended = edited(text, action)
    assert (
        "- {from: S1, cause: terminal, when: always, to: S0}\n          - [S1, error, always, S1]"
        in mended
    )
    assert "E0603" not in codes(project, system, mended)


def test_inserts_the_first_row_of_a_state(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    row = "          - {from: S1, cause: terminal, when: always, to: S0}\n"
    assert row in SYSTEM
    text = SYSTEM.replace(row, "")
    assert "O0605" in codes(project, system, text)
    (action,) = offered(project, system, text, "idle, S1|: motion")
    mended = edited(text, action)
    assert "- [S1, terminal, always, S1]" in mended
    assert "O0605" not in codes(project, system, mended)


def test_inserts_into_a_table_on_one_line(tmp_path: Path) -> None:
    project, _, library = opened(tmp_path)
    text = Path(library).read_text().replace(", [S0, terminal, still, S0]]", "]")
    (action,) = offered(project, library, text, "{S0|: idle}")
    mended = edited(text, action)
    assert "moved, S0], [S0, terminal, otherwise, S0]]" in mended
    project.put(library, mended)
    assert "E0601" not in {d.code for d in project.analyse(library).diagnostics}


def test_offers_nothing_for_a_text_that_has_changed_since(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("near_goal and", "near_goa and")
    project.put(system, text)
    project.analyse(system)
    project.put(system, "# new\n" + text)
    assert features.repairs(project, system, 0, len(text)) == []


def test_the_outline_has_the_parts_inside_each_other(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    entries = {entry.name: entry for entry in features.outline(project, system)}
    (agent,) = (entry for entry in entries.values() if entry.kind == "agent")
    hand = next(e for e in agent.children if (e.kind, e.name) == ("subsystem", "m"))
    names = {(entry.kind, entry.name) for entry in hand.children}
    assert {("memory", "q_p"), ("state", "S1"), ("element", "x.c.q_d")} <= names
    assert entries["Grip"].children[0].name == "width"

    def inside(entry: OutlineEntry) -> None:
        assert entry.start <= entry.name_start < entry.name_end <= entry.end
        for below in entry.children:
            assert entry.start <= below.start <= below.end <= entry.end
            inside(below)

    for entry in entries.values():
        inside(entry)


def test_the_layout_is_that_of_the_formatter(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    assert features.layout(project, system) == format_text(SYSTEM)
    project.put(system, format_text(SYSTEM))
    assert features.layout(project, system) is None
    windows = SYSTEM.replace("\n", "\r\n")
    project.put(system, windows)
    assert features.layout(project, system) == format_text(SYSTEM).replace("\n", "\r\n")
    project.put(system, SYSTEM.replace("frames: {", "frames: ["))
    assert features.layout(project, system) is None
    project.put(system, "a:   1\n")
    assert features.layout(project, system) is None


@pytest.mark.parametrize(
    ("typed", "label", "active"),
    [
        ("near(", "near(a, b, tolerance, angle) -> bool", 0),
        ("near(q_p, ", "near(a, b, tolerance, angle) -> bool", 1),
        ("DK(x.E.q_m", "DK(q: vector[2, rad]) -> pose[B, E]", 0),
        ("near(DK(q_p), [1, 2], ", "near(a, b, tolerance, angle) -> bool", 2),
        ("near(DK(", "DK(q: vector[2, rad]) -> pose[B, E]", 0),
        ("GR(", "GR() -> Grip", 0),
    ],
)
def test_the_call_that_is_being_written(
    typed: str, label: str, active: int, tmp_path: Path
) -> None:
    project, system, _ = opened(tmp_path)
    before, after = SYSTEM.split('"near(q_p, x.E.q_m, limit)')
    text = f'{before}"{typed}{after}'
    project.put(system, text)
    project.analyse(system)
    found = features.signature_at(project, system, len(before) + 1 + len(typed))
    assert found is not None
    assert (found.label, found.active) == (label, active)


def test_no_call_where_none_is_written(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    for marked in ("title: where| the hand", "near(q_p, x.E.q_m, limit)| and", "|let:"):
        assert features.signature_at(project, system, place(SYSTEM, marked)) is None


def test_every_function_of_the_language_has_its_signature() -> None:
    for name in BUILTIN_NAMES:
        text = f'specc: 1\nconstants: {{a: "{name}('
        found = signature((), (), text, len(text))
        assert found is not None, name
        assert found.label.startswith(f"{name}(")


def test_all_of_the_flagship_is_in_its_outline() -> None:
    path = str(ROOT / "specs/irp_picking.yaml")
    project = Project()
    index = project.analyse(path).index

    def count(entries: list[OutlineEntry]) -> int:
        return sum(1 + count(entry.children) for entry in entries)

    assert count(features.outline(project, path)) == len(index.files[path].by_route)
