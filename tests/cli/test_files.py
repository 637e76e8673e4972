"""New files of a command: all or none."""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path

import pytest

from specc import atomic_files
from specc.atomic_files import PREFIX, digest_of, remove_stale, temporary_folder
from specc.cli import files as module
from specc.cli.files import AlreadyExists, Content, creating


@pytest.mark.parametrize(
    ("name", "content"),
    [("b", Path("/nowhere/at/all")), ("y" * 300, "its name is too long"), ("a/b", "in a")],
)
def test_a_file_that_cannot_be_written_leaves_nothing(
    name: str, content: Content, tmp_path: Path
) -> None:
    new = tmp_path / "new/folder"
    with pytest.raises(OSError), creating(new / "a") as files:
        files.write({new / "before": "x"})
        files.write({new / "a": "x", new / name: content})
    assert list(tmp_path.iterdir()) == []


def test_what_others_wrote_meanwhile_stays(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), creating(tmp_path / "new/a") as new:
        new.write({tmp_path / "new/a": "x"})
        (tmp_path / "new/mine").write_text("mine")
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.rglob("*")] == ["new", "mine"]


def test_an_interrupt_during_the_last_step_leaves_all(tmp_path: Path) -> None:
    """A file that exists names the new ones by then."""
    names = tmp_path / "names"

    def last() -> None:
        signal.raise_signal(signal.SIGINT)
        names.write_text("new/a")

    with pytest.raises(KeyboardInterrupt), creating(names) as new:
        new.write({tmp_path / "new/a": "x"})
        new.commit(last)
    assert (tmp_path / names.read_text()).is_file()


def test_what_is_there_stays(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    with pytest.raises(AlreadyExists, match="a exists already"), creating(tmp_path / "b") as new:
        new.write({tmp_path / "b": "x", tmp_path / "a": "x"})
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_the_first_comes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    there: list[bool] = []
    replace = Path.replace

    def replaced(self: Path, target: Path) -> Path:
        if Path(target) in (first, second):
            there.append(second.exists())
        return replace(self, target)

    monkeypatch.setattr(module.Path, "replace", replaced)
    with creating(first) as new:
        new.write({first: "1", second: "2"})
    assert there == [False, True]
    assert first.is_file() and second.is_file()


# What a process that was killed leaves: no code of its own has run after that.


def killed(folder: Path, then: str, last: str = "last") -> None:
    """Place new files in a process that is killed when it has done what `then` says."""
    code = (
        "import os, signal\n"
        "from pathlib import Path\n"
        "from specc.cli.files import creating\n"
        f"with creating(Path({last!r})) as new:\n"
        "    new.write({Path('a'): 'a', Path('below/b'): 'b'})\n"
        f"    {then}\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert (
        os.spawnve(
            os.P_WAIT,
            sys.executable,
            [sys.executable, "-c", f"import os\nos.chdir({str(folder)!r})\n{code}"],
            {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        == -signal.SIGKILL
    )


def names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def test_what_was_not_finished_is_undone_by_the_next_process(tmp_path: Path) -> None:
    killed(tmp_path, "pass")
    assert {"a", "below", "below/b"} < set(names(tmp_path))
    remove_stale(str(tmp_path))
    assert names(tmp_path) == []


def test_what_somebody_has_changed_since_stays(tmp_path: Path) -> None:
    killed(tmp_path, "Path('a').write_text('mine'), Path('below/mine').write_text('mine')")
    remove_stale(str(tmp_path))
    assert names(tmp_path) == ["a", "below", "below/mine"]


def test_what_was_finished_stays(tmp_path: Path) -> None:
    killed(tmp_path, "new.write({Path('last'): 'last'})")
    remove_stale(str(tmp_path))
    assert names(tmp_path) == ["a", "below", "below/b", "last"]


def test_files_stay_once_they_are_finished_whatever_is_written_later(tmp_path: Path) -> None:
    """The user may edit them before the next command runs."""
    killed(tmp_path, "new.write({Path('last'): 'last'})")
    (tmp_path / "last").write_text("edited")
    remove_stale(str(tmp_path))
    assert names(tmp_path) == ["a", "below", "below/b", "last"]


def test_files_stay_when_one_more_is_placed_after_the_last(tmp_path: Path) -> None:
    killed(tmp_path, "new.write({Path('last'): 'last'}), new.write({Path('c'): 'c'})")
    remove_stale(str(tmp_path))
    assert names(tmp_path) == ["a", "below", "below/b", "c", "last"]


def test_files_beside_an_edited_one_go_while_it_is_as_before(tmp_path: Path) -> None:
    (tmp_path / "last").write_text("before")
    killed(tmp_path, "pass")
    remove_stale(str(tmp_path))
    assert names(tmp_path) == ["last"]


def test_what_a_living_process_writes_stays(tmp_path: Path) -> None:
    with creating(tmp_path / "last") as new:
        new.write({tmp_path / "a": "a"})
        remove_stale(str(tmp_path))
        (aside,) = tmp_path.glob(f"{PREFIX}*")
        assert aside.is_dir()
    assert names(tmp_path) == ["a"]


def test_a_folder_that_another_process_removes_before_it_is_locked_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both make their folders among the temporary files of the machine."""
    lock, removed = atomic_files._lock, []

    def late(path: Path, *, waits: bool) -> int | None:
        if not removed:
            removed.append(path)
            path.rmdir()
        return lock(path, waits=waits)

    monkeypatch.setattr(atomic_files, "_lock", late)
    with temporary_folder(tmp_path) as folder:
        assert folder.is_dir() and removed != [folder]
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    "note",
    [
        "",
        "[" * 10000,
        "{}",
        '{"last": 1, "new": 2}',
        '{"last": ["last", ""], "new": [[1, 2]]}',
        json.dumps({"last": ["x", None], "new": [["../outside", digest_of(b"mine")]]}),
        json.dumps({"last": ["x", None], "new": [["link/outside", digest_of(b"mine")]]}),
        json.dumps({"last": ["x", None], "new": [["inside", digest_of(b"theirs")], ["..", None]]}),
    ],
)
def test_the_note_of_a_stranger_removes_nothing(note: str, tmp_path: Path) -> None:
    """A project that was cloned may have one."""
    project = tmp_path / "project"
    (aside := project / f"{PREFIX}0").mkdir(parents=True)
    (aside / "new.json").write_text(note)
    for file in (tmp_path / "outside", project / "inside"):
        file.write_text("mine")
    (project / "link").symlink_to(tmp_path)
    remove_stale(str(project))
    assert sorted(path.name for path in project.iterdir()) == ["inside", "link"]
    assert (tmp_path / "outside").read_text() == "mine"
