"""New files of a command: all or none."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from specc.cli import new_files as module
from specc.cli.new_files import Content, Taken, placing


@pytest.mark.parametrize(
    ("name", "content"),
    [("b", Path("/nowhere/at/all")), ("y" * 250, "its name aside is too long"), ("a/b", "in a")],
)
def test_a_file_that_cannot_be_written_leaves_nothing(
    name: str, content: Content, tmp_path: Path
) -> None:
    new = tmp_path / "new/folder"
    with pytest.raises(OSError), placing() as files:
        files.put({new / "before": "x"})
        files.put({new / "a": "x", new / name: content})
    assert list(tmp_path.iterdir()) == []


def test_what_others_wrote_meanwhile_stays(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), placing() as new:
        new.put({tmp_path / "new/a": "x"})
        (tmp_path / "new/mine").write_text("mine")
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.rglob("*")] == ["new", "mine"]


def test_an_interrupt_during_the_last_step_leaves_all(tmp_path: Path) -> None:
    """A file that exists names the new ones by then."""
    names = tmp_path / "names"

    def last() -> None:
        signal.raise_signal(signal.SIGINT)
        names.write_text("new/a")

    with pytest.raises(KeyboardInterrupt), placing() as new:
        new.put({tmp_path / "new/a": "x"})
        new.keep(last)
    assert (tmp_path / names.read_text()).is_file()


def test_what_is_there_stays(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    with pytest.raises(Taken, match="a exists already"), placing() as new:
        new.put({tmp_path / "b": "x", tmp_path / "a": "x"})
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_the_first_comes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    there: list[bool] = []
    replace = Path.replace

    def replaced(self: Path, target: Path) -> Path:
        there.append(second.exists())
        return replace(self, target)

    monkeypatch.setattr(module.Path, "replace", replaced)
    with placing() as new:
        new.put({first: "1", second: "2"})
    assert there == [False, True]
    assert first.is_file() and second.is_file()
