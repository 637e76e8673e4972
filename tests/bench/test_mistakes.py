"""The mistakes of bench/mistakes.py can be made in the specifications as they are shipped."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

from bench.mistakes import ROOT, mistakes


def test_every_mistake_can_be_made(tmp_path: Path) -> None:
    every = mistakes()
    assert Counter(mistake.kind for mistake in every) == dict.fromkeys(
        ("units", "resets", "order", "rows"), 20
    )
    for mistake in every:
        path = tmp_path / mistake.file
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / mistake.file, path)
        before = path.read_text(encoding="utf-8")
        mistake.make(tmp_path)
        assert path.read_text(encoding="utf-8") != before
        assert (ROOT / mistake.system).exists()
