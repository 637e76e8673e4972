"""Files that no person would write: findings, never a traceback, a hang or a flood of memory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from bench.fuzz import ROOT, made
from bench.fuzzing.edits import edited
from bench.fuzzing.others import tried_elsewhere
from bench.fuzzing.texts import random_bytes, random_tree, random_words
from bench.fuzzing.trial import Trial, beds, guarded, tried
from bench.seeding.sheet import Sheet
from specc import pipeline
from tests.seeds import SOAK


@pytest.mark.parametrize(
    ("seed", "files"),
    [
        (1, 2),
        pytest.param(1, 100, marks=pytest.mark.long),
        pytest.param(2, 200, marks=pytest.mark.long),
        pytest.param(2, 600, marks=SOAK),
    ],
)
def test_files_are_accepted_or_refused_within_limits(seed: int, files: int, tmp_path: Path) -> None:
    script = ROOT / "bench/fuzz.py"
    paths = os.pathsep.join((str(ROOT), str(ROOT / "runtime")))
    options = ["--seed", str(seed), "--keep", str(tmp_path), "--limit", "30"]
    done = subprocess.run(
        [sys.executable, str(script), str(files), *options],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"{files} files, seed {seed}:")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("count", [8, pytest.param(30, marks=pytest.mark.long)])
def test_the_same_seed_gives_the_same_files(count: int, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    original = (ROOT / "specs/conveyor_gate.yaml").read_bytes()

    def files(seed: int) -> list[bytes]:
        random = Random(seed)
        return [made(spec, original, random) for _ in range(count)]

    assert files(3) == files(3) != files(4)


def test_changes_know_the_structure(tmp_path: Path) -> None:
    """Most changed specifications are still YAML with the keys of the language."""
    random, spec = Random(5), ROOT / "specs/conveyor_gate.yaml"
    sheet, readable = Sheet.read(spec), 0
    path = tmp_path / "spec.yaml"
    for _ in range(60):
        path.write_bytes(edited(sheet, random).encode("utf-8", "surrogatepass"))
        try:
            readable += "agents" in Sheet.read(path).data
        except ValueError:  # no longer YAML
            continue
    assert readable > 30


@pytest.mark.parametrize("make", [random_bytes, random_words, random_tree])
def test_texts_from_nothing_are_refused_with_a_reason(make: object, tmp_path: Path) -> None:
    assert callable(make)
    path, random = tmp_path / "a.yaml", Random(6)
    for _ in range(40):
        path.write_bytes(make(random))
        trial = tried(path)
        assert trial.fault == ""
        assert not trial.accepted and trial.codes


def test_what_goes_wrong_is_a_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_path: str) -> None:
        raise RecursionError("deep")

    monkeypatch.setattr(pipeline, "build", fail)
    assert "RecursionError: deep" in tried(tmp_path / "a.yaml").fault


def test_a_specification_is_tried_as_it_is(tmp_path: Path) -> None:
    folders = {folder.name.partition("_")[2]: folder for folder in beds(ROOT / "specs", tmp_path)}
    trial: Trial = tried(folders["conveyor_gate"] / "spec.yaml")
    assert (trial.accepted, trial.codes, trial.fault) == (True, frozenset(), "")


@pytest.mark.parametrize("files", [4, pytest.param(25, marks=pytest.mark.long)])
def test_files_go_through_what_else_reads_them(files: int, tmp_path: Path) -> None:
    folder = next(f for f in beds(ROOT / "specs", tmp_path) if "conveyor" in f.name)
    spec, path, random = folder / "spec.yaml", folder / "fuzzed.yaml", Random(8)
    original = spec.read_bytes()
    for _ in range(files):
        path.write_bytes(made(spec, original, random))
        assert tried_elsewhere(path, spec, random).fault == ""


def test_what_goes_wrong_elsewhere_is_a_fault() -> None:
    def fail() -> None:
        raise KeyError("nobody")

    assert "KeyError: 'nobody'" in guarded(fail).fault
