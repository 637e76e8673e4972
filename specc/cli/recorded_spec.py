"""The specification in a recording, as code: for a run that goes on from it with another one."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from specc import output
from specc.cli import streams
from specc.cli.recordings import call_runtime, recorded_constants
from specc.diagnostics import blocks
from specc.diagnostics.phrases import join_some
from specc.resources import is_library_part
from specc.source import COMMAND_LINE, Sources, beside, real_path, relative_path

if TYPE_CHECKING:
    from specc.lower.code import PythonObject
    from specc.pipeline import Build

_TOLD = 3
"""Of what is wrong with a recorded specification."""


def recorded_texts(sources: Sources) -> dict[str, str]:
    """The files of a specification, as a recording has them.

    They are named as they are found from here; if some are elsewhere, from the folder of them all.
    """
    texts = {
        s.path if is_library_part(s.path) else os.path.abspath(s.path): s.text
        for s in sources
        if s.path not in COMMAND_LINE
    }
    own = [path for path in texts if not is_library_part(path)]
    here = os.path.join(os.getcwd(), "")
    are_here = all(path.startswith(here) for path in own)
    root = here if are_here else os.path.commonpath(map(os.path.dirname, own))
    return {_shown(relative_path(path, root)): text for path, text in texts.items()}


def _shown(name: str) -> str:
    """A name that a recording can hold: bytes of it that are no UTF-8 are written out."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def resumed_constants(options: Namespace) -> dict[str, str]:
    """What a run sets that goes on: what was set for the recorded one, unless `--set` says more.

    Names that the specification does not have are told and left out. Raises Refused.
    """
    from specc import pipeline

    told, _ = call_runtime("recording.messages", "recorded", Path(options.resume[0]))
    recorded = {n: text for n, text in recorded_constants(told).items() if n not in options.set}
    if not recorded:
        return dict(options.set)
    read = pipeline.read_spec(options.spec)
    gone = [name for name in recorded if read.system is not None and name not in read.units]
    if gone:
        words = f"{options.spec} has no {join_some(gone, _TOLD)}, which the recorded run has set"
        streams.print_message(f"specc: --from: {words}")
    return {n: text for n, text in recorded.items() if n not in gone} | dict(options.set)


def recorded_package(options: Namespace, built: Build, scratch: Path) -> Path | None:
    """Code of what was recorded, if that is not what was `built`; None where it cannot be run.

    A file decides nothing about which code runs: the specification in it may name no Python that
    the one at hand does not name, as the same part, by the same name, with the same signature.
    Raises Refused for a file that cannot be used.
    """
    told, texts = call_runtime("recording.messages", "recorded", Path(options.resume[0]))
    values, own = recorded_constants(told), recorded_texts(built.result.sources)
    if [*texts.values()] == [*own.values()] and values == dict(options.set):
        return None
    package, why = _package(options.spec, values, texts, built, scratch)
    if package is None:
        streams.print_message(f"specc: --from: the recorded specification cannot be run: {why}")
    return package


def _package(
    spec: str, values: Mapping[str, str], texts: Mapping[str, str], built: Build, scratch: Path
) -> tuple[Path | None, str]:
    """Where the code of the recorded texts is; None, and why, where there is none."""
    from specc import pipeline
    from specc.lower.code import named_code

    result = pipeline.compile_spec(spec, values, texts_by_path(texts, spec))
    if not result.ok or result.system is None or built.result.system is None:
        errors = [d.message for d in result.diagnostics if blocks(d.code, "build")]
        return None, "it has errors: " + "; ".join(errors[:_TOLD])
    known = named_code(built.result.system)
    if foreign := named_code(result.system) - known:
        return None, f"it names {_listed(foreign, known)}; {spec} does not"
    then = pipeline.generated(result, spec, is_read=False)
    if not then.files:
        return None, then.result.diagnostics[-1].message
    package = scratch / then.system
    for diagnostic in output.write(package, then.files):
        return None, diagnostic.message
    return package, ""


def _listed(foreign: Iterable[PythonObject], known: Collection[PythonObject]) -> str:
    """What is named, first what is not known at all."""
    modules, alike = {each.python for each in known}, {str(each) for each in known}
    words = [
        f"{each} with another type of that name" if str(each) in alike else str(each)
        for each in sorted(foreign, key=lambda n: (n.python in modules, str(n)))
    ]
    return join_some(words, _TOLD, "; ")


def texts_by_path(texts: Mapping[str, str], spec: str) -> dict[str, str]:
    """The recorded texts by where they would be, if the first one were that of `spec`."""
    first = os.path.dirname(next(iter(texts), ""))
    placed = {
        real_path(beside(spec, relative_path(name, first or "."))): text
        for name, text in list(texts.items())[1:]
    }
    return placed | {real_path(spec): text for text in list(texts.values())[:1]}
