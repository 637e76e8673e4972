"""The runs of a sweep: those of the command line, and the folder of those that are done.

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
import re
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise, product
from math import prod
from pathlib import Path
from typing import Any, NoReturn

from specc.atomic_files import PREFIX, write_atomically
from specc.diagnostics.phrases import counted, join_words
from specc.model.units import UnitError, parse_unit
from specc.refusal import Refused
from specc.resolve.context import in_unit, quantity
from specc.tools.sweep.running import LIMIT, OWN, Figures

# Values of constants, and seeds, as they are written on the command line.

MOST_RUNS = 1_000_000
"""Of one sweep."""
MOST_SETTINGS = 10_000
"""Each has code of its own."""

_LONGEST_UNIT = 24
"""What is longer is compared as text: a folder of a stranger may have many of them."""

SweepSetting = Mapping[str, str]
"""Texts of the values of constants, by name."""

_BRACKETS = {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}


class SweepError(Refused):
    """The sweep cannot be made as asked; the message says why and what would help."""


@dataclass(frozen=True, slots=True)
class Axis:
    """The values that a constant takes, one after another."""

    name: str
    values: tuple[str, ...]
    unit: str | None
    """The unit of the values, empty if they have none; None unless they are numbers of one."""

    @property
    def title(self) -> str:
        """What stands over the values: `damping [kg/s]`, and no column of the table itself."""
        if self.unit:
            return f"{self.name} [{self.unit}]"
        if "." in self.name:
            return f"parameter {self.name}"
        return f"constant {self.name}" if self.name in OWN else self.name

    def cell_value(self, value: str) -> float | str:
        """A value below the title: a number, if all are."""
        number = quantity(value) if self.unit is not None else None
        return float(number[0]) if number is not None else value


def parse_axis(name: str, text: str, unit: str = "") -> Axis:
    """`FROM:TO:COUNT`, both ends included, or values separated by commas.

    A number without a unit gets this one, if it is not empty.

    Raises:
        SweepError: it is neither, or a value is there twice.
    """
    ends = _split(text, ":")
    if len(ends) not in (1, 3):
        raise SweepError(f"--set {name}={text}: write FROM:TO:COUNT or values between commas")
    texts = ends[:2] if ends[1:] else _split(text, ",")
    values = [in_unit(value.strip(), unit) for value in texts]
    if ends[1:]:
        values = _evenly_spaced(name, values[0], values[1], ends[2].strip())
    if not all(values):
        raise SweepError(f"--set {name}={text}: a value is empty")
    # The same runs twice would pass for more of them.
    counts = Counter(keys := [normalised(value) for value in values])
    if twice := [v for v, key in zip(values, keys, strict=True) if counts[key] > 1]:
        raise SweepError(f"--set {name}={text}: {twice[-1]} is there twice")
    units = {number[1] if (number := quantity(value)) else None for value in values}
    return Axis(name, tuple(values), units.pop() if len(units) == 1 else None)


def parse_seeds(text: str) -> tuple[int, ...]:
    """`FROM:TO` without TO, or seeds separated by commas. Raises SweepError."""
    parts = [part.strip() for part in re.split("[:,]", text)]
    if not all(part.isascii() and part.isdigit() and len(part) < 19 for part in parts):
        way = "as in 0:10, or in 1,5,7"
        raise SweepError(f"--seeds {text}: seeds are whole numbers, 0 or more, {way}")
    numbers = [int(part) for part in parts]
    if ":" not in text:
        return tuple(dict.fromkeys(numbers))
    if "," in text or len(numbers) != 2 or numbers[0] >= numbers[1]:
        raise SweepError(f"--seeds {text}: write FROM:TO, where TO is no longer a seed, or 1,5,7")
    if numbers[1] - numbers[0] > MOST_RUNS:
        raise SweepError(f"--seeds {text}: more than {MOST_RUNS} runs")
    return tuple(range(*numbers))


def combinations(axes: Sequence[Axis], seeds: Sequence[int]) -> list[dict[str, str]]:
    """Every combination of values, the last axis changing fastest. Raises SweepError."""
    count = prod(len(axis.values) for axis in axes)
    if count > MOST_SETTINGS or count * len(seeds) > MOST_RUNS:
        raise SweepError(
            f"{count} settings and {count * len(seeds)} runs are more than the "
            f"{MOST_SETTINGS} settings and {MOST_RUNS} runs of one sweep"
        )
    names = [axis.name for axis in axes]
    return [dict(zip(names, one, strict=True)) for one in product(*(a.values for a in axes))]


@lru_cache(MOST_SETTINGS)
def normalised(value: str) -> Hashable:
    """What is the same of 1, 1.0 and of 1[s], 1000[ms]; of all but quantities the text."""
    number = quantity(value)
    if number is not None and len(number[1]) <= _LONGEST_UNIT:
        with suppress(UnitError):
            unit = parse_unit(number[1] or "1")
            return unit.to_si(float(number[0])), unit.dimensions
    return value.strip()


def _evenly_spaced(name: str, first: str, last: str, count: str) -> list[str]:
    begin, end = quantity(first), quantity(last)
    if begin is None or end is None or begin[1] != end[1]:
        raise SweepError(f"--set {name}: {first} and {last} are not two numbers of one unit")
    is_number = count.isascii() and count.isdigit() and len(count) < 10
    if not (is_number and 2 <= int(count) <= MOST_SETTINGS):
        raise SweepError(
            f"--set {name}: COUNT is a whole number from 2 to {MOST_SETTINGS}, not {count!r}"
        )
    steps = int(count) - 1
    unit = f"[{begin[1]}]" if begin[1] else ""
    numbers = (begin[0] + (end[0] - begin[0]) * i / steps for i in range(steps + 1))
    return [f"{float(number):.12g}{unit}" for number in numbers]


def _split(text: str, sign: str) -> list[str]:
    """Parts of a text between signs that stand in no brackets."""
    depths = accumulate(_BRACKETS.get(char, 0) for char in text)
    outside = [at for at, depth in enumerate(depths) if depth == 0 and text[at] == sign]
    return [text[begin + 1 : end] for begin, end in pairwise((-1, *outside, len(text)))]


# The folder: a row for each run that is done.

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
    return frozenset((name, normalised(value)) for name, value in setting.items()), seed


class Folder:
    """While entered, nobody else writes into it. `done` has the figures of the runs there are."""

    def __init__(self, path: Path, about: Mapping[str, Any]) -> None:
        """`about`: JSON values that say what the runs are of: specification and options."""
        self.path = path
        self.done: dict[RunKey, Figures] = {}
        self._about = {"version": VERSION, **about}
        self._created: list[Path] = []
        self._log: Any = None

    def __enter__(self) -> Folder:
        """Raises SweepError for a folder that is in use or that has other runs, OSError."""
        self._created = [each for each in (self.path, *self.path.parents) if not each.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        entries = sorted(os.scandir(self.path), key=lambda entry: entry.name)
        for entry in entries:
            # What is written and removed here must not be somebody's files elsewhere.
            is_file = entry.is_file(follow_symlinks=False)
            if not is_file and not entry.is_dir(follow_symlinks=False):
                self._refuse(f"{entry.name} is a link or no file, which no sweep made")
        for entry in () if (self.path / ABOUT).exists() else entries:
            # A sweep that was ended before it said what it is of left no more than an empty log.
            is_begun = entry.name == LOG and entry.stat().st_size == 0
            if not is_begun and not entry.name.startswith(PREFIX):
                self._refuse(f"{entry.name} is there, which no sweep wrote")
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
                for folder in self._created:
                    folder.rmdir()
        self._log.close()

    def _refuse(self, why: str) -> NoReturn:
        raise SweepError(f"{self.path}: {why}; name another folder with --out")

    def _check(self) -> None:
        path = self.path / ABOUT
        if not path.exists():
            write_atomically(path, json.dumps(self._about, indent=2) + "\n")
            return
        found: Any = None
        with suppress(ValueError, RecursionError):
            found = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise SweepError(f"{path} is not of a sweep; name another folder with --out")
        if other := [n for n in {**self._about, **found} if found.get(n) != self._about.get(n)]:
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
                setting, seed, figures = log_entry(line)
                self.done[key_of(setting, seed)] = figures
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

    def is_missing(self, setting: SweepSetting, seed: int, limit_s: float) -> bool:
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


def log_entry(line: bytes) -> tuple[SweepSetting, int, Figures]:
    """The setting, the seed and the figures in a line of the log.

    Raises ValueError, KeyError, TypeError, AttributeError or RecursionError for another line.
    """
    entry = json.loads(line)
    run = dict(entry["run"])
    is_run = (
        all(map(_is_figure, run.values()))
        and isinstance(run["success"], bool | None)
        and isinstance(run["reason"], str)
        and (run.get("ended") != LIMIT or isinstance(run["wall_s"], int | float))
    )
    if not is_run:
        raise ValueError
    key_of(entry["set"], entry["seed"])  # what it is not of fails here
    return entry["set"], entry["seed"], run


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
    for row in rows:
        fields = row.items()
        table.writerow({n: json.dumps(v) if isinstance(v, bool | float) else v for n, v in fields})
    return text.getvalue()
