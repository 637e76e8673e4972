"""What checking costs grows with each list of a specification like the list, or is refused.

Calls are counted and not seconds, so that every machine agrees; `bench/growth.py` has the times.
"""

import io
import re
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from cProfile import Profile
from importlib import import_module
from pathlib import Path

import pytest

from bench.harness.hostile import HOSTILE, rows
from bench.harness.lists import COMPONENTS, DOUBLED, GROWING, MAIN, put, small, written
from specc import checks
from specc.cli.main import main
from specc.limits import ALLOWED, one_run
from specc.model.expr import MemoryRef
from specc.model.types import Bool
from specc.proof import decide, ticks
from tests.seeds import SOAK, short

SIZES = (20, 40, 80)
FEW = 2500
"""Calls that are few whatever they are for."""
# What is left goes up to an allowance, or to the most keys of a mapping.
SQUARES: dict[str, str] = {
    "assumptions": "each is tried for whether a proof needs it; the proofs have an allowance",
    "initial conditions of one state": "each answer to each question; tables have an allowance",
    "enum members, with a row for each": "each answer to each question, as above",
    "faulty: rows that overlap": "pairs of rows; tables have an allowance",
    "terms of a condition": "each answer to each question, as above",
    **dict.fromkeys(
        (
            "quantifiers over one list, and its length",
            "quantifiers in quantifiers over two lists",
        ),
        "each quantifier is said of as many items as there are; a question has an allowance",
    ),
    **dict.fromkeys(
        (
            "ignore comments of unknown codes",
            "watched memory of the task",
            "faulty: unknown names",
            "faulty: slips of one name",
            "faulty: unknown elements",
            "faulty: unknown types",
            "faulty: unknown states",
            "faulty: unknown conditions",
        ),
        "each unknown name is compared with each known one; comparing has an allowance",
    ),
}


def calls(folder: Path, name: str, size: int) -> int:
    """Functions that are called to validate the list at a size."""
    put(GROWING[name](size), folder)
    profiler = Profile()
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        code = profiler.runcall(main, ["validate", str(folder / MAIN)])
    assert code in (0, 1, 2)
    return sum(entry.callcount for entry in profiler.getstats())


LINES = [name for name in GROWING if name not in SQUARES]


@pytest.mark.parametrize("name", short(LINES, *range(3, len(LINES), 48), in_ci=2))
def test_calls_grow_with_the_list(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    calls(tmp_path, name, 3)  # imports what it takes
    few, more, many = (calls(tmp_path, name, size) for size in SIZES)
    assert many - more < 2.4 * max(more - few, FEW), (few, more, many)


def test_a_number_in_a_file_is_no_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    _, few, many = (calls(tmp_path, COMPONENTS, size) for size in (3, 100, 20_000))
    assert many < few + FEW


def doubled() -> Iterator[object]:
    """One use of each kind of value; all of them are long."""
    uses = list(dict.fromkeys(name.partition(", ")[2] for name in DOUBLED))
    kinds = list(dict.fromkeys(name.partition(", ")[0] for name in DOUBLED))
    for name in DOUBLED:
        kind, _, use = name.partition(", ")
        number = kinds.index(kind)
        is_chosen = number % 3 == 1 and uses[(number + 1) % len(uses)] == use
        is_soak = (number + uses.index(use)) % 2
        yield pytest.param(name, marks=() if is_chosen else SOAK if is_soak else pytest.mark.long)


@pytest.mark.parametrize("name", list(doubled()))
def test_lets_that_double_are_looked_into_once(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """2^26 steps would not end in time. What would multiply in a period is refused."""
    monkeypatch.chdir(tmp_path)
    put(DOUBLED[name](26), tmp_path)
    assert main(["build", MAIN, "--out", "gen"]) in (0, 1), capsys.readouterr()


DEEP = {
    "not": "not (b)",
    "and, or": "(b and True) or False",
    "choice": "b if x.c.go > 1 else x.c.go > 2",
    "choice of numbers": "n if x.c.go > 1 else 4",
    "test of numbers": "3 if n > x.c.go else 4",
}


SOUND, OVERLAP = ["c", "other"], ["c", "always"]


@pytest.mark.parametrize(
    ("value", "rows"),
    [
        pytest.param(value, rows, marks=pytest.mark.long if is_long else ())
        for value in DEEP.values()
        for rows, is_long in ((SOUND, value != DEEP["not"]), (OVERLAP, value != DEEP["not"]))
    ],
)
def test_chains_of_deep_lets_are_followed(
    value: str, rows: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each text is within its limits; all of them written out are nested over 1200 deep."""
    form = re.sub(r"\b[bn]\b", "{}", value)
    name, last = ("b", "l49") if "b" in value else ("n", "l49 > 3")
    spec, lets = small(), {"l0": "x.c.go > 0" if name == "b" else "x.c.go"}
    for i in range(1, 50):
        text = f"l{i - 1}"
        for _ in range(25):
            text = f"({form.format(text)})"
        lets[f"l{i}"] = text
    effector = spec["agents"]["a"]["virtual_effectors"]["m"]
    effector["let"] = lets
    effector["conditions"]["initial"] = {"c": last, "other": f"not ({last})"}
    effector["behaviours"]["pass"]["terminal"] = "always"
    effector["transitions"] = [["S0", "terminal", row, "S0"] for row in rows]
    put({MAIN: written(spec)}, tmp_path)
    found = main(["validate", str(tmp_path / MAIN)])
    said = capsys.readouterr().err
    assert found == (1 if "always" in rows else 0), said
    assert ("E0602" in said) == ("always" in rows)


@pytest.mark.parametrize(
    ("name", "code", "words"),
    short(
        [
            ("quantifiers", "E0334", "takes more than 500,000 steps"),
            ("constants that triple", "E0334", "too large"),
            ("1 MB of formulas", "E0017", "more than 60,000 parts"),
            ("interfaces", "E0237", "more than 60,000 parts"),
            ("definitions used often", "E0017", "more than 60,000 parts"),
            ("files used often", "E0017", "more than 60,000 parts"),
            ("more rows of 50 terms", "E0017", "more than 60,000 parts"),
        ],
        *(0, 1),
    ),
)
def test_what_multiplies_is_refused_once(
    name: str,
    code: str,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Counted before it is made, against one budget of the command; what follows is not told."""
    monkeypatch.chdir(tmp_path)
    put(HOSTILE[name](), tmp_path)
    assert main(["build", MAIN, "--out", "gen"]) == 1
    told = capsys.readouterr().err
    assert told.count(words) == 1
    assert f"error[{code}]" in told


def test_the_rest_of_what_is_refused_is_neither_read_nor_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    read: list[str] = []
    parse = import_module("specc.lang.parse")  # the package has a function of this name
    parsed = parse._parse_uncached
    monkeypatch.setattr(parse, "_parse_uncached", lambda text: (read.append(text), parsed(text))[1])
    monkeypatch.setattr(checks, "CHECKS", (lambda _: pytest.fail("it was checked"),))
    put(rows(60), tmp_path)
    monkeypatch.setitem(ALLOWED, "parts", 10_000)  # of which a row takes 300
    assert main(["validate", MAIN]) == 1
    assert sum("x.c.e49" in text for text in read) < 40


def test_questions_about_ticks_end_with_their_allowance(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not known is possible; nothing is looked at to find that out."""
    monkeypatch.setitem(ALLOWED, "proof", 300)
    asked: list[object] = []
    monkeypatch.setattr(
        ticks,
        "is_satisfiable",
        lambda parts: (asked.append(parts), decide.is_satisfiable(parts))[1],
    )
    named = [MemoryRef(f"b{i}", type=Bool()) for i in range(100)]
    with one_run():
        known = ticks.Ticks({})
        assert all(known.is_possible(known.formula_at(each)) for each in named)
    assert 0 < len(asked) < 10
