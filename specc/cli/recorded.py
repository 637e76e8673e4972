"""The specification in a recording, as code: for a run that goes on from it with another one."""

from __future__ import annotations

import ast
import os
import re
from argparse import Namespace
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from specc import output
from specc.cli import streams
from specc.cli.recordings import called, values_of
from specc.source import Sources, real_path

if TYPE_CHECKING:
    from specc.pipeline import Build

_OURS = re.compile(
    r"specc_runtime(:forms|\.(builtins|contracts|plants\.binding|requirements|safety|subsystem"
    r"|system|temporal|values):\w+)\Z|(__future__|collections\.abc|dataclasses|enum|math|typing):\w+\Z|os\.path:join\Z|numpy:\Z"
)
"""What generated code imports by itself."""
_NAMED = re.compile(r"[\w.]+:\w+\Z")


def texts_of(sources: Sources, spec: str) -> dict[str, str]:
    """The files of a specification as a recording has them."""
    return {_named(s.path, spec): s.text for s in sources}


def _named(path: str, spec: str) -> str:
    """How a recording names a file: as it is found from here, or from the specification."""
    if not os.path.isabs(path):
        return path
    inside = os.path.relpath(path)
    is_below = inside.split(os.sep)[0] != os.pardir
    return inside if is_below else os.path.relpath(path, os.path.dirname(spec))


def recorded_package(options: Namespace, built: Build, scratch: Path) -> Path | None:
    """Code of what was recorded, if that is not what was `built`; None where it cannot be run.

    A file decides nothing about which code runs: what is recorded may name no Python that the
    specification at hand does not name. Raises Refused for a file that cannot be used.
    """
    from specc import pipeline

    told, texts = called("recording.messages", "recorded", Path(options.resume[0]))
    values, own = values_of(told), texts_of(built.result.sources, options.spec)
    if [*texts.values()] == [*own.values()] and values == dict(options.set):
        return None
    then = pipeline.build(options.spec, values, placed(texts, options.spec))
    foreign = sorted(set(_named_code(then.files)) - set(_named_code(built.files)))
    if not then.files:
        why = "it has errors: " + "; ".join(d.message for d in then.result.diagnostics)
    elif foreign:
        why = f"it names {', '.join(foreign)}, which {options.spec} does not"
    else:
        package = scratch / then.system
        for diagnostic in output.write(package, then.files):
            why = diagnostic.message
            break
        else:
            return package
    streams.say(f"specc: --from: the recorded specification cannot be run: {why}")
    return None


def placed(texts: Mapping[str, str], spec: str) -> dict[str, str]:
    """The recorded texts by where they would be, if the first one were that of `spec`."""
    first = os.path.dirname(next(iter(texts), ""))
    here = os.path.dirname(spec)
    placed = {
        real_path(os.path.join(here, os.path.relpath(name, first or "."))): text
        for name, text in list(texts.items())[1:]
    }
    return placed | {real_path(spec): text for text in list(texts.values())[:1]}


def _named_code(files: Mapping[str, str]) -> Iterator[str]:
    """What generated code takes from modules that are not our own: `module:name`."""
    for text in files.values():
        for node in ast.walk(ast.parse(text)):
            found: list[str] = []
            if isinstance(node, ast.ImportFrom) and not node.level:
                found = [f"{node.module}:{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                found = [f"{alias.name}:" for alias in node.names]
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found = [node.value] if _NAMED.match(node.value) else []
            yield from (name for name in found if not _OURS.match(name))
