"""The folder of a sweep: a row for each run that is done, kept safe as it comes.

`runs.jsonl` gets a line a run, which is on the disk before the next one counts; a line that was
torn is dropped. `runs.csv` is made from it: the runs that were asked for, in order, whatever the
order in which they ended. `sweep.json` says of what they are.
"""

from __future__ import annotations

import csv
import errno
import fcntl
import io
import json
import os
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path
from typing import Any

from specc.atomic_files import PREFIX, write_atomically
from specc.diagnostics.phrases import counted, join_words
from specc.tools.sweep.running import LIMIT, Figures
from specc.tools.sweep.settings import SweepError, SweepSetting, meaning

VERSION = 1
LOG, TABLE, ABOUT = "runs.jsonl", "runs.csv", "sweep.json"
# What a table ends with: figures that are not of interest one by one.
_LAST = ("records_sha256", "wall_s")

_FIELDS, _FIELDS_OF_BYTE = 1_000_000, 2
"""Of the table of runs that are there: so many, and more in proportion to the log. Rows of one
specification have the same columns, so that only few of the fields are empty."""
_FLOAT_BITS = 1024
"""With as many a whole number is no float any more."""

RunKey = tuple[frozenset[tuple[str, Hashable]], int]
Row = dict[str, Any]


def key_of(setting: SweepSetting, seed: int) -> RunKey:
    """What tells a run from all others of the same specification and options."""
    return frozenset((name, meaning(value)) for name, value in setting.items()), seed


class Folder:
    """While entered, nobody else writes into it. `done` has the figures of the runs there are."""

    def __init__(self, path: Path, about: Mapping[str, Any]) -> None:
        """`about`: JSON values that say what the runs are of: specification and options."""
        self.path = path
        self.done: dict[RunKey, Figures] = {}
        self._about = {"version": VERSION, **about}
        self._made: list[Path] = []
        self._log: Any = None

    def __enter__(self) -> Folder:
        """Raises SweepError for a folder that is in use or that has other runs, OSError."""
        self._made = [each for each in (self.path, *self.path.parents) if not each.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        if odd := sorted(self._leading_elsewhere()):
            why = f"{odd[0]} is a link or no file, which no sweep made; name another folder"
            raise SweepError(f"{self.path}: {why} with --out")
        if not (self.path / ABOUT).exists() and (other := sorted(self._strangers())):
            why = f"{other[0]} is there, which no sweep wrote; name another folder with --out"
            raise SweepError(f"{self.path}: {why}")
        # Without a buffer a row is in the file or not, whenever Ctrl-C comes.
        self._log = (self.path / LOG).open("a+b", buffering=0)
        try:
            fcntl.flock(self._log, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._log.close()
            raise SweepError(f"{self.path}: another sweep writes into this folder") from None
        try:
            self._check()
            self.read()
        except BaseException:
            self._log.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """What a sweep made that failed before its first run is removed."""
        if kind is not None and not self.done:
            for file in (ABOUT, LOG):
                (self.path / file).unlink(missing_ok=True)
            with suppress(OSError):  # there is something else in it
                for folder in self._made:
                    folder.rmdir()
        self._log.close()

    def _strangers(self) -> Iterator[str]:
        # A sweep that was ended before it said what it is of left no more than an empty log.
        for file in self.path.iterdir():
            begun = file.name == LOG and file.stat().st_size == 0
            if not begun and not file.name.startswith(PREFIX):
                yield file.name

    def _leading_elsewhere(self) -> Iterator[str]:
        # What is written and removed here must not be somebody's files elsewhere.
        for entry in os.scandir(self.path):
            is_own = entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)
            if not is_own:
                yield entry.name

    def _check(self) -> None:
        path = self.path / ABOUT
        if not path.exists():
            write_atomically(path, json.dumps(self._about, indent=2) + "\n")
            return
        try:
            there = json.loads(path.read_text(encoding="utf-8"))
        except (ValueError, RecursionError):
            there = None
        if not isinstance(there, dict):
            raise SweepError(f"{path} is not of a sweep; name another folder with --out")
        if other := [n for n in {**self._about, **there} if there.get(n) != self._about.get(n)]:
            own = [name for name in other if name in self._about] or other[:1]
            raise SweepError(
                f"{self.path} has runs with another {join_words(own, 'and')}; name another folder "
                "with --out, or remove this one"
            )

    def read(self) -> None:
        """Find what is there. Raises SweepError for what no sweep wrote."""
        self._log.seek(0)
        *lines, torn = self._log.read().split(b"\n")
        for number, line in enumerate(lines, start=1):
            try:
                key, run = _entry(line)
                self.done[key] = run
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
                raise SweepError(f"{self.path / LOG}: line {number} is not of a run") from None
        if torn:
            self._log.truncate(self._log.tell() - len(torn))

    def add(self, setting: SweepSetting, seed: int, figures: Figures) -> None:
        """Keep a run for good."""
        entry = {"set": dict(setting), "seed": seed, "run": figures}
        line = json.dumps(entry).encode() + b"\n"
        try:
            if self._log.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(self._log.fileno())
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path / LOG)) from None
        self.done[key_of(setting, seed)] = figures

    def lacks(self, setting: SweepSetting, seed: int, limit_s: float) -> bool:
        """Whether a run is to be made: it is not there, or ended by a shorter limit than this."""
        run = self.done.get(key_of(setting, seed))
        return run is None or (run.get("ended") == LIMIT and run["wall_s"] < limit_s)

    def runs(
        self, settings: Sequence[SweepSetting], seeds: Sequence[int]
    ) -> Iterator[tuple[SweepSetting, int, Figures]]:
        """Those of the runs that are done: by setting, then by seed."""
        for setting, seed in product(settings, seeds):
            if (key := key_of(setting, seed)) in self.done:
                yield setting, seed, self.done[key]

    def check_size(self, settings: Sequence[SweepSetting], seeds: Sequence[int]) -> None:
        """Raises SweepError if the table of the runs that are there would be out of proportion."""
        runs = [figures for _, _, figures in self.runs(settings, seeds)]
        columns = len(columns_of(runs))
        most = _FIELDS + _FIELDS_OF_BYTE * (self.path / LOG).stat().st_size
        if columns * len(runs) > most:
            raise SweepError(
                f"{self.path / LOG}: {counted(len(runs), 'run')} with {columns} columns, most of "
                "them of few runs, are too large a table; ask for fewer seeds or values at a time"
            )


def _entry(line: bytes) -> tuple[RunKey, Figures]:
    entry = json.loads(line)
    run = dict(entry["run"])
    if not all(map(_is_figure, run.values())):
        raise ValueError
    if not isinstance(run["success"], bool | None) or not isinstance(run["reason"], str):
        raise ValueError
    if run.get("ended") == LIMIT and not isinstance(run["wall_s"], int | float):
        raise ValueError
    return key_of(entry["set"], entry["seed"]), run


def _is_figure(value: Any) -> bool:
    if type(value) is int:
        return value.bit_length() < _FLOAT_BITS
    return value is None or isinstance(value, bool | float | str)


def columns_of(rows: Iterable[Row]) -> list[str]:
    """All columns, in the order in which rows have them."""
    names = dict.fromkeys(name for row in rows for name in row)
    return [n for n in names if n not in _LAST] + [n for n in _LAST if n in names]


def as_csv(rows: Sequence[Row]) -> str:
    """A table with a line of names; empty where a row has no value."""
    text = io.StringIO()
    table = csv.DictWriter(text, columns_of(rows), lineterminator="\n")
    table.writeheader()
    table.writerows({name: _field(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def _field(value: Any) -> str:
    if value is None:
        return ""
    return json.dumps(value) if isinstance(value, bool | float) else str(value)
