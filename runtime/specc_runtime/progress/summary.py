"""The summary of a run on standard output."""

from __future__ import annotations

import errno
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from math import inf
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from specc_runtime.changes import PROGRAM, TASK
from specc_runtime.faults import text_of
from specc_runtime.printing import harmless, visible
from specc_runtime.punctuality import in_words
from specc_runtime.report import Report

CYCLES_ABREAST = 4
_MOST_CYCLES = 100
"""That are shown: a run that goes on until it is stopped may have any number."""


def show(report: Report, console: Console | None = None) -> None:
    """Print cycles, subsystems, figures, requirements and faults."""
    _print(lambda own: _show(report, own), console or Console())


def show_requirements(requirements: Iterable[dict[str, Any]]) -> None:
    """Print what became of requirements."""
    _print(lambda own: _show_requirements(requirements, own), Console())


def _print(what: Callable[[Console], None], own: Console) -> None:
    with own.capture() as captured:
        what(own)
    # Rich would end the process where nobody reads the output; the caller decides instead.
    if sys.stdout is None:
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))
    shown = captured.get()  # with escapes of rich on a terminal, where no runner reads it
    sys.stdout.write(shown if own.is_terminal else harmless(shown))
    sys.stdout.flush()


def _show(report: Report, console: Console) -> None:
    before = max(0, len(report.cycles) - _MOST_CYCLES)
    if before:
        console.print(f"{len(report.cycles)} cycles, of which these are the last:", highlight=False)
    for first in range(before, len(report.cycles), CYCLES_ABREAST):
        console.print(_cycles(report.cycles[first : first + CYCLES_ABREAST], first + 1))
    console.print(_subsystems(report))
    console.print(
        f"{report.simulated_s:.2f} s simulated in {report.wall_s:.2f} s "
        f"({report.real_time_factor:.1f} times real time), {report.peak_memory_mb:.0f} MB, "
        f"seed {report.seed}, {len(report.equations_executed)} equations executed",
        highlight=False,
        soft_wrap=True,
    )
    console.print(f"records {report.records_sha256}", highlight=False, style="dim")
    for line in _followed_the_clock(report.real_time):
        console.print(line, highlight=False, soft_wrap=True)
    for name, clipped in report.clipped.items():
        console.print(_clipped(name, clipped), highlight=False, soft_wrap=True)
    for name, others in report.other_commanders.items():
        nodes = _safe(", ".join(others["nodes"]))
        line = f"{nodes} can send on {_safe(others['topic'])}, too, which commands {_safe(name)}"
        when = f"seen first at {others['first_s']:.3g} s"
        console.print(f"[yellow]not alone[/]: {line}: {when}", highlight=False, soft_wrap=True)
    for disturbance in sorted(report.disturbances, key=_beginning_s):
        console.print(_happened(disturbance), highlight=False, soft_wrap=True)
    for change in report.changes:
        if change["by"] == PROGRAM:
            words = f"set to {change['value']:g} at {change['time_s']:.3f} s"
            console.print(f"{_safe(change['constant'])} {words}", highlight=False, soft_wrap=True)
    if operations := Counter(each["by"] for each in report.panel if each["by"] != TASK):
        by = ", ".join(f"{count} by {_safe(who)}" for who, count in operations.items())
        console.print(f"operations of the panel: {by}", highlight=False, soft_wrap=True)
    _show_requirements(report.requirements, console)
    if stop := report.stop_when:
        met_s = stop["met_s"]
        when = "[yellow]never held[/]" if met_s is None else f"held first at {met_s:.3f} s"
        console.print(f"{when}: {_safe(stop['that'])}", highlight=False, soft_wrap=True)
    for name, why in report.unobserved.items():
        console.print(f"unknown {_safe(f'{name}: {why}')}", highlight=False, soft_wrap=True)
    for fault in report.faults:
        for line in _fault_lines(fault):
            console.print(line, highlight=False, soft_wrap=True)


def _followed_the_clock(report: dict[str, Any]) -> Iterator[str]:
    """How late ticks were, and which periods were skipped."""
    if not report:
        return
    late = (f"{report['late_us'][of] / 1000:.3g} ms {words}" for of, words in _LATE.items())
    yield f"{report['ticks']} ticks in real time, late by {', '.join(late)}"
    if report["punctual"]:
        yield f"for punctuality: {in_words(report['punctual'])}"
    yield "; ".join(f"{where}: {', '.join(names)}" for where, names in _places(report["steps"]))
    for name, step in report["steps"].items():
        took = f"[yellow]{_safe(name)} took {step['p99_us'] / 1000:.3g} ms[/] (99 of 100)"
        if step["budget_us"] is None and step["p99_us"] > report["tick_us"]:
            yield (
                f"{took}, longer than the base tick of {report['tick_us'] / 1000:g} ms: with a "
                "`budget` it computes in a process of its own"
            )
        elif step["budget_us"] is not None and step["p99_us"] > step["budget_us"]:
            yield f"{took}, its budget is {step['budget_us'] / 1000:g} ms"
    skipped = {name: count for name, count in report["skipped"].items() if count}
    if first := report["first_skipped"]:
        words = ", ".join(
            f"{count} of {_safe(name)}, which was late by "
            f"{report['steps'][name]['late_us']['p99'] / 1000:.3g} ms (99 of 100)"
            for name, count in skipped.items()
        )
        yield (
            f"[yellow]periods skipped: {words}[/]; the first is period {first['stamp']} of "
            f"{_safe(first['subsystem'])}, at {first['time_s']:.3f} s: proofs hold until then"
        )


def _places(steps: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """Where steps were made, with the scheduling class, and of which subsystems."""
    where: dict[str, list[str]] = {}
    for name, step in steps.items():
        place = "in a process of its own" if step["process"] else "on the main thread"
        scheduling = f" ({step['scheduling']})" if step["scheduling"] else ""
        where.setdefault(f"{place}{scheduling}", []).append(_safe(name))
    yield from where.items()


_LATE = {"p50": "(half of them)", "p99": "(99 of 100)", "max": "at most"}


def _beginning_s(disturbance: dict[str, Any]) -> float:
    return inf if disturbance["began_s"] is None else float(disturbance["began_s"])


def _clipped(name: str, clipped: dict[str, Any]) -> str:
    """How long an element was commanded what its actuators cannot do, and what was first."""
    least, greatest = clipped["range"]
    first = (
        f"{clipped['value']:.4g} at {clipped['first_s']:.3f} s for {clipped['actuator']}, whose "
        f"{clipped['of']} is {least:.4g} to {greatest:.4g}"
    )
    return (
        f"[yellow]clipped[/] {_safe(name)} for {clipped['time_s']:.3f} s "
        f"({clipped['ticks']} ticks): first {_safe(first)}"
    )


def _happened(disturbance: dict[str, Any]) -> str:
    began_s = disturbance["began_s"]
    when = "never happened" if began_s is None else f"happened at {began_s:.3f} s"
    if disturbance["times"] > 1:
        when = f"happened {disturbance['times']} times, first at {began_s:.3f} s"
    return f"{when}: {_safe(disturbance['because'])}"


def _show_requirements(requirements: Iterable[dict[str, Any]], console: Console) -> None:
    for requirement in requirements:
        console.print(_required(requirement), highlight=False, soft_wrap=True)


_COLOURS = {"met": "green", "violated": "red", "unknown": "yellow"}
_OF_CONTRACTS = {
    "met": "contract met",
    "violated": "broken contract",
    "unknown": "contract unknown",
}


def _required(requirement: dict[str, Any]) -> str:
    """What became of a requirement, with the values that decided it."""
    verdict, margin, time_s = (requirement[key] for key in ("verdict", "margin", "time_s"))
    called = f"{requirement['name']}: " if "name" in requirement else ""
    words = _OF_CONTRACTS if "contract" in requirement else {}
    text = f"[{_COLOURS[verdict]}]{words.get(verdict, verdict)}[/] "
    text += _safe(called + requirement["that"])
    if verdict == "met" and requirement["asked"] is False:
        text += ", [yellow]never asked[/]"
    if margin is not None:
        text += f", margin {margin:.3g}"
    if missing := requirement.get("missing"):
        text += f"; not in the recording: {_safe(', '.join(missing))}"
    if verdict == "violated" and requirement["because"]:
        text += f"\n      because: {_safe(requirement['because'])}"
    if time_s is None:
        return text
    values = (
        f"{name} {'absent' if value is None else _text(value)}"
        for name, value in requirement["values"].items()
    )
    return f"{text}\n      at {time_s:.3f} s: {_safe(', '.join(values))}"


def _fault_lines(fault: dict[str, Any]) -> Iterator[str]:
    """Who is to blame and for what; then where, as far as that is known."""
    yield f"[red]fault[/] {_safe(': '.join((fault['culprit'], fault['message'])))}"
    parts = [f"{fault['fault']} at {fault['time_s']:.3f} s"]
    states = fault["state"], *fault.get("modes", ())
    if fault["subsystem"]:
        parts.append(f"{fault['subsystem']} {' in '.join(states)}".strip())
    if fault["stamp"] >= 0:
        parts.append(f"stamp {fault['stamp']}")
    if fault["condition"]:
        parts.append(f"condition {fault['condition']}")
    if fault["equations"]:
        parts.append(f"eq. {', '.join(map(str, fault['equations']))}")
    if fault["place"]:
        parts.append(f"raised by {fault['place']}")
    yield f"      {_safe(', '.join(parts))}"
    if fault["line"]:
        yield f"      in {_safe(fault['line'])}"


def _cycles(cycles: list[dict[str, Any]], first: int) -> Table:
    table = Table()
    table.add_column("cycle")
    for number in range(first, first + len(cycles)):
        table.add_column(str(number), justify="right", overflow="fold")
    for name in dict.fromkeys(name for cycle in cycles for name in cycle):
        table.add_row(_safe(name), *(_cell(cycle.get(name)) for cycle in cycles))
    return table


def _subsystems(report: Report) -> Table:
    table = Table()
    table.add_column("subsystem")
    for name in ("steps", "mean step", "states", "transitions"):
        table.add_column(name, justify="right")
    for name, data in report.subsystems.items():
        table.add_row(
            name,
            str(data["steps"]),
            f"{data['mean_step_us']:.1f} us",
            str(len(data["states_visited"])),
            str(sum(data["transitions_taken"].values())),
        )
    return table


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "[green]yes[/]" if value else "[red]no[/]"
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 10 else f"{value:.1f}"
    return "-" if value is None else _safe(_text(value))


def _text(value: Any) -> str:
    try:
        return str(value)
    except Exception:  # noqa: BLE001  # what a judge says may be anything
        return text_of(value)


def _safe(text: str) -> str:
    """A stranger's text among the markup of rich."""
    return escape(visible(text))
