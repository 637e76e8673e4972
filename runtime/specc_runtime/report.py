"""The report of a run, as data and as a file, and the counts over its records that it tells."""

from __future__ import annotations

import json
import math
import os
import platform
import re
import resource
import sys
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from specc_runtime.atomic_files import replacing
from specc_runtime.extras import lacking
from specc_runtime.faults import Fault, text_of
from specc_runtime.options import Options, UsageError
from specc_runtime.records import StepRecord
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System
from specc_runtime.timing import Quantiles, late_data

_RECENT = 5
"""Transitions that are told of each subsystem, the last ones."""
Passage = tuple[str, int, str]
"""State before (empty in the first period), transition taken or -1, state whose behaviour ran."""


@dataclass(slots=True)
class TakenTransition:
    """A row that was taken, so many times without another between: first and last time in s."""

    transition: str
    first_s: float
    last_s: float
    times: int = 1


@dataclass(slots=True)
class Tally:
    """What one subsystem did. `state` is where it is now, since `since_s`.

    `spent_s` is the time in each state before that, `recent` are the last rows that were taken.
    Without `is_timed` the times are not known: the run goes on from a recording without them.
    """

    subsystem: Subsystem
    state: str = ""
    paths: Counter[Passage] = field(default_factory=Counter)
    since_s: float = 0.0
    spent_s: dict[str, float] = field(default_factory=dict)
    is_timed: bool = True
    recent: deque[TakenTransition] = field(default_factory=lambda: deque(maxlen=_RECENT))

    def note(self, record: StepRecord) -> None:
        """Count a step."""
        self.paths[self.state, record.transition, record.state] += 1
        if record.state != self.state:
            self.spent_s = self.time_in_states(record.time_s)
            self.state, self.since_s = record.state, record.time_s
        if record.transition >= 0:
            row = str(self.subsystem.transitions[record.transition])
            if self.recent and self.recent[-1].transition == row:
                self.recent[-1].last_s = record.time_s
                self.recent[-1].times += 1
            else:
                self.recent.append(TakenTransition(row, record.time_s, record.time_s))

    def time_in_states(self, until_s: float) -> dict[str, float]:
        """Seconds in each state until then, in order of the states' names."""
        spent_s = dict(self.spent_s)
        if self.state:
            spent_s[self.state] = spent_s.get(self.state, 0.0) + until_s - self.since_s
        return dict(sorted(spent_s.items()))

    def time_in_modes(self, until_s: float) -> dict[str, float]:
        """Seconds in each mode until then, in order of the modes' names."""
        spent_s: dict[str, float] = {}
        for state, time_s in self.time_in_states(until_s).items():
            for mode in self.subsystem.modes.get(state, ()):
                spent_s[mode] = spent_s.get(mode, 0.0) + time_s
        return dict(sorted(spent_s.items()))

    @property
    def steps(self) -> int:
        """Committed steps."""
        return sum(self.paths.values())

    @property
    def states_visited(self) -> dict[str, int]:
        """Steps in each state, in order of the states' names."""
        counts: Counter[str] = Counter()
        for (_, _, state), steps in self.paths.items():
            counts[state] += steps
        return dict(sorted(counts.items()))

    @property
    def transitions_taken(self) -> dict[str, int]:
        """How often each row of the table was taken, in order of the table."""
        counts: Counter[int] = Counter()
        for (_, transition, _), steps in self.paths.items():
            counts[transition] += steps
        rows = enumerate(self.subsystem.transitions)
        return {str(row): counts[index] for index, row in rows if counts[index]}

    def equations(self) -> set[int]:
        """Numbers of the equations that were executed.

        A step checks the error conditions of the state before, then the terminal one, up to the one
        that holds, then the rows of that state and cause up to the one taken. It executes the
        behaviour of the new state.
        """
        done: set[int] = set()
        tables = self.subsystem.equations
        for before, transition, state in self.paths:
            done.update(tables.behaviours.get(state, ()))
            if not before:
                continue
            rows = self.subsystem.transitions[: transition + 1]
            cause = rows[-1].cause if rows else "terminal"
            checks = tables.checks.get(before, {})
            errors = [ending for ending in checks if ending != "terminal"]
            tested = errors[: errors.index(cause) + 1] if cause in errors else errors
            for ending in tested if cause != "terminal" else checks:
                done.update(checks[ending])
            for row, numbers in zip(rows, tables.rows, strict=False):
                if (row.source, row.cause) == (before, cause):
                    done.update(numbers)
        return done


class Statistics:
    """Tallies of all subsystems by name; call it with each record."""

    def __init__(self, system: System) -> None:
        self.tallies = {s.subsystem.name: Tally(s.subsystem) for s in system.subsystems}

    def __call__(self, record: StepRecord) -> None:
        """Count a step."""
        self.tallies[record.subsystem].note(record)

    def saved(self) -> dict[str, Any]:
        """The tallies as plain data, with the rows as texts."""
        found = {}
        for name, tally in self.tallies.items():
            rows = {-1: "", **{i: str(row) for i, row in enumerate(tally.subsystem.transitions)}}
            paths = [[a, rows[row], b, count] for (a, row, b), count in tally.paths.items()]
            times = {"since": tally.since_s, "spent": tally.spent_s} if tally.is_timed else {}
            found[name] = {
                "state": tally.state,
                "paths": paths,
                **times,
                "recent": [astuple(transition) for transition in tally.recent],
            }
        return found

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from there; raises KeyError, TypeError, ValueError for other data."""
        for name, tally in self.tallies.items():
            if name not in saved:
                continue
            rows = {str(row): index for index, row in enumerate(tally.subsystem.transitions)}
            tally.state = str(saved[name]["state"])
            for before, row, state, count in saved[name]["paths"]:
                tally.paths[str(before), rows.get(row, -1), str(state)] += int(count)
            tally.is_timed = "since" in saved[name]  # older recordings have none
            tally.since_s = float(saved[name].get("since", 0.0))
            spent_s = saved[name].get("spent", {}).items()
            tally.spent_s = {str(state): float(time_s) for state, time_s in spent_s}
            tally.recent.extend(
                TakenTransition(str(row), float(first_s), float(last_s), int(times))
                for row, first_s, last_s, times in saved[name].get("recent", ())
            )

    @property
    def states(self) -> dict[str, str]:
        """Where each machine is now; of what never leaves its state there is nothing to say."""
        tallies = self.tallies.items()
        return {name: tally.state for name, tally in tallies if tally.subsystem.transitions}

    def equations(self) -> list[int]:
        """Numbers of all equations that were executed, in order."""
        done: set[int] = set()
        return sorted(done.union(*(tally.equations() for tally in self.tallies.values())))


_DISTRIBUTIONS = {
    "numpy": "numpy", "mujoco": "mujoco", "pinocchio": "pin", "cv2": "opencv-python-headless"
}  # fmt: skip


Ending = Literal["running", "completed", "fault", "interrupted"]


@dataclass(frozen=True, slots=True)
class Report:
    """What happened in a run; the fields are the keys of the file.

    `ended` says how; "running" is written while a run goes on, and stays if it is killed.
    `interrupted` says that the run was ended from outside, before it was over, `last_outputs` what
    the elements of devices were sent last, `set` which constants had other values than the
    specification says, `scene` the positions of joints that were drawn for the beginning, in m or
    rad, `disturbances` when each began, `changes` the values that constants got meanwhile,
    `panel` how the operator's panel was operated,
    `requirements` what became of those of the system, `unobserved` why something could not be
    observed, `clipped` which elements were commanded what their actuators cannot do,
    `other_commanders` who else sent on topics that the run commands, `stop_when` when the formula
    that ends the run held first, and
    `real_time` how a run followed the clock; these eleven are left out where there are none.
    """

    spec: str
    seed: int
    versions: dict[str, str]
    simulated_s: float
    wall_s: float
    real_time_factor: float
    peak_memory_mb: float
    cycles: list[dict[str, Any]]
    subsystems: dict[str, dict[str, Any]]
    equations_executed: list[int]
    records_sha256: str
    faults: list[dict[str, Any]]
    ended: Ending
    interrupted: bool
    last_outputs: dict[str, dict[str, str]]
    set: dict[str, str]
    scene: dict[str, float] = field(default_factory=dict)
    requirements: list[dict[str, Any]] = field(default_factory=list)
    disturbances: list[dict[str, Any]] = field(default_factory=list)
    changes: list[dict[str, Any]] = field(default_factory=list)
    panel: list[dict[str, Any]] = field(default_factory=list)
    unobserved: dict[str, str] = field(default_factory=dict)
    clipped: dict[str, dict[str, Any]] = field(default_factory=dict)
    other_commanders: dict[str, dict[str, Any]] = field(default_factory=dict)
    stop_when: dict[str, Any] = field(default_factory=dict)
    real_time: dict[str, Any] = field(default_factory=dict)

    def as_data(self) -> dict[str, Any]:
        """Plain values; numbers that JSON does not have become null."""
        named = {name: _plain(getattr(self, name)) for name in self.__slots__}
        seldom = (
            *("set", "scene", "requirements", "disturbances", "changes", "panel", "unobserved"),
            *("clipped", "other_commanders", "stop_when", "real_time"),
        )
        return {n: value for n, value in named.items() if value or n not in seldom}


def stillborn(options: Options, faults: list[Fault], *, interrupted: bool) -> Report:
    """The report of a run that ended before its first tick, by faults or interrupted."""
    return Report(
        spec=options.directory.name,
        seed=options.seed,
        versions=versions(),
        simulated_s=0.0,
        wall_s=0.0,
        real_time_factor=0.0,
        peak_memory_mb=peak_memory_mb(),
        cycles=[],
        subsystems={},
        equations_executed=[],
        records_sha256="",
        faults=[fault.as_data() for fault in faults],
        ended="fault" if faults else "interrupted",
        interrupted=interrupted,
        last_outputs={},
        set=dict(options.built_with),
    )


def subsystem_data(tally: Tally, busy_s: float, simulated_s: float) -> dict[str, Any]:
    """The entry of one subsystem; `busy_s` is the wall time of its steps."""
    steps = tally.steps
    spent_s = tally.time_in_states(simulated_s).items() if tally.is_timed else ()
    rounded_s = {state: round(time_s, 9) for state, time_s in spent_s}
    in_modes_s = tally.time_in_modes(simulated_s).items() if tally.is_timed else ()
    modes_s = {mode: round(time_s, 9) for mode, time_s in in_modes_s}
    return {
        "steps": steps,
        "mean_step_us": 1e6 * busy_s / steps if steps else 0.0,
        "states_visited": tally.states_visited,
        **({"time_in_states_s": rounded_s} if tally.is_timed else {}),
        **({"time_in_modes_s": modes_s} if modes_s else {}),
        "transitions_taken": tally.transitions_taken,
        "last_transitions": [asdict(transition) for transition in tally.recent],
    }


def real_time_data(
    lateness: Quantiles, skipped: Mapping[str, int], first: tuple[str, int, float] | None
) -> dict[str, Any]:
    """The entry of a run in real time: how late ticks were, and the periods without a step."""
    return {
        "late_us": late_data(lateness),
        "skipped": dict(skipped),
        "first_skipped": first and dict(zip(("subsystem", "stamp", "time_s"), first, strict=True)),
    }


def versions() -> dict[str, str]:
    """Python, specc and the packages in use."""
    found = {"python": platform.python_version()}
    used = {name: dist for name, dist in _DISTRIBUTIONS.items() if name in sys.modules}
    return found | {name: _version(dist) for name, dist in {"specc": "specc", **used}.items()}


@cache
def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "unknown"


def peak_memory_mb() -> float:
    """Largest resident set of this process so far, 10^6 bytes."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    unit_bytes = 1 if sys.platform == "darwin" else 1024
    return peak * unit_bytes / 1e6


REPORT, RECORDING, FILM = "report", "recording", "film"
_BEGINNINGS = {
    REPORT: rb'\{\s*"spec":',
    RECORDING: rb"\x89MCAP0\r\n\x01.{8}(\0{4}|\x04\0{3}ros2)\x05\0{3}specc",
    FILM: rb"RIFF|\x1aE\xdf\xa3|.{4}ftyp",  # WebP, Matroska, MP4
}


def check_outputs(options: Options) -> None:
    """Raises UsageError unless all files that a run is to write can be put where they are to go.

    Better known before a run than after.
    """
    for option, is_wanted in (("exact", options.record_exact), ("images", options.record_images)):
        if is_wanted and options.record is None:
            raise UsageError(f"--record-{option}: the run is not recorded; add --record")
    if options.profile is not None:
        if options.record is None:
            raise UsageError("--profile: the run is not recorded; add --record FILE.mcap")
        if find_spec("rosbags") is None:
            raise UsageError(lacking("rosbags"))
        if options.record_exact or options.record_images:
            raise UsageError("--profile ros2: messages are recorded as they are")
    if options.bag is not None and options.record is not None:
        bag, record = options.bag.resolve(), options.record.resolve()
        if bag in (record, record.parent):
            raise UsageError(f"cannot write {options.record}: the run reads {options.bag}")
    if options.record_exact and options.record_images:
        raise UsageError("--record-images: with --record-exact images are as they are")
    looks = {"fps": options.fps, "size": options.size, "geom-groups": options.geom_groups}
    for option, look in looks.items():
        if look is not None and options.video is None:
            raise UsageError(f"--{option}: the run is not filmed; add --video")
    wanted = ((options.report, REPORT), (options.video, FILM), (options.record, RECORDING))
    written: set[Path] = set()
    for file, kind in wanted:
        if file is None:
            continue
        check_writable(file, kind)
        if file.resolve() in written:
            raise UsageError(f"cannot write {file}: two things that are asked for go there")
        written.add(file.resolve())


def check_writable(path: Path, kind: str) -> None:
    """Raises UsageError unless a file of a kind can be put there.

    What is there already gives way only if it is empty or of that kind: it is no file that
    somebody wrote by hand, and none that a run reads.
    """
    folder = path.parent
    if not folder.is_dir():
        raise UsageError(f"cannot write {path}: there is no folder {folder}")
    if path.is_dir():
        raise UsageError(f"cannot write {path}: it is a folder")
    # The file is replaced as a whole, which would put an ordinary one in the place of a device.
    if path.exists() and not path.is_file():
        raise UsageError(f"cannot write {path}: it is no ordinary file")
    # Reports and films take the place of a link; a recording is written as the run goes on.
    if kind == RECORDING and path.is_symlink():
        raise UsageError(
            f"cannot write {path}: it is a link, which may lead anywhere: name the file itself"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"cannot write {path}: permission denied")
    if path.exists() and not _is_of(kind, path):
        raise UsageError(f"cannot write {path}: what is there is no {kind}; name another file")


def is_of(kind: str, head: bytes) -> bool:
    """Whether a file that begins so is of a kind, as specc writes it."""
    return re.match(_BEGINNINGS[kind], head, re.DOTALL) is not None


def _is_of(kind: str, path: Path) -> bool:
    try:
        with path.open("rb") as file:
            head = file.read(1000)
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error
    return not head or is_of(kind, head)


def write(report: Report, path: Path) -> None:
    """Write the report as JSON; whoever reads the file finds the old one or the whole new one.

    Raises OSError when it cannot be written.
    """
    text = json.dumps(report.as_data(), indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as aside:
        aside.write_text(f"{text}\n", encoding="utf-8", errors="backslashreplace")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):  # arrays and scalars of numpy
        return _plain(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    # What a judge says may be anything.
    return value if isinstance(value, str | int | None) else text_of(value)
