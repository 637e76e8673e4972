"""One run of a sweep, in a process of its own; on this machine or on a worker.

One that dies or hangs costs one run a row with the reason, never the sweep.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

TRIES = 3
"""Of a run whose process dies."""
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
OWN = (
    *("runs", "seed", "success", "ended", "reason", "simulated_s", "cycles", "faults"),
    *("records_sha256", "wall_s", "met_s"),
)
"""Columns that every table has; those of parts of a specification have a space or a dot."""
STEPS, VERDICT, PREMISE = "steps of ", "verdict of ", "asked of "
"""Columns that say how long a subsystem was in a state, what became of a requirement, and whether
what stands before its `implies` ever held."""
LIMIT = "limit"
"""How a run ended that took too long; its wall time is the limit."""
_LONGEST_REASON = 300

PACKAGES = "packages"
"""The folder of a bundle with the generated code."""

Figures = dict[str, Any]
"""Column -> value: bool, int, float, text or None."""


@dataclass(frozen=True, slots=True)
class SweepJob:
    """A run of the package `directory`, below the place that this process knows as `place`."""

    place: str
    directory: str
    setting: Mapping[str, str]
    seed: int
    options: Mapping[str, Any]
    limit_s: float


@dataclass(frozen=True, slots=True)
class Bundle:
    """All files that runs read, by their paths; those of the specification are below `base`."""

    files: Mapping[str, bytes]
    base: str


class Closed(Exception):
    """The sweep is over."""


class NoRun(Exception):
    """No run can be made here; the message says why."""


class _Died(Exception):
    """The process of a run ended."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a run: its report and exit code, or the reason why it has none.

    One without a report `ended` as it says, after `wall_s` if that is known.
    """

    report: Mapping[str, Any] | None
    code: int = 1
    reason: str = ""
    ended: str = "failed"
    wall_s: float | None = None

    @property
    def figures(self) -> Figures:
        """The row of the run."""
        if self.report is not None:
            return figures_of(self.report, self.code)
        timed = {} if self.wall_s is None else {"wall_s": self.wall_s}
        return {**failure_row(self.reason), "ended": self.ended, **timed}


def run_job(job: SweepJob) -> Figures:
    """The row of a run. Raises Closed, NoRun."""
    return outcome_of(job).figures


def outcome_of(job: SweepJob) -> Outcome:
    """What came of a run. Raises Closed, NoRun."""
    place = _WORKSPACES.get(job.place, "a worker has no files of the sweep")
    if isinstance(place, str):
        raise NoRun(place)
    request = {
        **job.options,
        "directory": str(place.folder / PACKAGES / job.directory),
        "base": str(place.base),
        "seed": job.seed,
        "built_with": dict(job.setting),
    }
    reason = ""
    for _ in range(TRIES):
        try:
            with place.process() as process:
                return process.outcome(request, job.limit_s)
        except _Died as error:
            reason = str(error)
    return Outcome(None, reason=f"{reason}, {TRIES} times")


def failure_row(reason: str) -> Figures:
    """The row of a run of which nothing else is known."""
    return {"success": False, "ended": "failed", "reason": reason}


class _Process:
    """`specc_runtime.serving`, and what its runs print."""

    def __init__(self, folder: Path) -> None:
        self._scratch = tempfile.mkdtemp(dir=folder)
        self._output = Path(self._scratch, "said")
        path = os.pathsep.join(filter(None, sys.path))
        with self._output.open("ab") as output:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "specc_runtime.serving", self._scratch],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=output,
                env={**os.environ, "PYTHONPATH": path, **dict.fromkeys(THREADS, "1")},
                # Ctrl-C is for the sweep, which ends its processes itself.
                start_new_session=True,
            )

    def outcome(self, job: Mapping[str, Any], limit_s: float) -> Outcome:
        """What came of a run. Raises _Died."""
        os.truncate(self._output, 0)
        assert self._process.stdin and self._process.stdout
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(job).encode() + b"\n")
            self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], limit_s)[0]:
            self.end()
            reason = f"ended after {limit_s:g} s of wall time{self._last_words(': ')}"
            return Outcome(None, reason=reason, ended=LIMIT, wall_s=limit_s)
        line = self._process.stdout.readline()
        if not line.endswith(b"\n"):
            self.end()
            raise _Died(self._exit_text(self._process.returncode))
        answer = json.loads(line)
        if "died" in answer:
            raise _Died(self._exit_text(answer["died"]))
        if answer["report"] is None:
            return Outcome(None, reason=self._last_words() or f"exit code {answer['code']}")
        return Outcome(answer["report"], answer["code"])

    def kill(self) -> None:
        """End it, from whatever thread."""
        self._process.kill()

    def end(self) -> None:
        """End it; nobody reads from it any more."""
        self._process.kill()
        self._process.communicate()

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    def _exit_text(self, code: int) -> str:
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return f"its process ended with {how}{self._last_words(': ')}"

    def _last_words(self, before: str = "") -> str:
        """The last line that it printed."""
        text = self._output.read_text(encoding="utf-8", errors="replace").strip()
        last = text.rpartition("\n")[2].removeprefix("error: ")
        return f"{before}{last[:_LONGEST_REASON]}" if last else ""

    def remove(self) -> None:
        """End it and remove what it wrote."""
        self.end()
        shutil.rmtree(self._scratch, ignore_errors=True)


class Workspace:
    """A folder with copies of what runs read, and the processes that make them.

    There are as many as runs are under way at once; those that wait are used again.
    """

    def __init__(self, folder: Path, bundle: Bundle) -> None:
        """Make the folder anew. Raises OSError."""
        self.folder = folder
        self.base = folder / bundle.base
        shutil.rmtree(folder, ignore_errors=True)
        self.base.mkdir(parents=True)
        for path, content in bundle.files.items():
            (file := folder / path).parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        self._lock = threading.Lock()
        self._all: set[_Process] = set()
        self._idle: list[_Process] = []
        self._closed = False

    @contextlib.contextmanager
    def process(self) -> Iterator[_Process]:
        """A process for a run, kept afterwards if it is still there. Raises Closed."""
        with self._lock:
            if self._closed:
                raise Closed
            process = self._idle.pop() if self._idle else _Process(self.folder)
            self._all.add(process)
        try:
            yield process
        finally:
            with self._lock:
                if process.is_alive and not self._closed:
                    self._idle.append(process)
                else:
                    self._all.discard(process)
                    process.remove()
                if self._closed:
                    raise Closed

    def close(self) -> None:
        """End all processes, with the runs that are under way, and remove the folder."""
        with self._lock:
            self._closed = True
            for process in self._all:
                process.kill()
            for process in self._idle:
                process.remove()
        shutil.rmtree(self.folder, ignore_errors=True)


_WORKSPACES: dict[str, Workspace | str] = {}


def open_workspace(name: str, place: Workspace | str) -> None:
    """Have jobs that name the place find it, or why it is none."""
    _WORKSPACES[name] = place


def close_workspace(name: str) -> None:
    """Close the place and forget it."""
    if isinstance(place := _WORKSPACES.pop(name, None), Workspace):
        place.close()


# The columns of a row.


def figures_of(report: Mapping[str, Any], code: int) -> Figures:
    """The figures of a report: of the run, of its cycles, of its requirements."""
    cycles = report["cycles"]
    stop = report.get("stop_when")
    # Without a cycle or a formula only requirements tell a success; unknown ones do not.
    undecided = [] if code or cycles or stop else _labels_with_verdict(report, "unknown")
    row: Figures = {
        "success": None if undecided else code == 0,
        "ended": report["ended"],
        "reason": _reason(report, code, undecided),
        "simulated_s": report["simulated_s"],
        "cycles": len(cycles),
        "faults": len(report["faults"]),
    }
    if stop:
        row["met_s"] = stop["met_s"]
    for name in dict.fromkeys(name for cycle in cycles for name in cycle):
        row[f"cycle.{name}"] = _combine_cycles([cycle.get(name) for cycle in cycles])
    row |= {f"scene.{name}": value for name, value in report.get("scene", {}).items()}
    for name, subsystem in report["subsystems"].items():
        for state, steps in subsystem["states_visited"].items():
            row[f"{STEPS}{name} in {state}"] = steps
    for requirement in report.get("requirements", ()):
        label = _label(requirement)
        row[f"{VERDICT}{label}"] = requirement["verdict"]
        row[f"margin of {label}"] = requirement["margin"]
        if requirement.get("asked") is not None:
            row[f"{PREMISE}{label}"] = requirement["asked"]
    return row | {"records_sha256": report["records_sha256"], "wall_s": report["wall_s"]}


def _reason(report: Mapping[str, Any], code: int, undecided: Sequence[str]) -> str:
    """Why a run did not succeed; empty if it did."""
    if code == 0:
        return f"undecided: {'; '.join(undecided)}"[:_LONGEST_REASON] if undecided else ""
    for fault in report["faults"]:
        return f"{fault['culprit']}: {fault['message']}"[:_LONGEST_REASON]
    if violated := _labels_with_verdict(report, "violated"):
        broken = {r["contract"] for r in report.get("requirements", ()) if "contract" in r}
        what = "broken contract" if broken.issuperset(violated) else "violated"
        return f"{what}: {'; '.join(violated)}"[:_LONGEST_REASON]
    if (stop := report.get("stop_when")) and stop["met_s"] is None:
        return f"never held: {stop['that']}"[:_LONGEST_REASON]
    endings = [cycle["ended"] for cycle in report["cycles"] if cycle["ended"] != "completed"]
    return endings[0] if endings else "not fulfilled"


def _labels_with_verdict(report: Mapping[str, Any], verdict: str) -> list[str]:
    return [_label(r) for r in report.get("requirements", ()) if r["verdict"] == verdict]


def _label(requirement: Mapping[str, Any]) -> str:
    """What a requirement is called: its name, or its formula."""
    return str(requirement.get("name") or requirement.get("contract") or requirement["that"])


def _combine_cycles(values: Sequence[Any]) -> Any:
    """The value of the only cycle; of several the median of numbers, and whether all are true."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    if all(isinstance(value, bool) for value in known):
        return all(known)
    if all(isinstance(value, int | float) for value in known):
        return median(known)
    texts = [value if isinstance(value, str) else json.dumps(value) for value in known]
    return ", ".join(dict.fromkeys(texts))
