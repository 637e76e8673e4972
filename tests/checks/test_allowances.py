"""Where an allowance is used up and checks are left out, a finding says so."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from specc.limits import (
    ALLOWED,
    OUT_OF_PARTS,
    OUT_OF_STEPS,
    WorkKind,
    is_used_up,
    one_run,
    too_many_steps,
)
from specc.pipeline import Result, check_spec, compile_spec

SYSTEM = """\
specc: 1.2
system: allowances
use: [lib/types.yaml]
interfaces: {Sent: {types: [T], n: T, m: "vector[3]"}}
agents:
  "a{i}":
    for: {i: 1..2}
    real_effectors: {d: {y: {p: int}}}
    virtual_effectors: {d: {use: lib/device.yaml, with: {n: 3 + i}}}
    control:
      rate: 10 Hz
      x: {d: "Sent[int]"}
      memory: {k: {type: Count, init: 0}}
      let: {one: "two + 1", two: "min(k, 7, 8, 9, most)"}
      conditions: {terminal: {low: one < 3}, initial: {few: k < 1, more: k < 2}}
      functions: {read: {k: "x.d.n + one if present(x.d.n) else k"}}
      behaviours: {read: {functions: [read], terminal: low}}
      states: {S0: read, S1: read}
      initial_state: S0
      transitions: [[S0, terminal, few, S0], [S0, terminal, more, S1]]
let: {low: a1.c.k < 100, lower: low and a2.c.k < 10}
require: [{that: always(low or lower), because: more is too much}]
"""
FILES = {
    "main.yaml": SYSTEM,
    "lib/types.yaml": """\
specc: 1.2
types: {Count: int}
constants: {most: 3 + 4, path: "[1, 2, 3]"}
""",
    "lib/device.yaml": """\
specc: 1.2
use: [more.yaml]
parameters: {n: int}
constants: {a: "min(1, 2, 3, 4, 5, 6)", b: "min(1, 2, 3, 4, 5, 6) + a"}
subsystem:
  title: Device
  rate: 100 Hz
  x: {E: {p: int}}
  y: {c: {n: int, m: "vector[3]"}}
  through: {y.c.n: x.E.p + n + a + other, y.c.m: "[b, n, n]"}
""",
    "lib/more.yaml": 'specc: 1.2\nconstants: {other: "min(5, 6, 7)"}\n',
}


@pytest.fixture
def main_file(tmp_path: Path) -> str:
    """The system and the files that it uses, in a folder."""
    (tmp_path / "lib").mkdir()
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return str(tmp_path / "main.yaml")


def told(result: Result) -> str:
    return "\n".join(f"{found.code} {found.message}" for found in result.diagnostics)


def with_parts(
    monkeypatch: pytest.MonkeyPatch, file: str, step: int
) -> Iterator[tuple[int, Result]]:
    """What is found with too few parts: with none, with `step` more, and so on."""
    for allowed in range(0, 100_000, step):
        monkeypatch.setitem(ALLOWED, "parts", allowed)
        with one_run():
            result = check_spec(file)
            if not is_used_up("parts"):
                return
        yield allowed, result


@pytest.mark.parametrize("step", [31, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", FILES)
def test_a_file_of_which_the_rest_is_not_read_is_refused(
    name: str, step: int, main_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is being read when the parts are used up, it is said once, and nothing is built."""
    file = str(Path(main_file).parent / name)
    for allowed, result in with_parts(monkeypatch, file, step):
        assert told(result).count(OUT_OF_PARTS) == 1, (allowed, told(result))
        assert not result.ok


def test_constants_of_a_description_are_read_once(
    main_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two devices use it. A proved fault is not lost because reading took all that it may take."""
    terms = ", ".join(map(str, range(1_000)))
    device = FILES["lib/device.yaml"].replace("{a:", f'{{long: "min({terms})", a:')
    (Path(main_file).parent / "lib/device.yaml").write_text(device)
    monkeypatch.setitem(ALLOWED, "parts", 3_000)
    assert "E0602" in told(check_spec(main_file))
    monkeypatch.setitem(ALLOWED, "parts", 1_500)
    assert told(check_spec(main_file)) == f"E0017 {OUT_OF_PARTS}"


def test_faults_in_definitions_that_only_a_description_uses(main_file: str) -> None:
    (Path(main_file).parent / "lib/more.yaml").write_text("specc: 1.2\nconstants: {other: 1 + x}\n")
    assert "`x`" in told(compile_spec(main_file))


SOUND = SYSTEM.replace(
    "[[S0, terminal, few, S0], [S0, terminal, more, S1]]",
    "[[S0, terminal, few, S1], [S0, terminal, otherwise, S0], [S1, terminal, always, S0]]",
)


@pytest.mark.parametrize(
    ("work", "step", "most"),
    [
        ("folding", 1, 12),
        ("proof", 400, 4_000),
        pytest.param("proof", 90, 10_000, marks=pytest.mark.long),
    ],
)
def test_what_is_not_proved_or_computed_is_said(
    work: WorkKind, step: int, most: int, main_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path(main_file).write_text(SOUND)
    assert compile_spec(main_file).ok
    words = {"folding": too_many_steps, "proof": lambda _: OUT_OF_STEPS}[work]
    count = 0
    for allowed in range(0, most, step):
        monkeypatch.setitem(ALLOWED, work, allowed)
        with one_run():
            found = told(check_spec(main_file))
            assert (words(work) in found) == is_used_up(work), (allowed, found)
            count += is_used_up(work)
    assert count
