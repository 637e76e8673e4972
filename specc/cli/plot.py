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
from specc.cli.files import write_output
from specc.cli.recordings import call_runtime, print_losses, texts_by_path
from specc.diagnostics.phrases import truncate
from specc.model.system import System
from specc.reachable import grouped
from specc.refusal import Refused, missing_package
from specc.tools.plot import Signal, resolve_signal
from specc.tools.plot.sheet import (
    MOST_BANDS,
    MOST_PANELS,
    PlottedRun,
    Sheet,
    bands,
    clip,
    marks,
    numbers_of,
    panels,
    render,
    states_as_csv,
    table,
)
from specc.tools.why import NotKnown

MOST_RECORDINGS = 6
_RECORDED = ".mcap"
_LONGEST_TITLE = 100


def plot(options: Namespace) -> int:
    """Draw the signals of recordings, or the states of all their machines."""
    recordings = [word for word in options.signals if word.endswith(_RECORDED)]
    signals = [word for word in options.signals if not word.endswith(_RECORDED)]
    files = [Path(file) for file in (options.file, *recordings)]
    if len(files) > MOST_RECORDINGS:
        raise Refused(f"{len(files)} recordings are not told apart; name {MOST_RECORDINGS}")
    out, form = _output(options, f"{files[0].stem}-{'plot' if signals else 'timeline'}.svg")
    if options.since >= options.until:
        raise Refused(f"--since {options.since:g} is not before --until {options.until:g}")
    return _Plot(files, signals, (options.since, options.until)).write(out, form, options.force)


def _output(options: Namespace, default: str) -> tuple[str, str]:
    """The file to write, if any, and its format."""
    if options.csv:
        if options.out and not options.out.lower().endswith(".csv"):
            raise Refused(f"{options.out}: with --csv the name has to end in .csv")
        return options.out or "", "csv"
    out = options.out or default
    form, formats = os.path.splitext(out)[1].lower().removeprefix("."), streams.FORMATS["plot"]
    if form not in formats:
        raise Refused(f"{out}: the name has to end in .{', .'.join(formats)}")
    return out, form


class _Plot:
    """Recordings, and signals in groups that share a panel."""

    def __init__(
        self, files: Sequence[Path], signals: Sequence[str], times_s: tuple[float, float]
    ) -> None:
        self._files = files
        self._names_signals = bool(signals)
        _, texts = call_runtime("recording.messages", "recorded", files[0])
        self._system = _system(texts)
        self._machines: list[str] = []
        self._groups: list[list[Signal]] = []
        self._signals: dict[str, Signal] = {}
        for word in signals:
            self._add_panel(word.split(","))
        paths = grouped((s.owner, _wanted(s)) for s in self._signals.values())
        self._runs, self._readings = [], []
        for file, name in zip(files, _shortest_names(files), strict=True):
            reading = call_runtime("recording.reading", "RecordFile", file)
            try:
                traces = call_runtime("recording.traces", "traces", file, paths, reading)
            except NotKnown as error:
                raise Refused(f"{file}: {error}, as its specification says") from error
            begin_s, end_s = times_s
            if begin_s > traces.end_s or end_s < traces.begin_s:
                span = f"{traces.begin_s:.12g} s to {traces.end_s:.12g} s"
                raise Refused(f"{file} goes from {span}; --since and --until leave nothing of it")
            self._runs.append(clip(PlottedRun(name, traces), begin_s, end_s))
            self._readings.append(reading)

    def _add_panel(self, names: Sequence[str]) -> None:
        """Add signals that share a panel, or machines."""
        if self._system is None:
            file = self._files[0]
            raise Refused(f"{file} has no specification that can be read, so it names no signals")
        group: list[Signal] = []
        for name in names:
            part = resolve_signal(self._system, name)
            if isinstance(part, Signal):
                if part.name not in self._signals:
                    place = sum(other.owner == part.owner for other in self._signals.values())
                    self._signals[part.name] = replace(part, place=place)
                group.append(self._signals[part.name])
            elif part.qualified_name not in self._machines:
                self._machines.append(part.qualified_name)
        self._groups += [group] if group else []

    def write(self, out: str, form: str, force: bool) -> int:
        """Write the plot, or print a table; the exit code."""
        for signal in self._signals.values():
            columns = (column for run in self._runs for column in numbers_of(signal, run)[1])
            if all(map(isnan, chain.from_iterable(columns))):
                streams.print_message(f"specc: {signal.name} never has a value")
        names, unchanging = (self._machines, ()) if self._names_signals else self._all_machines()
        if form == "csv":
            content = self._table(names).encode(errors="backslashreplace")
        else:
            content = self._picture(names, unchanging, form)
        if out:
            write_output(out, content, form, map(str, self._files), by="plot", force=force)
        streams.print_output(f"{out}\n" if out else content.decode())
        return max(int(print_losses(reading)) for reading in self._readings)

    def _all_machines(self) -> tuple[list[str], tuple[str, ...]]:
        """The machines in the order of the specification, and those that never changed."""
        known = [s.qualified_name for s in self._system.subsystems] if self._system else []
        lines = [item for run in self._runs for item in run.traces.lines.items()]
        states = grouped((name, span.state) for name, line in lines for span in line.spans)
        names = [name for name in known if name in states]
        names += [name for name in states if name not in known]
        moving = [name for name in names if len(set(states[name])) > 1]
        if not moving:
            return names, ()
        return moving, tuple(f"{name} {states[name][0]}" for name in names if name not in moving)

    def _table(self, names: Sequence[str]) -> str:
        if self._names_signals:
            return table(self._runs, list(self._signals.values()), names)
        runs = [(r.name, bands([PlottedRun("", r.traces)], names, None)) for r in self._runs]
        return states_as_csv([(name, list(shown)) for name, shown in runs])

    def _picture(self, names: Sequence[str], unchanging: tuple[str, ...], form: str) -> bytes:
        runs = self._runs
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
        title, system = ", ".join(run.name for run in runs) or self._files[0].name, self._system
        if system:
            title = f"{truncate(system.title or system.name, _LONGEST_TITLE)}, {title}"
        sheet = Sheet(title, shown, drawn_panels, tuple(marks(runs)), begin_s, end_s, unchanging)
        try:
            return render(sheet, form)
        except ModuleNotFoundError as error:
            raise missing_package(error, "matplotlib") from error


def _system(texts: Mapping[str, str]) -> System | None:
    """What the specification in a recording means, as far as it is there and right."""
    from specc import pipeline

    name = os.path.basename(next(iter(texts), "")) or "recorded.yaml"
    path = os.path.join(os.sep, "recorded", name)
    return pipeline.read_texts(path, texts_by_path(texts, path)).system if texts else None


def _shortest_names(files: Sequence[Path]) -> list[str]:
    """The shortest ends of paths that tell recordings apart; nothing where there is one."""
    if len(files) == 1:
        return [""]
    paths = [Path(os.path.normpath(file)).with_suffix("") for file in files]
    parts = [path.parts[bool(path.anchor) :] for path in paths]
    tails = []
    for own in parts:
        lengths = range(1, len(own) + 1)
        unique = (n for n in lengths if sum(other[-n:] == own[-n:] for other in parts) == 1)
        tails.append("/".join(own[-next(unique, len(own)) :]))
    if len(set(tails)) == len(tails):
        return tails
    return [f"{tail} ({number})" for number, tail in enumerate(tails, start=1)]


def _wanted(signal: Signal) -> Any:
    """What to read of a recording for a signal."""
    numbers = len(signal.components), signal.numbers
    return call_runtime("recording.traces", "Wanted", signal.path, *numbers)
