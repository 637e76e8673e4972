"""Slips of designers are reported at their line, where the specification itself has no finding."""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from specc.pipeline import compile_spec
from specc.source import real_path
from tests.corpus import ROOT
from tests.memory import settle

TABLE = YAML(typ="safe").load(Path(__file__).with_name("mistakes.yaml"))
MISTAKES = [(spec, *each) for spec, several in TABLE.items() for each in several]
Mistake = tuple[str, str, str, str]
SHORT = [m for m in MISTAKES if m[0].endswith("conveyor_gate.yaml")]


def missed(mistake: Mistake) -> str:
    """What is found instead of a slip; empty if it is found at its line."""
    spec, _, old, new = mistake
    path = str(ROOT / "specs" / spec)
    text = Path(path).read_text(encoding="utf-8")
    assert old in text, mistake
    same = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(old, new, strict=False)))
    line = text.count("\n", 0, text.index(old) + same) + 1
    settle()
    result = compile_spec(path, texts={real_path(path): text.replace(old, new, 1)})
    lines = {d.message: result.sources.span(d.primary).line for d in result.diagnostics}
    return "" if line in lines.values() else f"{spec}:{line}: `{new}`: {lines}"


def test_slips_in_small_specifications_are_found() -> None:
    assert len(SHORT) > 10
    assert list(filter(None, map(missed, SHORT))) == []


@pytest.mark.long
@pytest.mark.parametrize("spec", sorted(TABLE))
def test_slips_are_found(spec: str) -> None:
    """All but a formula about constants alone, which may be meant."""
    found = [missed(mistake) for mistake in MISTAKES if mistake[0] == spec]
    assert [text for text in found if text and "`always(glass < glass" not in text] == []
