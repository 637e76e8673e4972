"""Files are finished, of a size to read, and speak of no particular machine."""

import re
import tokenize
from functools import cache
from io import StringIO
from itertools import islice
from pathlib import Path

import pytest

from tests.house.tree import ROOT, text_of, tracked_files

MACHINE_PATH = re.compile(r"(?<![\w.$}])/(?:work|farm|root|home|opt|tmp)/")
UNFINISHED = re.compile(r"\b(?:TO[D]O|FIX[M]E|X{3}|HA[C]K)\b")
CONFLICT = re.compile(r"^(?:<{7}|>{7}) ", re.MULTILINE)
RELATIVE_PATH = re.compile(r"(?<![\w./])(?:\.\./)+[\w-][\w./-]*")
SWITCHED_OFF = re.compile(r"#\s*(?:no[q]a|type:\s*ignor[e])")
REASONED = re.compile(
    r"#\s*(?:no[q]a: [A-Z]+\d+(?:, ?[A-Z]+\d+)*|type: ignor[e]\[[\w, -]+\])(?:  |\s*[#:(—-])\s*\w"
)

LONGEST_MODULE = 600
LARGEST_FILE_KB = 1500


@cache
def texts() -> dict[Path, str]:
    """The tracked files that are texts, by their paths in the tree."""
    return {path.relative_to(ROOT): text for path in tracked_files() if (text := text_of(path))}


def of_python() -> dict[Path, str]:
    return {name: text for name, text in texts().items() if name.suffix == ".py"}


def places(pattern: re.Pattern[str], within: dict[Path, str]) -> list[str]:
    """`file:line: match` of every match of the pattern."""
    return [
        f"{name}:{text.count(chr(10), 0, match.start()) + 1}: {match.group()}"
        for name, text in within.items()
        for match in pattern.finditer(text)
    ]


@pytest.mark.parametrize("pattern", [MACHINE_PATH, UNFINISHED, CONFLICT], ids=lambda p: p.pattern)
def test_no_text_has(pattern: re.Pattern[str]) -> None:
    assert places(pattern, texts()) == []


def test_relative_paths_stay_inside_the_project() -> None:
    leaving = [
        f"{name}: {match.group()}"
        for name, text in texts().items()
        for match in RELATIVE_PATH.finditer(text)
        if not (ROOT / name.parent / match.group()).resolve().is_relative_to(ROOT)
    ]
    assert leaving == []


def test_checks_are_switched_off_only_with_a_code_and_a_reason() -> None:
    bare = [
        f"{name}:{number}: {line.strip()}"
        for name, text in of_python().items()
        for number, line in enumerate(text.splitlines(), start=1)
        if SWITCHED_OFF.search(line) and not REASONED.search(line)
    ]
    assert bare == []


def test_every_module_says_what_it_is() -> None:
    assert [str(name) for name, text in of_python().items() if not begins_with_a_text(text)] == []


def begins_with_a_text(module: str) -> bool:
    """Whether the first statement is a string of one token, which is the docstring."""
    before = tokenize.COMMENT, tokenize.NL
    tokens = (t.type for t in tokenize.generate_tokens(StringIO(module).readline))
    return any(
        kind == tokenize.STRING and next(tokens) == tokenize.NEWLINE
        for kind in islice((kind for kind in tokens if kind not in before), 1)
    )


def test_modules_are_short() -> None:
    long = {
        str(name): lines
        for name, text in of_python().items()
        if name.parts[0] in {"specc", "runtime"}
        and (lines := len(text.splitlines())) > LONGEST_MODULE
    }
    assert long == {}


def test_no_file_is_large() -> None:
    sizes = {path.relative_to(ROOT): path.stat().st_size // 1024 for path in tracked_files()}
    assert {str(name): size for name, size in sizes.items() if size > LARGEST_FILE_KB} == {}
