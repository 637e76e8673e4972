"""Recordings that tests made are replayed, each with the specification inside of it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

from specc_runtime.recording.messages import Shelved, recorded, steps_of
from specc_runtime.recording.replay import replay

from specc import output, pipeline
from specc.cli.recordings import texts_by_path
from tests.commands import ROOT, modules_of
from tests.seeds import COUNT

UNTIL_S = 5.0 if COUNT else 2.0
"""Of simulated time; longer runs are compared as far as that, farther in a campaign."""
_SCRATCH = TemporaryDirectory(prefix="specc-replayed-")
LEFT_OUT = "an image, without --record-exact", "a value of "
"""What a recording need not have that is not exact."""


def differences(file: Path, folder: Path, until_s: float = UNTIL_S) -> list[str]:
    """Why a recording, of a run in this folder or in the repository, is not what its replay is."""
    told, texts = recorded(file)
    name = next(iter(texts), "")
    places = (ROOT / name, *sorted(folder.rglob(Path(name).name)))
    spec = next((place for place in places if place.is_file()), folder / name)
    begin_s = next((time_s for _, time_s, _ in steps_of(file, Shelved())), 0.0)
    with modules_of(spec.parent):
        package = _built(str(spec), told["set"], tuple(texts.items()))
        outcomes, _ = replay(package, spec.parent, file, until_s=begin_s + until_s)
    is_exact = told["exact"] == "true"
    found = [str(outcome.difference) for outcome in outcomes if outcome.difference]
    for outcome in outcomes:
        missing = [outcome.unknown, *outcome.left_out]
        found += [f"{outcome.subsystem}: {why}" for why in missing if is_exact and why]
        if outcome.unknown and not any(why in outcome.unknown for why in LEFT_OUT):
            found.append(f"{outcome.subsystem}: {outcome.unknown}")
    return found


@cache
def _built(spec: str, settings: str, texts: tuple[tuple[str, str], ...]) -> Path:
    """The code of a recorded specification."""
    built = pipeline.build(
        spec, json.loads(settings), texts_by_path(dict(texts), spec), is_read=False
    )
    assert built.files, built.result.diagnostics
    package = Path(mkdtemp(dir=_SCRATCH.name), built.system)
    assert not [*output.write(package, built.files)]
    return package
