"""Running generated code in this process, without importing the runtime before it is needed."""

from __future__ import annotations

import os
import traceback
from argparse import Namespace
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc.checks.bindings import without_plant
from specc.diagnostics import Diagnostic
from specc.source import Place

if TYPE_CHECKING:
    from specc.pipeline import Result


# What a run needs that a specification can otherwise do without: a plant, and a task to count.


def missing(result: Result, path: str, *, counts: bool) -> Iterator[Diagnostic]:
    """O0501 without a plant behind devices, O0503 where cycles are to be counted without a task."""
    system, place = result.system, Place(path, ("system",), "key")
    if system is None:
        return
    if system.plant is None:
        yield from without_plant(system, place)
    if counts and system.task is None:
        yield Diagnostic(
            "O0503",
            "nothing says what a run counts: there is no task",
            place,
            help="add `task:` with the transition that ends a cycle, or say `--duration`",
        )


# Running generated code in this process, without importing the runtime before it is needed.


def launch(directory: Path, found: Namespace) -> int:
    """Exit code of a run of the code in `directory`; `found` is what was asked on the command line.

    Raises:
        SystemExit: the runtime ended the process by itself.
    """
    options = import_module("specc_runtime.options").chosen(
        found,
        directory=directory,
        base=Path(os.path.dirname(found.spec)),
        built_with=found.set,
    )
    try:
        return int(import_module("specc_runtime.main").run(options) or 0)
    except Exception:  # noqa: BLE001 - operators are the user's own: their traceback mends them
        traceback.print_exc()
        return 1
