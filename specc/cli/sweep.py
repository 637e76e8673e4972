"""`specc sweep`: many runs as one table, with its summary and plots."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import sys
import uuid
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc import __version__
from specc.atomic_files import write_atomically
from specc.cli import streams
from specc.cli.interruption import MESSAGE, exit_code
from specc.cli.progress import RunProgress
from specc.cli.run import judge_for_run
from specc.diagnostics.phrases import counted, join_some
from specc.diagnostics.report import Report, report
from specc.processes import cores, defer_signals, processes
from specc.refusal import Refused, missing_package, reason_of
from specc.tools.sweep import summary
from specc.tools.sweep.running import Figures, SweepJob
from specc.tools.sweep.sweeping import (
    InputFiles,
    bundle_of,
    carry_out,
    inputs_of,
    local_workers,
)
from specc.tools.sweep.table import (
    TABLE,
    Axis,
    Folder,
    SweepError,
    SweepSetting,
    as_csv,
    combinations,
    parse_axis,
    parse_seeds,
)

if TYPE_CHECKING:
    from specc.pipeline import Build

_EXTENT = ("cycles", "duration_s", "cycle_limit_s", "renderer", "check_operators")
_ALL = (*_EXTENT, "stop_when")
"""Options of a run; the formula that ends it is in its code."""
_WORK = ".work"
_SUMMARY = "summary.csv"
_FEW = 6
"""Settings for which other processes are not worth their beginning."""
_REASONS, _SETTINGS, _SEEDS = 4, 12, 8
"""Reasons, settings, and seeds of a reason that fit on a screen; the tables have all."""
_LONGEST = 400
"""Characters of a reason that are printed."""


@dataclass(frozen=True, slots=True)
class _Plan:
    """The runs of the command line."""

    axes: tuple[Axis, ...]
    settings: tuple[SweepSetting, ...]
    seeds: tuple[int, ...]

    @property
    def swept(self) -> list[Axis]:
        """Constants with more than one value."""
        return [axis for axis in self.axes if len(axis.values) > 1]

    def row(self, setting: SweepSetting, seed: int, figures: Figures) -> dict[str, Any]:
        """A row of the table."""
        values = {axis.title: axis.cell_value(setting[axis.name]) for axis in self.axes}
        return {**values, "seed": seed, **figures}

    def write_table(self, folder: Folder) -> None:
        """Write the table of the runs that are done."""
        rows = [self.row(*run) for run in folder.runs(self.settings, self.seeds)]
        write_atomically(folder.path / TABLE, as_csv(rows))


class _SettingRefused(Exception):
    """The specification does not take a setting."""

    def __init__(self, setting: SweepSetting, why: Report) -> None:
        super().__init__(setting, why)
        self.setting = setting
        self.why = why


def sweep(options: Namespace) -> int:
    """Run what is not done yet, write the table, and tell what it says.

    0 if all runs are done, whatever came of them; 1 if the specification has errors; 2 for wrong
    usage; 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP, when the same command goes on
    where it ended.
    """
    try:
        return _sweep(options)
    except _SettingRefused as refused:
        if refused.setting:
            streams.print_message(f"specc: with {_words(refused.setting)}:")
        return streams.print_report(refused.why) or 1
    except OSError as error:
        if error.filename is None:
            raise
        raise Refused(f"{error.filename}: {reason_of(error)}") from error


def _sweep(options: Namespace) -> int:
    from specc import pipeline

    units = pipeline.read_spec(options.spec).units if options.set else {}
    axes = tuple(parse_axis(name, text, units.get(name, "")) for name, text in options.set.items())
    seeds = parse_seeds(options.seeds)
    plan = _Plan(axes, tuple(combinations(axes, seeds)), seeds)
    first = _built(options, plan.settings[0])
    assert first.result.system is not None
    inputs = inputs_of(options.spec, first.result.sources, first.result.system)
    about = {
        "specc": __version__,
        "specification": inputs.fingerprint,
        **{name.removesuffix("_s"): getattr(options, name) for name in _ALL},
    }
    stem, code = os.path.splitext(os.path.basename(options.spec))[0], 0
    with Folder(Path(options.out or os.path.join("sweeps", stem)), about) as folder:
        folder.check_size(plan.settings, plan.seeds)
        work = folder.path / _WORK
        shutil.rmtree(work, ignore_errors=True)
        try:
            _run(options, plan, folder, inputs, first)
        except KeyboardInterrupt:
            code = exit_code()
        finally:
            shutil.rmtree(work, ignore_errors=True)
        folder.read()
        _print_results(options, plan, folder)
    if code:
        streams.print_message(f"{MESSAGE}; the same command goes on from here")
    return code


# Code for every setting.


def _built(options: Namespace, setting: SweepSetting) -> Build:
    """The code of a setting. Raises _SettingRefused when there is none."""
    from specc import pipeline

    built = pipeline.build(options.spec, setting, stop_when=options.stop_when, is_read=False)
    judged = judge_for_run(options, built.result)
    if judged.refused:
        raise _SettingRefused(setting, report(judged.findings, [options.spec]))
    return built


def _code(options: Namespace, setting: SweepSetting) -> tuple[str, dict[str, str]]:
    """System and files of a setting: what crosses processes. Raises _SettingRefused."""
    built = _built(options, setting)
    return built.system, built.files


def _packages(
    options: Namespace, settings: Mapping[int, SweepSetting], first: Build, workers: int
) -> tuple[dict[int, str], dict[str, str]]:
    """Where the package of each setting is, and all files of them. Raises _SettingRefused.

    `first` is of setting 0.
    """
    directories: dict[int, str] = {}
    files: dict[str, str] = {}
    packages = [(first.system, first.files)] if 0 in settings else []
    rest = [setting for number, setting in settings.items() if number]
    generate = partial(_code, options)
    if len(rest) < _FEW or workers < 2:
        packages += map(generate, rest)
    else:
        # Copies of this process would hold the lock of the folder for as long as they live.
        with processes(workers, "spawn") as pool:
            with defer_signals():
                jobs = [pool.submit(generate, setting) for setting in rest]
            packages += [job.result() for job in jobs]
    for number, (system, texts) in zip(settings, packages, strict=True):
        directories[number] = f"{number}/{system}"
        # Nearly all files are the same for all settings.
        files |= {f"{number}/{system}/{n}": sys.intern(text) for n, text in texts.items()}
    return directories, files


# Runs.


def _run(options: Namespace, plan: _Plan, folder: Folder, inputs: InputFiles, first: Build) -> None:
    """Make the runs that are missing."""
    from specc import pipeline

    missing = [
        (number, seed)
        for seed in plan.seeds
        for number, setting in enumerate(plan.settings)
        if folder.is_missing(setting, seed, options.limit)
    ]
    count = len(plan.settings) * len(plan.seeds)
    done = count - len(missing)
    if done:
        streams.print_message(f"specc: {done} of {count} runs are done already")
    if not missing:
        return
    workers = options.workers or cores()
    needed = {number: plan.settings[number] for number in sorted({n for n, _ in missing})}
    directories, files = _packages(options, needed, first, workers)
    now = pipeline.read_spec(options.spec)
    if now.system is None or inputs_of(options.spec, now.sources, now.system) != inputs:
        raise SweepError(f"{options.spec}, or a file of it, was changed meanwhile; begin again")
    # The same one each time: what workers have of a sweep that was killed gives way to it.
    owner = f"{platform.node()} {uuid.getnode()} {folder.path.absolute()}"
    name = f"specc-{uuid.uuid5(uuid.NAMESPACE_URL, owner)}"
    extent = {option: getattr(options, option) for option in _EXTENT}
    jobs = [
        SweepJob(name, directories[n], plan.settings[n], seed, extent, options.limit)
        for n, seed in missing
    ]
    bundle = bundle_of(files, inputs)
    if options.scheduler:
        try:
            from specc.tools.sweep.cluster import cluster
        except ModuleNotFoundError as error:
            raise missing_package(error, "dask", "distributed") from None
        made = cluster(options.scheduler, name, bundle)
    else:
        made = local_workers(name, folder.path / _WORK, bundle, workers)
    with made as (pool, room):
        progress = RunProgress(count, done)
        runs = counted(len(missing), "run")
        streams.print_message(f"specc: {runs}, {room} at once, into {folder.path}")
        if not room:
            streams.print_message(
                f"specc: no worker is there yet; begin with `dask worker {options.scheduler}`"
            )
        try:
            carry_out(folder, jobs, pool, progress.update, partial(plan.write_table, folder))
        finally:
            progress.close()


# Results.


def _print_results(options: Namespace, plan: _Plan, folder: Folder) -> None:
    """Write table, summary and plots, and print what people look at first."""
    plan.write_table(folder)
    runs = list(folder.runs(plan.settings, plan.seeds))
    if not runs:
        return
    rows = [plan.row(*run) for run in runs]
    names = [axis.title for axis in plan.axes]
    cells = summary.cells_of(rows, names)
    write_atomically(folder.path / _SUMMARY, as_csv(summary.as_rows(cells, names)))
    worst = summary.as_text(summary.worst(cells, _SETTINGS), names)
    streams.print_output(streams.format_table(worst))
    if (others := len(cells) - _SETTINGS) > 0:
        words = f"and {counted(others, 'setting')} with as much success or more"
        streams.print_output(f"{words}: {folder.path / _SUMMARY}\n")
    reasons = summary.reasons(rows)
    for reason, places in reasons[:_REASONS]:
        streams.print_output(f"{len(places)} {reason[:_LONGEST]}\n")
        streams.print_output(_failing(options, plan, [runs[place][:2] for place in places]))
    if len(reasons) > _REASONS:
        streams.print_output(f"and {len(reasons) - _REASONS} other reasons\n")
    for line in summary.rarely_triggered(rows):
        streams.print_output(f"{line}\n")
    _draw(cells, names, [axis.title for axis in plan.swept], folder.path / "plots")
    streams.print_output(f"{folder.path / TABLE}: {counted(len(rows), 'run')}\n")


def _failing(options: Namespace, plan: _Plan, runs: Sequence[tuple[SweepSetting, int]]) -> str:
    """Seeds that have one reason, of the first setting that has it, and how to repeat the first."""
    setting, first = runs[0]
    seeds = [seed for other, seed in runs if other == setting]
    words = join_some(list(map(str, seeds)), _SEEDS)
    swept = {axis.name: setting[axis.name] for axis in plan.swept}
    words += f" with {_words(swept)}" if swept else ""
    others = len(runs) - len(seeds)
    words += f", and {counted(others, 'run')} with other values" if others else ""
    command = shlex.join(_command(options, setting, first))
    return f"  seed{'s' * (len(seeds) > 1)} {words}: {command}\n"


def _command(options: Namespace, setting: SweepSetting, seed: int) -> Iterator[str]:
    """The command of one run."""
    yield from ("specc", "run", options.spec)
    for name, value in setting.items():
        yield from ("--set", f"{name}={value}")
    for name in _ALL:
        value = getattr(options, name)
        if value and value != "auto":
            yield f"--{name.removesuffix('_s').replace('_', '-')}"
            if value is not True:
                yield str(value).removesuffix(".0") if isinstance(value, float) else str(value)
    yield from ("--seed", str(seed))


def _draw(cells: Sequence[summary.Cell], names: list[str], swept: list[str], folder: Path) -> None:
    for old in (*folder.glob("*.png"), *folder.glob("*.svg")):
        old.unlink()
    if len(swept) > 2:
        streams.print_message(
            "specc: plots show one or two constants; hold the others fixed for them"
        )
        return
    columns = [names.index(name) for name in swept]
    cells = [summary.Cell(tuple(c.values[i] for i in columns), c.runs, c.estimates) for c in cells]
    try:
        summary.plot(cells, swept, folder)
        if swept and (others := sum(1 for _ in summary.columns_to_plot(cells)) - summary.MOST) > 0:
            words = f"no plots of {counted(others, 'other column')}"
            streams.print_output(f"{words}: {folder.with_name(_SUMMARY)}\n")
    except ModuleNotFoundError as error:
        streams.print_message(f"specc: no plots: {missing_package(error, 'matplotlib')}")


def _words(setting: SweepSetting) -> str:
    return ", ".join(f"{name}={value}" for name, value in setting.items())
