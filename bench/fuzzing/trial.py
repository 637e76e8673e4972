"""One file through the whole compiler, and how that ended."""

from __future__ import annotations

import os
import resource
import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from types import FrameType

from specc import pipeline
from specc.diagnostics import formats, text
from specc.diagnostics.report import report, resolve

HANGING_S = 300
"""Wall time after which a file is given up."""
MEMORY_BYTES = 1 << 30
"""Address space of the process; a file that needs more fails with MemoryError."""


class HangingError(Exception):
    """A file takes longer than anybody would wait."""


@dataclass(frozen=True, slots=True)
class Trial:
    """How a file fared: accepted, refused, or what went wrong in `fault`."""

    accepted: bool
    codes: frozenset[str]
    seconds: float
    fault: str = ""


def confined() -> None:
    """Limit the memory of this process from now on."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, resource.RLIM_INFINITY))


def tried(path: Path) -> Trial:
    """Build the file and print what was found in it, in two formats."""
    begin = process_time()
    try:
        with _patience():
            built = pipeline.build(str(path))
            found = report(resolve(built.result.diagnostics, built.result.sources), [str(path)])
            text.render(found)
            formats.as_json(found)
    except Exception:  # noqa: BLE001 - whatever it is, it is what is searched for
        return Trial(False, frozenset(), process_time() - begin, traceback.format_exc())
    seconds = process_time() - begin
    codes = frozenset(finding.diagnostic.code for finding in found.findings)
    fault = "" if built.result.ok or codes else "refused without a finding"
    return Trial(built.result.ok, codes, seconds, fault)


def guarded(run: Callable[[], object]) -> Trial:
    """How something fares that must not raise."""
    begin = process_time()
    try:
        with _patience():
            run()
    except Exception:  # noqa: BLE001 - whatever it is, it is what is searched for
        return Trial(False, frozenset(), process_time() - begin, traceback.format_exc())
    return Trial(True, frozenset(), process_time() - begin)


@contextmanager
def _patience() -> Iterator[None]:
    def give_up(_signal: int, _frame: FrameType | None) -> None:
        raise HangingError

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(HANGING_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def beds(specs: Path, scratch: Path) -> list[Path]:
    """A folder for every specification below a folder, with all that it may refer to.

    The specification itself is in the folder as `spec.yaml`; the rest are links.
    """
    scratch.mkdir(parents=True, exist_ok=True)
    allowed = os.path.relpath(specs, scratch)
    (scratch / "pyproject.toml").write_text(f"[tool.specc]\nallow = [{allowed!r}]\n")
    found = []
    for number, spec in enumerate(sorted(specs.rglob("*.yaml"))):
        folder = scratch / f"{number}_{spec.stem}"
        folder.mkdir(parents=True)
        for other in sorted(spec.parent.iterdir()):
            if other.is_dir():
                os.symlink(other.resolve(), folder / other.name)
        (folder / "spec.yaml").write_bytes(spec.read_bytes())
        found.append(folder)
    return found
