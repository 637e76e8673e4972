"""Where subsystems compute in real time, by their budgets; whether there is time, and was."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any

from specc_runtime.cycle import Executor
from specc_runtime.options import Options, UsageError
from specc_runtime.printing import say
from specc_runtime.punctuality import Punctuality
from specc_runtime.report import real_time_data
from specc_runtime.system import Scheduled, System
from specc_runtime.timing import Quantiles, RealTime, Timing, late_data

_ROUNDING = 1 + 1e-9  # times are multiples of a rounded tick


def placed(options: Options, system: System) -> Options:
    """The options with the subsystems that compute in processes of their own, in real time.

    Raises UsageError if the others do not get through their steps.
    """
    if not options.real_time or options.inline:
        return options
    apart = tuple(dict.fromkeys((*options.apart, *_long(system))))
    check(system, apart)
    for remark in remarks(system, apart):
        say(remark)
    return replace(options, apart=apart)


def _long(system: System) -> Iterator[str]:
    """Subsystems with steps that may be longer than a base tick."""
    for scheduled in system.subsystems:
        if scheduled.budget_s is not None and scheduled.budget_s > system.tick_s * _ROUNDING:
            yield scheduled.subsystem.name


def check(system: System, apart: Collection[str]) -> None:
    """Raises UsageError if by their budgets the subsystems in the main process need all its time.

    Then no tick would ever be on time again; a single one that is too full only is late.
    """
    shares = {
        s.subsystem.name: s.budget_s / s.subsystem.period_s
        for s in _budgeted(system)
        if s.budget_s is not None and s.subsystem.name not in apart
    }
    if sum(shares.values()) >= 1.0:
        each = ", ".join(f"{name} {share:.0%}" for name, share in shares.items())
        raise UsageError(
            f"by their budgets these need {sum(shares.values()):.0%} of the time of one process: "
            f"{each}; make their steps shorter or lower their rates"
        )


def remarks(system: System, apart: Collection[str], cores: int | None = None) -> Iterator[str]:
    """What may make a run late although it can begin: full ticks, fewer cores than processes."""
    full = _fullest(system, apart)
    if full is not None:
        budget_s, names = full
        yield (
            f"by their budgets {', '.join(names)} take {1e3 * budget_s:g} ms when all are due, "
            f"longer than the base tick of {1e3 * system.tick_s:g} ms: such ticks make others late"
        )
    cores = cores or len(os.sched_getaffinity(0))
    if len(apart) >= cores:
        yield f"{len(apart)} subsystems compute in processes of their own, on {cores} cores in all"


def _budgeted(system: System) -> list[Scheduled]:
    return [s for s in system.subsystems if s.budget_s is not None]


def _fullest(system: System, apart: Collection[str]) -> tuple[float, tuple[str, ...]] | None:
    """The budgets of those that are due together, if they are longer than a tick, and who it is.

    All are due at tick 0, so that no other tick is fuller.
    """
    here = [s for s in _budgeted(system) if s.subsystem.name not in apart]
    budget_s = sum(s.budget_s for s in here if s.budget_s is not None)
    if budget_s <= system.tick_s * _ROUNDING:
        return None
    return budget_s, tuple(s.subsystem.name for s in here)


def steps_data(
    system: System,
    apart: Collection[str],
    measured: Mapping[str, Quantiles],
    lateness: Mapping[str, Quantiles],
    scheduling: Mapping[str, str],
) -> dict[str, Any]:
    """For each subsystem its budget beside how long its steps took, µs, where, and how late.

    `scheduling` has the scheduling class of each process, and of the main thread for "". The
    first steps, with all that they load, do not count.
    """
    found = {}
    for scheduled in system.subsystems:
        name, budget_s = scheduled.subsystem.name, scheduled.budget_s
        took = measured.get(name, Quantiles())
        found[name] = {
            "budget_us": None if budget_s is None else 1e6 * budget_s,
            "p99_us": 1e6 * took.at(0.99),
            "max_us": 1e6 * took.longest_s,
            "process": name in apart,
            "scheduling": scheduling.get(name if name in apart else "", ""),
            "late_us": late_data(lateness.get(name, Quantiles())),
        }
    return found


def followed_data(
    system: System,
    apart: Collection[str],
    timing: Timing,
    executor: Executor,
    punctuality: Punctuality,
) -> dict[str, Any]:
    """The entry of a report about a run in real time; empty for others."""
    if not isinstance(timing, RealTime):
        return {}
    steps = executor.durations, executor.lateness, punctuality.scheduling
    return {
        "tick_us": 1e6 * system.tick_s,
        "ticks": timing.ticks,
        **real_time_data(timing.lateness, executor.skipped, executor.first_skipped),
        "steps": steps_data(system, apart, *steps),
        "punctual": punctuality.classes,
    }
