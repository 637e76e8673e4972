"""What files, directories and patterns mean, and many specifications at once."""

import json
from pathlib import Path
from typing import Any

import pytest

from specc.cli import inspect, main
from specc.policy import Overrides
from tests.policy.specs import write

PART = "specc: 1\nsubsystem: {rate: 10 Hz}\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("a.yaml", "b/c.yml", "b/d.yaml", ".hidden/e.yaml", "old/f.yaml"):
        write(tmp_path / "specs" / name)
    (tmp_path / "specs/lib").mkdir()
    (tmp_path / "specs/lib/part.yaml").write_text(PART)
    (tmp_path / "specs/compose.yaml").write_text("services: {}\n")
    (tmp_path / "specs/note.txt").write_text("specc: 1\nsystem: no\n")
    return tmp_path


def test_a_directory_means_the_specifications_below_it(folder: Path) -> None:
    meant = inspect.find_targets(["specs"])
    assert meant.systems == ("specs/a.yaml", "specs/b/c.yml", "specs/b/d.yaml", "specs/old/f.yaml")
    assert meant.parts == ("specs/lib/part.yaml",)


def test_excluded_files_are_left_out_of_a_search_only(folder: Path) -> None:
    (folder / "pyproject.toml").write_text('[tool.specc]\nexclude = ["specs/old", "*/d.yaml"]\n')
    assert inspect.find_targets(["specs"]).systems == ("specs/a.yaml", "specs/b/c.yml")
    assert inspect.find_targets(["specs/old/f.yaml"]).systems == ("specs/old/f.yaml",)


def test_patterns_and_repetitions(folder: Path) -> None:
    meant = inspect.find_targets(
        ["specs/**/*.yaml", "./specs/a.yaml", "specs/b/../b/d.yaml", "specs"]
    )
    assert meant.systems == ("specs/a.yaml", "specs/b/d.yaml", "specs/old/f.yaml", "specs/b/c.yml")


def test_nothing_found_is_a_finding(folder: Path) -> None:
    (folder / "empty").mkdir()
    meant = inspect.find_targets(["empty", "specs/*.json", "none.yaml"])
    assert [fault.code for fault in meant.faults] == ["E0001", "E0001"]
    assert meant.systems == ("none.yaml",)


def test_a_part_is_checked_with_what_uses_it(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    user = folder / "user.yaml"
    part = folder / "specs/lib/part.yaml"
    text = write(user).read_text()
    head, _, tail = text.partition("      m:\n")
    lines = tail.splitlines()
    user.write_text(f"{head}      m: {{use: specs/lib/part.yaml}}\n")
    part.write_text("specc: 1\nsubsystem:\n" + "\n".join(line[6:] for line in lines) + "\n")
    assert main(["validate", "specs/lib/part.yaml"]) == 0
    assert main(["validate", "specs/lib/part.yaml", "user.yaml"]) == 0
    assert "2 files checked: 0 errors, 2 warnings" in capsys.readouterr().err


def test_a_comment_is_used_if_any_specification_needs_it(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    why = " # specc: ignore[W0611] some robots do without"
    (folder / "lib.yaml").write_text(
        f"specc: 1\nconstants: {{k: 2}}\nsubsystem: {{let: {{}}}}{why}\n"
    )
    for name in "abcde":
        path = write(folder / f"{name}.yaml")
        path.write_text(path.read_text().replace("agents:", "use: [lib.yaml]\nagents:"))
    main(["validate", "a.yaml", "b.yaml", "--format", "json"])
    found = json.loads(capsys.readouterr().out)["diagnostics"]
    assert sum(item["code"] == "W0901" for item in found) == 1


def report_of(arguments: list[str]) -> Any:
    return inspect.inspect_all(arguments, Overrides())


def test_cores_are_counted_where_none_are_assigned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.sched_getaffinity", raising=False)
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    assert inspect.cores() == 3


@pytest.mark.long
def test_processes_give_the_same_report_as_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [str(write(folder / f"many/{n:02}.yaml")) for n in range(12)]
    monkeypatch.setattr(inspect, "PARALLEL_FROM", 100)
    alone = report_of(names)
    monkeypatch.setattr(inspect, "PARALLEL_FROM", 2)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1, 2})
    assert report_of(names) == alone
    assert report_of(list(reversed(names))).findings == alone.findings
    assert alone.count("warning") == 24
