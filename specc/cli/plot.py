"""`specc plot`: signals of recorded runs and the states of their machines, as picture or table."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import isnan
from pathlib import Path
from typing import Any

from specc.cli import streams
from specc.cli.pictures import write_picture
from specc.cli.recorded_spec import texts_by_path
from specc.cli.recordings import call_runtime, print_losses
from specc.diagnostics.phrases import truncate
from specc.model.system import System
from specc.reachable import grouped
from specc.refusal import Refused, missing_package
from specc.tools.plot import Signal, found
from specc.tools.plot.drawing import MOST_BANDS, MOST_PANELS, drawn
from specc.tools.plot.sheet import PlottedRun, Sheet, bands, cut, marks, numbers_of, panels
from specc.tools.plot.table import table, timeline
from specc.tools.why import NotKnown

FORMATS = ("svg", "png", "pdf", "csv")
MOST_RECORDINGS = 6
_RECORDED = ".mcap"
_LONGEST_TITLE = 100


def plot(options: Namespace) -> int:
    """Draw what is asked of recordings, or the states of all their machines."""
    others = [word for word in options.signals if word.endswith(_RECORDED)]
    words = [word for word in options.signals if not word.endswith(_RECORDED)]
    return _Plot(options, [options.file, *others], words).make()


class _Plot:
    """What is asked for: recordings, and signals in groups that share a panel."""

    def __init__(self, options: Namespace, files: Sequence[str], words: Sequence[str]) -> None:
        self._files, self._words = [Path(file) for file in files], words
        if len(files) > MOST_RECORDINGS:
            raise Refused(f"{len(files)} recordings are not told apart; name {MOST_RECORDINGS}")
        suffix = "timeline" if not words else "plot"
        self._out = options.out or f"{self._files[0].stem}-{suffix}.svg"
        self._form = os.path.splitext(self._out)[1].lower().removeprefix(".")
        if options.csv:
            self._out, self._form = self._table(options.out), "csv"
        if self._form not in FORMATS:
            raise Refused(f"{self._out}: the name has to end in .{', .'.join(FORMATS)}")
        self._times_s = options.since, options.until
        if options.since >= options.until:
            raise Refused(f"--since {options.since:g} is not before --until {options.until:g}")
        _, texts = call_runtime("recording.messages", "recorded", self._files[0])
        self._system = _system(texts)
        self._machines: list[str] = []
        self._groups: list[list[Signal]] = []
        self._signals: dict[str, Signal] = {}
        for word in words:
            self._choose(word.split(","))

    def _table(self, out: str | None) -> str:
        if out and not out.lower().endswith(".csv"):
            raise Refused(f"{out}: with --csv the name has to end in .csv")
        return out or ""

    def _choose(self, names: Sequence[str]) -> None:
        """Take note of signals that share a panel."""
        if self._system is None:
            file = self._files[0]
            raise Refused(f"{file} has no specification that can be read, so it names no signals")
        group: list[Signal] = []
        for name in names:
            part = found(self._system, name)
            if isinstance(part, Signal):
                group.append(self._placed(part))
            elif part.qualified_name not in self._machines:
                self._machines.append(part.qualified_name)
        self._groups += [group] if group else []

    def _placed(self, signal: Signal) -> Signal:
        """The signal with its place; the same one whenever it is named."""
        if signal.name not in self._signals:
            before = sum(other.owner == signal.owner for other in self._signals.values())
            self._signals[signal.name] = replace(signal, place=before)
        return self._signals[signal.name]

    def make(self) -> int:
        """Read the recordings and write the plot; the exit code."""
        wanted = grouped((s.owner, _wanted(s)) for s in self._signals.values())
        runs, readings = [], []
        for file, name in zip(self._files, _names(self._files), strict=True):
            readings.append(call_runtime("recording.reading", "RecordFile", file))
            runs.append(
                self._part(PlottedRun(name, self._traces(file, wanted, readings[-1])), file)
            )
        self._tell_of_nothing(runs)
        names, still = (self._machines, ()) if self._words else self._all(runs)
        if self._form == "csv":
            self._put_table(runs, names)
        else:
            self._draw(runs, names, still)
        return max(int(print_losses(reading)) for reading in readings)

    def _traces(self, file: Path, wanted: Mapping[str, Any], reading: Any) -> Any:
        try:
            return call_runtime("recording.traces", "traces", file, wanted, reading)
        except NotKnown as error:
            raise Refused(f"{file}: {error}, as its specification says") from error

    def _part(self, run: PlottedRun, file: Path) -> PlottedRun:
        """What is asked for of a recording; raises Refused where that is nothing."""
        begin_s, end_s = self._times_s
        if begin_s > run.traces.end_s or end_s < run.traces.begin_s:
            has = f"{run.traces.begin_s:.12g} s to {run.traces.end_s:.12g} s"
            raise Refused(f"{file} goes from {has}; --since and --until leave nothing of it")
        return cut(run, begin_s, end_s)

    def _tell_of_nothing(self, runs: Sequence[PlottedRun]) -> None:
        """Say which signals have no value in any recording."""
        for signal in self._signals.values():
            columns = (column for run in runs for column in numbers_of(signal, run)[1])
            if all(map(isnan, chain.from_iterable(columns))):
                streams.print_message(f"specc: {signal.name} never has a value")

    def _all(self, runs: Sequence[PlottedRun]) -> tuple[list[str], tuple[str, ...]]:
        """The machines in the order of the specification, and those that never changed."""
        known = [s.qualified_name for s in self._system.subsystems] if self._system else []
        lines = [item for run in runs for item in run.traces.lines.items()]
        states = grouped((name, span.state) for name, line in lines for span in line.spans)
        names = [name for name in known if name in states]
        names += [name for name in states if name not in known]
        moving = [name for name in names if len(set(states[name])) > 1]
        if not moving:
            return names, ()
        return moving, tuple(f"{name} {states[name][0]}" for name in names if name not in moving)

    def _put_table(self, runs: Sequence[PlottedRun], names: Sequence[str]) -> None:
        if self._words:
            text = table(runs, list(self._signals.values()), names)
        else:
            text = timeline(
                [(r.name, list(bands([PlottedRun("", r.traces)], names, None))) for r in runs]
            )
        if self._out:
            write_picture(self._out, text.encode(errors="backslashreplace"), "csv", "plot")
            streams.print_output(f"{self._out}\n")
        else:
            streams.print_output(text)

    def _draw(
        self, runs: Sequence[PlottedRun], names: Sequence[str], still: tuple[str, ...]
    ) -> None:
        shown = tuple(bands(runs, names, self._system))
        if len(shown) > MOST_BANDS:
            words = f"{len(shown)} machines are not legible on a page; name up to {MOST_BANDS}"
            raise Refused(f"{words}, or take the table with --csv")
        drawn_panels = tuple(panels(runs, self._groups))
        if len(drawn_panels) > MOST_PANELS:
            words = f"{len(drawn_panels)} panels are not legible on a page"
            raise Refused(f"{words}; name fewer signals, up to {MOST_PANELS} panels")
        begin_s = min(run.traces.begin_s for run in runs)
        end_s = max(run.traces.end_s for run in runs)
        title = self._title(runs)
        sheet = Sheet(title, shown, drawn_panels, tuple(marks(runs)), begin_s, end_s, still)
        try:
            content = drawn(sheet, self._form)
        except ModuleNotFoundError as error:
            raise missing_package(error, "matplotlib") from error
        write_picture(self._out, content, self._form, "plot")
        streams.print_output(f"{self._out}\n")

    def _title(self, runs: Sequence[PlottedRun]) -> str:
        files = ", ".join(run.name for run in runs) if len(runs) > 1 else self._files[0].name
        system = self._system
        called_ = truncate(system.title or system.name, _LONGEST_TITLE) if system else ""
        return f"{called_}, {files}" if called_ else files


def _system(texts: Mapping[str, str]) -> System | None:
    """What the specification in a recording means, as far as it is there and right."""
    from specc import pipeline

    name = os.path.basename(next(iter(texts), "")) or "recorded.yaml"
    path = os.path.join(os.sep, "recorded", name)
    return pipeline.read_texts(path, texts_by_path(texts, path)) if texts else None


def _names(files: Sequence[Path]) -> list[str]:
    """The shortest ends of paths that tell recordings apart; nothing where there is one."""
    if len(files) == 1:
        return [""]
    paths = [Path(os.path.normpath(file)).with_suffix("") for file in files]
    parts = [path.parts[bool(path.anchor) :] for path in paths]
    tails = [_tail(own, parts) for own in parts]
    if len(set(tails)) == len(tails):
        return tails
    return [f"{tail} ({number})" for number, tail in enumerate(tails, start=1)]


def _tail(own: Sequence[str], every: Sequence[Sequence[str]]) -> str:
    """The shortest end that no other has, or all of it."""
    counts = range(1, len(own) + 1)
    alone = (n for n in counts if sum(other[-n:] == own[-n:] for other in every) == 1)
    return "/".join(own[-next(alone, len(own)) :])


def _wanted(signal: Signal) -> Any:
    """What to read of a recording for a signal."""
    numbers = len(signal.components), signal.numbers
    return call_runtime("recording.traces", "Wanted", signal.path, *numbers)
