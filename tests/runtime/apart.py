"""A system of which one subsystem computes in a process of its own."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

from specc_runtime.cycle import Executor
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.processes.worker import Processes
from specc_runtime.records import RecordDigest, StepRecord

from specc import output, pipeline
from tests.runtime.misdeeds import MISDEED

SPEC = """\
specc: 1
system: apart
types:
  Blob:
    opaque: true
    python: "tests.runtime.misdeeds:Blob"
    codec: {encode: "tests.runtime.misdeeds:encode", decode: "tests.runtime.misdeeds:decode"}
  Pair: {fields: {blob: Blob, name: text}}
operators:
  ACT: {signature: "(n: int) -> int", python: "tests.runtime.misdeeds:act"}
  BLOB: {signature: "(n: int) -> Blob", python: "tests.runtime.misdeeds:blob"}
  WIDE: {signature: "(n: int) -> vector[1000]", python: "tests.runtime.misdeeds:wide"}
  SIZE: {signature: "(b: Blob, v: vector[1000]) -> int", python: "tests.runtime.misdeeds:size"}
  LISTED: {signature: "(n: int, b: Blob) -> list[Blob]", python: "tests.runtime.misdeeds:listed"}
agents:
  near:
    control:
      rate: 50 Hz
      x: {far: {n: int, wide: "vector[1000]", blob: Blob, all: "list[Blob]"}}
      y: {far: {n: int, blob: Blob}}
      memory: {n: {type: int, init: 0}}
      let:
        came: present(x.far.blob) and present(x.far.wide)
        more: "SIZE(x.far.blob, x.far.wide) if came else 0"
      functions:
        count: {n: n + 1 + more, y.far.n: n}
        seldom: {y.far.blob: BLOB(n)}
      behaviours:
        count: {functions: [count], terminal: always}
        tell: {functions: [count, seldom], terminal: always}
      states: {S0: count, S1: tell}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
  far:
    control:
      rate: 10 Hz
      x: {near: {n: int, blob: Blob}}
      y: {near: {n: int, wide: "vector[1000]", blob: Blob, all: "list[Blob]"}}
      memory:
        kept: {type: Blob, init: BLOB(0)}
        last: {type: int, init: 0}
        since: {type: "real[s]", init: 0}
      conditions: {terminal: {slept: "elapsed > 0.15[s]"}}
      functions:
        work:
          last: "x.near.n if present(x.near.n) else -1"
          since: elapsed
          y.near.n: ACT(last)
          y.near.wide: WIDE(last)
        keep:
          kept: "x.near.blob if present(x.near.blob) else kept"
          y.near.blob: kept
          y.near.all: LISTED(last, kept)
      behaviours:
        work: {functions: [work], terminal: slept}
        keep: {functions: [work, keep], terminal: slept}
      states: {A: work, B: keep}
      initial_state: A
      transitions: [[A, terminal, always, B], [B, terminal, always, A]]
require:
  - {that: "always(far.c.last >= -1)", because: memory of another process is known}
"""
FAR = "far.c"


def built(folder: Path, text: str = SPEC) -> Path:
    """The generated package."""
    spec = folder / "apart.yaml"
    spec.write_text(text)
    made = pipeline.build(str(spec), is_read=False)
    assert made.files, made.result.diagnostics
    package = folder / "generated" / made.system
    assert not [*output.write(package, made.files)]
    return package


class Run:
    """A run of a generated system, some of it `apart`, up to a tick; `faults` as data."""

    def __init__(self, package: Path, *apart: str, **more: Any) -> None:
        self.options = Options(package, package.parent.parent, apart=apart, **more)
        self.system = load_system(package, self.options.base)
        self.processes = Processes()
        self.processes.begin(self.system, self.options)
        self.records: list[StepRecord] = []
        self.digest = RecordDigest()

    def __enter__(self) -> Run:
        self.processes.wait()
        self.executor = Executor(
            self.system, None, (self.records.append, self.digest), processes=self.processes
        )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.executor.close()

    def to(self, tick: int) -> Run:
        while self.executor.tick < tick and self.executor.advance():
            pass
        return self

    @property
    def faults(self) -> list[dict[str, Any]]:
        return [fault.as_data() for fault in self.executor.faults]


@contextmanager
def misdeed(name: str) -> Iterator[None]:
    """Have the operator do that, here and in processes that begin meanwhile."""
    before = os.environ.get(MISDEED, "")
    os.environ[MISDEED] = name
    try:
        yield
    finally:
        os.environ[MISDEED] = before


def children() -> set[int]:
    """The processes that this one has begun, zombies included."""
    found: set[int] = set()
    for task in Path("/proc/self/task").glob("*/children"):
        with suppress(FileNotFoundError):  # a thread that has just ended
            found |= set(map(int, task.read_text().split()))
    return found
