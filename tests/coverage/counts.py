"""Counts made from the messages of recordings as the library of MCAP reads them, and from reports.

Nothing is shared with `specc coverage` but the specification as it is resolved: states, rows and
conditions are those that each message names, and their truths stand in it.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from specc.lang import show
from specc.model.system import Subsystem, System
from specc.source import Sources
from specc.tools.why import Moment
from tests.recording.runs import messages

CONSTANT = {"always", "never", "otherwise"}
Key = tuple[str, str, str, bool | None]
"""Kind, subsystem, name, and the truth of a condition."""


def reported(file: Path) -> Mapping[str, Any]:
    """The report in a recording."""
    with file.open("rb") as opened:
        reports = [m for m in make_reader(opened).iter_metadata() if m.name == "report"]
    return dict(json.loads(reports[-1].metadata["report"]))


def counted(system: System, sources: Sources, files: Iterable[Path]) -> Counter[Key]:
    """How many steps name each part; of requirements and equations, how many runs."""
    found: Counter[Key] = Counter()
    for file in files:
        topics = messages(file)
        for subsystem in system.subsystems:
            for _, step in topics[f"/{subsystem.qualified_name}"]:
                if "fault" not in step:
                    found.update(_of_step(subsystem, sources, step))
        report = reported(file)
        for number in report["equations_executed"]:
            found["equation", "", str(number), None] += 1
        for entry in report.get("requirements", ()):
            if entry["asked"] is not False and "contract" not in entry:
                found["requirement", "", entry.get("name", entry["that"]), None] += 1
    return found


def _of_step(subsystem: Subsystem, sources: Sources, step: Mapping[str, Any]) -> set[Key]:
    """What the message of a step names; functions and rows by their lines."""
    name, state = subsystem.qualified_name, step["state"]
    found: set[Key] = {("state", name, state, None)}
    for function in subsystem.state(state).behaviour.functions:
        if function in subsystem.functions:  # what is done for modes stands in no file
            own = function.generic.part.name if function.generic else function.name
            line = sources.span(function.place).line
            found.add(("function", name, f"{line} {own.partition('(')[0]}", None))
    if step["row"] >= 0:
        rows = [row for row in subsystem.transitions if row.label == step["transition"]]
        for row in rows[:1]:
            line = sources.span(row.place).line
            found.add(("row", name, f"{line} {row.source_mode or row.source}", None))
    constant = {c.name for c in subsystem.conditions if show(c.when) in ("True", "False")}
    for condition, truth in step["conditions"].items():
        if condition not in CONSTANT | constant:
            found.add(("condition", name, condition, truth))
    return found


def of_output(items: Iterable[Mapping[str, Any]]) -> Counter[Key]:
    """The counts that `specc coverage --format json` says, by the same keys."""
    found: Counter[Key] = Counter()
    for item in items:
        kind, name = item["kind"], item["name"]
        if kind in ("row", "function"):
            name = f"{item['line']} {name.partition(' ')[0].partition('(')[0]}"
        found[kind, item["subsystem"] or "", name, item.get("truth")] += item["count"]
    return found


def evaluated(system: System, file: Path) -> Counter[Key]:
    """How often each condition was true and false, by what it is worth on the recorded values.

    The recording has to be exact. In a state the conditions that end it are asked in turn up to the
    first one that holds, and then those of the rows of this cause.
    """
    topics, found = messages(file), Counter[Key]()
    for subsystem in system.subsystems:
        steps = [step for _, step in topics[f"/{subsystem.qualified_name}"]]
        entered_s = steps[0]["time"]
        for last, step in pairwise(steps):
            elapsed_s = step["time"] - entered_s
            moment = Moment(
                system, subsystem, step, last["memory"], elapsed_s, is_exact=True, array=None
            )
            for name, truth in _truths(subsystem, moment, step["before"]).items():
                found["condition", subsystem.qualified_name, name, truth] += 1
            entered_s = step["time"] if step["row"] >= 0 else entered_s
    return found


def _truths(subsystem: Subsystem, moment: Moment, state: str) -> dict[str, bool]:
    truths: dict[str, bool] = {}
    for cause, ending in subsystem.state(state).behaviour.endings:
        truths[ending.name] = bool(moment.value(ending.when))
        if truths[ending.name]:
            others = [row for _, row in subsystem.rows(state, cause) if not row.is_otherwise]
            truths |= {row.condition.name: bool(moment.value(row.condition.when)) for row in others}
            break
    return truths
