"""Tables of many runs: the results of `specc test`, and the runs of a sweep.

Both are files that a stranger may have written: they are data, and a recording that one names is
only looked for in its own folder.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from specc.diagnostics.phrases import counted, truncate
from specc.refusal import Refused, reason_of
from specc.tools.page.messages import Message
from specc.tools.report.document import row, table
from specc.tools.sweep import summary
from specc.tools.sweep.table import ABOUT, LOG, TABLE, RunKey, SweepSetting, key_of, log_entry

RESULTS = "results.json"
_LARGEST = 64_000_000
_MOST_ROWS = 1000
_LONGEST = 400
_MOST_VIOLATED = 3
"""Requirements of a run that are named."""


@dataclass(frozen=True, slots=True)
class Section:
    """A recorded run that has a section: its number, its file, its constants and its seed."""

    number: int
    file: str
    key: RunKey | None


class Results(Protocol):
    """Many runs."""

    @property
    def title(self) -> str:
        """What they are of."""

    @property
    def recordings(self) -> Sequence[Path]:
        """The files of runs that were recorded, those of failures first."""

    def tables(self, sections: Sequence[Section]) -> list[Message]:
        """Tables whose rows lead to the sections of runs, as far as these are there."""


def results_at(word: str) -> Results | None:
    """What a file or a folder says of many runs; None where it is neither of them.

    Raises Refused for one that cannot be used.
    """
    path = Path(word)
    if path.is_dir():
        if (path / RESULTS).is_file():
            return TestResults(path / RESULTS)
        if (path / LOG).is_file():
            return SweepResults(path)
        raise Refused(f"{word} has neither {RESULTS} of `specc test` nor {LOG} of `specc sweep`")
    if path.name in (LOG, TABLE, ABOUT):
        return SweepResults(path.parent)
    return TestResults(path) if path.suffix == ".json" else None


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except OSError as error:
        raise Refused(f"{path} cannot be read: {reason_of(error)}") from error
    if len(content) > _LARGEST:
        raise Refused(f"{path} is larger than {_LARGEST // 1_000_000} MB")
    return content


def _short(value: object) -> str:
    return truncate(" ".join(str(value).split()), _LONGEST)


def _cut(rows: Sequence[Message]) -> tuple[list[Message], list[str]]:
    """At most `_MOST_ROWS`, those of failures first if there are more; and a note that says so."""
    if len(rows) <= _MOST_ROWS:
        return list(rows), []
    shown = sorted(rows, key=lambda one: not one["is_bad"])[:_MOST_ROWS]
    return shown, [f"{_MOST_ROWS} of {counted(len(rows), 'run')}, failures first"]


# `specc test`.


class TestResults:
    """What `specc test` found."""

    __test__ = False
    """It is none of pytest."""

    def __init__(self, path: Path) -> None:
        self._path = path
        data: Any = None
        with suppress(ValueError, RecursionError):
            data = json.loads(_content(path))
        if not isinstance(data, dict) or data.get("format") != "specc-test":
            raise Refused(f"{path} has no results of `specc test`")
        if data.get("version") != 1:
            raise Refused(f"{path} is of another version of `specc test`")
        self.title = f"Tests of {_short(data.get('specification', ''))}"
        self._scenarios = [s for s in _list(data, "scenarios") if isinstance(s, dict)]

    @property
    def recordings(self) -> Sequence[Path]:
        """See `Results`."""
        failed = [run for _, run in self._runs() if not run.get("passed")]
        passed = [run for _, run in self._runs() if run.get("passed")]
        found = (self._file(run) for run in (*failed, *passed))
        return list(dict.fromkeys(path for path in found if path is not None))

    def _runs(self) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """The runs, each with the name of its scenario."""
        for scenario in self._scenarios:
            for run in _list(scenario, "runs"):
                if isinstance(run, dict):
                    yield _short(scenario.get("name", "")), run

    def _file(self, run: Mapping[str, Any]) -> Path | None:
        """The recording of a run, if it is in the folder of the results."""
        name, folder = run.get("recording"), self._path.parent
        if not isinstance(name, str) or not name.endswith(".mcap") or "\0" in name:
            return None
        path = Path(os.path.normpath(folder / name))
        is_inside = Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
        return path if is_inside else None

    def tables(self, sections: Sequence[Section]) -> list[Message]:
        """See `Results`."""
        numbers = {section.file: section.number for section in sections}
        rows = [self._run_row(name, run, numbers) for name, run in self._runs()]
        shown, notes = _cut(rows)
        columns = ("scenario", "result", "because", "required", "passed", "rate, 95 %")
        runs = ("run", "result", "violated", "at", "margin", "fault", "recording")
        scenarios = [self._scenario_row(each) for each in self._scenarios[:_MOST_ROWS]]
        return [
            table(self.title, columns, scenarios),
            table("Runs of the scenarios", runs, shown, notes),
        ]

    def _scenario_row(self, scenario: Mapping[str, Any]) -> Message:
        success, rate = _dict(scenario, "success"), _dict(scenario, "rate")
        passed = scenario.get("passed")
        result = "passed" if passed is True else "cut" if passed is None else "failed"
        ends = [_percent(rate.get(name)) for name in ("low", "high")]
        cells = (
            _short(scenario.get("name", "")),
            result,
            _short(scenario.get("because", "")),
            f"{_number(success.get('required'))} of {_number(success.get('of'))}",
            f"{_number(rate.get('passed'))} of {_number(rate.get('of'))}",
            " to ".join(ends) if all(ends) else "",
        )
        return row(cells, is_bad=result == "failed")

    def _run_row(self, name: str, run: Mapping[str, Any], numbers: Mapping[str, int]) -> Message:
        violated = [each for each in _list(run, "violated") if isinstance(each, dict)]
        shown = violated[:_MOST_VIOLATED]
        more = [f"and {len(violated) - len(shown)} more"] if len(violated) > len(shown) else []
        file = self._file(run)
        number = None if file is None else numbers.get(str(file))
        has_passed = run.get("passed") is True
        lost = "" if file is None else " (not in this report)" if number is None else ""
        cells = (
            f"{name}, seed {_number(run.get('seed'))}",
            "passed" if has_passed else "failed",
            "; ".join([*(_short(each.get("formula", "")) for each in shown), *more]),
            "; ".join(f"{_number(each.get('time_s'))} s" for each in shown),
            "; ".join(_number(each.get("margin")) for each in shown),
            _short(run.get("fault") or ""),
            "" if file is None else f"{file.name}{lost}",
        )
        return row(cells, is_bad=not has_passed, run=number)


def _list(data: Mapping[str, Any], name: str) -> list[Any]:
    value = data.get(name)
    return value if isinstance(value, list) else []


def _dict(data: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = data.get(name)
    return value if isinstance(value, dict) else {}


def _number(value: object) -> str:
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15
    return f"{value:.6g}" if is_number else "–"


def _percent(value: object) -> str:
    is_share = isinstance(value, int | float) and 0 <= value <= 1
    return f"{100 * value:.1f} %" if is_share else ""  # type: ignore[operator]  # a number then


# `specc sweep`.


class SweepResults:
    """The runs that are in the folder of a sweep."""

    recordings: Sequence[Path] = ()

    def __init__(self, folder: Path) -> None:
        self.title = f"Sweep {folder.name}"
        *lines, _torn = _content(folder / LOG).split(b"\n")
        self._runs: list[tuple[SweepSetting, int, Mapping[str, Any]]] = []
        for number, line in enumerate(lines, start=1):
            try:
                self._runs.append(log_entry(line))
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
                raise Refused(f"{folder / LOG}: line {number} is not of a run") from None

    def tables(self, sections: Sequence[Section]) -> list[Message]:
        """See `Results`."""
        numbers = {section.key: section.number for section in sections if section.key is not None}
        names = list(dict.fromkeys(name for setting, *_ in self._runs for name in setting))
        figures = ("success", "reason", "ended", "simulated_s", "cycles", "faults")
        rows = [
            row(
                (
                    f"seed {seed}",
                    _success(run.get("success")),
                    *(_short(setting.get(name, "")) for name in names),
                    *(_figure(run.get(name)) for name in figures[1:]),
                ),
                is_bad=run.get("success") is False,
                run=numbers.get(key_of(setting, seed)),
            )
            for setting, seed, run in self._runs
        ]
        shown, notes = _cut(rows)
        heads = ("run", "success", *names, *figures[1:])
        return [*self._settings(names), table(f"Runs of {self.title}", heads, shown, notes)]

    def _settings(self, names: Sequence[str]) -> Iterator[Message]:
        """How often runs of each setting succeed, as `specc sweep` says it."""
        if not self._runs:
            return
        of_setting = [
            {**{name: _short(setting.get(name, "")) for name in names}, "success": run["success"]}
            for setting, _, run in self._runs
        ]
        cells = summary.cells_of(of_setting, names)
        head, *lines = summary.as_text(summary.worst(cells, _MOST_ROWS), names)
        notes = [f"the {_MOST_ROWS} with the least success"] if len(cells) > _MOST_ROWS else []
        yield table(f"{self.title}: settings", head, [row(line) for line in lines], notes)


def _success(value: object) -> str:
    return "undecided" if value is None else "yes" if value else "no"


def _figure(value: object) -> str:
    return "" if value is None else _number(value) if type(value) is float else _short(value)
