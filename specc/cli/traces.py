"""Recordings of what exploring found; the runtime makes them of the generated code."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from specc import output
from specc.atomic_files import sync
from specc.cli.recorded_spec import texts_of
from specc.cli.recordings import called
from specc.cli.streams import Refused
from specc.frozen import frozen
from specc.model.requirement import reach_s

if TYPE_CHECKING:
    from specc.pipeline import Build
    from specc.tools.explore.explorer import Exploration
    from specc.tools.explore.findings import TracedFinding

_INTERRUPTED = "interrupted"
AFTER = 10
"""Periods of the slowest machine that a recording goes on for when the trace is over."""


@frozen
class Recorded:
    """The recording of a trace, or why there is none."""

    file: str = ""
    lacks: str = ""

    @property
    def is_interrupted(self) -> bool:
        """Whether Ctrl-C came before it was made."""
        return self.lacks == _INTERRUPTED


def recorded(found: Exploration, built: Build, spec: str, directory: Path) -> list[Recorded]:
    """Record the traces of `found.traced` in a directory, each in a file of its own.

    Raises:
        Refused: a file cannot be written, or what writes them is not installed.
    """
    if not found.traced:
        return []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".specc-", dir=directory) as scratch:
            return list(_recorded(found, built, spec, Path(scratch)))
    except OSError as error:
        reason = (error.strerror or "unknown reason").lower()
        raise Refused(f"cannot write to {directory}: {reason}") from error


def _recorded(found: Exploration, built: Build, spec: str, scratch: Path) -> Iterator[Recorded]:
    findings, resting = found.traced, len(found.traced) - len(found.findings)
    package, base = scratch / "generated" / built.system, Path(os.path.dirname(spec))
    for diagnostic in output.write(package, built.files):
        raise Refused(diagnostic.message)
    try:
        rehearsal = called("rehearsal", "Rehearsal", package, base)
    except Refused as refused:  # by the user's own modules
        yield from [Recorded(lacks=str(refused))] * len(findings)
        return
    texts = texts_of(built.result.sources, spec)
    for number, finding in enumerate(findings, 1):
        file = scratch / f"{number}-{finding.code}.mcap"
        try:
            options = {"record": file, "texts": texts}
            shared = resting if number > len(found.findings) else 1
            lacks = _record(finding, built, rehearsal, options, shared)
        except KeyboardInterrupt:
            yield from [Recorded(lacks=_INTERRUPTED)] * (len(findings) - number + 1)
            return
        if lacks:
            yield Recorded(lacks=lacks)
            continue
        kept = scratch.parent / file.name
        sync(file)
        os.replace(file, kept)
        yield Recorded(str(kept))


def _record(
    finding: TracedFinding, built: Build, rehearsal: Any, options: dict[str, Any], shared: int
) -> str:
    """Record a run that goes as the trace of a finding; says why if there is none."""
    from specc.tools.explore.concrete import reports
    from specc.tools.explore.sensor_values import NotConcreteError

    assert built.result.system is not None
    way = finding.way
    try:
        found = reports(way, built.result.system, rehearsal, shared)
    except NotConcreteError as error:
        return str(error)
    slowest = max(rehearsal.ticks[step.walker.name] for step in way.steps)
    # A monitor has to see that what is required does not come.
    every = built.result.system.requirements
    required = [r for r in every if (r.that, r.place) == finding.about[1:]]
    ahead_s = max((float(reach_s(each.formula)) for each in required), default=0.0)
    after_s = max(AFTER * slowest * rehearsal.tick_s, 2 * ahead_s)
    duration_s = float(way.time_s) + after_s
    became = called("rehearsal", "record", rehearsal, found, duration_s, options)
    return next((_unseen(said) for r, said in zip(every, became, strict=True) if r in required), "")


def _unseen(verdict: str) -> str:
    """Why the run of a violation does not show it, if its monitor does not see it."""
    if verdict == "violated":
        return ""
    return f"in the run that follows it the requirement is {verdict}"
