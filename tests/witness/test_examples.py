"""Examples of findings: their values, evaluated, give no row or the rows that the finding names."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from bench.seeding.fault import Seed
from bench.seeding.score import Bed
from specc.analysis import Facts, RowVerdictAt
from specc.model.expr import Clock
from specc.model.system import System
from specc.model.types import Bool, Real, Vector
from specc.model.units import METRE
from specc.pipeline import compile_spec, read_spec
from specc.proof import Witness
from specc.search import Interpreter, SearchBudget
from specc.search.example import value_text
from specc.search.search import Inverter, Thresholds
from specc.search.situation import FreeVariables
from tests.lower.test_law import systems
from tests.seeds import every, examples
from tests.witness.runs import CASES as SMALL
from tests.witness.runs import ROOT
from tests.witness.shown import refuted_of, shown, shows
from tests.witness.test_seeds import FIRST_OF_EACH, SPECS
from tests.witness.test_values import OVERLAPS, spec

CODES = ("E0601", "E0602")
outcomes: Counter[str] = Counter()


def refuted(path: Path) -> Iterator[tuple[Facts, RowVerdictAt, Witness]]:
    """The refutations about rows in a specification."""
    result = read_spec(str(path))
    assert result.system is not None
    faulty = frozenset(s.qualified_name for s in result.system.subsystems)
    yield from refuted_of(Facts(result.system, result.broken, faulty))


@pytest.mark.parametrize(("bed", "seed"), FIRST_OF_EACH)
def test_examples_of_seeded_faults(bed: Bed, seed: Seed, tmp_path: Path) -> None:
    specs = tmp_path / "specs"
    shutil.copytree(SPECS, specs, ignore=shutil.ignore_patterns("*.png", "*.ply", "*.npz"))
    part = specs / Path(bed.sheet.path).relative_to(SPECS)
    part.write_text(seed.text(bed.sheet), encoding="utf-8")
    system = specs / Path(bed.system).relative_to(SPECS)
    for refutation in refuted(system):
        shown(*refutation)


@pytest.mark.parametrize("name", every(2, list(OVERLAPS)))
def test_examples_of_every_kind_of_value(name: str, tmp_path: Path) -> None:
    for refutation in refuted(spec(tmp_path, *OVERLAPS[name])):
        shown(*refutation)


def test_examples_of_the_specification_as_published() -> None:
    path = ROOT / "specs" / "irp_picking_as_published.yaml"
    texts = [shown(*refutation).text for refutation in refuted(path)]
    assert texts and all(texts)


def example_of(path: Path) -> str:
    (finding,) = [d for d in compile_spec(str(path)).diagnostics if d.code in CODES]
    return finding.example


@pytest.mark.parametrize(
    ("one", "two", "text"),
    [
        ("x.c.d > 2", "x.c.d < 2.5", "`x.c.d` = 2.2"),
        ("n > 2", "n < 6", "`n` = 3"),
        ("twice > 2 and IS_SAFE(x.c.d)", "x.c.d < 8", "`x.c.d` = 2, `IS_SAFE(x.c.d)` = true"),
        ("fresh(x.c.d)", "x.c.go > 1", "`x.c.d` fresh, `x.c.go` = 2"),
        ("fresh(x.c.d) and x.c.d > 1", "x.c.d > 0", "`x.c.d` fresh = 2"),
        ("any(m == s for m in x.c.modes)", "True", "`x.c.modes` = [s, u, u]"),
        ("len(x.c.items) > 1", "True", "`x.c.items` = [{d: 0 m, mode: u}, {d: 0 m, mode: u}]"),
        (
            "near(x.c.X, WHERE(1), 1[m], 1[rad])",
            "x.c.go > 1",
            "`x.c.X` = identity(), `WHERE(1.0)` = identity(), `x.c.go` = 2",
        ),
        ("norm(v) < 3", "True", "`v` = [0, 0, 0]"),
        ("fresh(x.c.d)", "fresh(x.c.go)", ""),
        ("n > 2", "elapsed < 0.5[s]", "`n` = 3, `elapsed` = 0.4 s"),
    ],
)
def test_how_examples_are_said(one: str, two: str, text: str, tmp_path: Path) -> None:
    assert example_of(spec(tmp_path, one, two)) == text


def test_what_no_values_show_is_not_an_error(tmp_path: Path) -> None:
    """The solver knows nothing of third powers."""
    found = compile_spec(str(spec(tmp_path, "n ** 3 < 0", "n > 0 and n ** 3 < 5"))).diagnostics
    (finding,) = [d for d in found if d.code in (*CODES, "W0606")]
    assert finding.code == "W0606" and "the solver z3 finds that two rows apply" in finding.message


def example_in(case: str, code: str, old: str, new: str, tmp_path: Path) -> str:
    """The example of the finding in a case with other text."""
    path = tmp_path / "case.yaml"
    path.write_text((SMALL / "machines" / case).read_text("utf-8").replace(old, new), "utf-8")
    (finding,) = [d for d in compile_spec(str(path)).diagnostics if d.code == code]
    return finding.example


def test_when_a_cause_without_rows_occurs_is_said(tmp_path: Path) -> None:
    case = "E0603-no-row-for-an-error.yaml"
    assert example_in(case, "E0603", "elapsed > 2", "elapsed > 3", tmp_path) == "`elapsed` = 3.1 s"


def test_what_is_unknown_does_not_matter(tmp_path: Path) -> None:
    """The first condition is refused, and so may or may not hold."""
    unknown = spec(tmp_path, "x.c.d > 2 or x.c.nothing", "x.c.d > 1 and n < 3")
    assert example_of(unknown) == "`x.c.d` = 3, `n` = 0"


def test_a_search_budget_ends_and_is_shared() -> None:
    whole = SearchBudget(3)
    with whole.share(2) as part:
        assert part.spend(1) and part.spend(5) and not part.spend(1)
    assert whole.remaining < 0 and not whole.spend(1)
    with whole.share(2) as part:
        assert not part.spend(1)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ((0.0,) * 20, "[0, 0, ...] m"),
        ((0.0,) * 15 + (1.0,) + (0.0,) * 4, "[0, 0, ...] and [15] = 1 m"),
        (tuple(map(float, range(20))), "[0, 1, 2, 3, 4, 5, 6, 7, ...] m"),
        ((0.25, float("nan"), 1e-9), "[0.25, _, 1e-09] m"),
    ],
)
def test_vectors_in_words(value: tuple[float, ...], text: str) -> None:
    assert value_text(value, Vector(len(value), Real(METRE))) == text


def has_examples(system: System) -> None:
    facts = Facts(system)
    for refutation in refuted_of(facts):
        _, decided, witness = refutation
        found = facts.examples().find(decided, witness)
        outcomes["found" if found else "none"] += 1
        if found:
            shows(found, *refutation)
            again = facts.examples().find(decided, witness)
            assert again == found


# Of few machines none may have an example by chance. Hypothesis draws constants of the modules that
# are loaded, so that even the fixed machines depend on the tests before.
@pytest.mark.parametrize("examples", examples(12, 20))
def test_examples_of_random_machines(examples: int) -> None:
    settings(
        max_examples=examples,
        deadline=None,
        phases=(Phase.generate,),
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )(given(systems(decided=False))(has_examples))()
    assert outcomes["found"]


def test_a_truth_of_the_clock_is_compared_with_truths() -> None:
    """`entered` is a clock as `elapsed` is, and no time."""
    system = read_spec(str(ROOT / "specs" / "conveyor_gate.yaml")).system
    assert system is not None
    meaning = Interpreter(system, system.subsystems[0])
    start = meaning.blank(0.0)
    ways = Inverter(
        meaning, FreeVariables(frozenset(), frozenset()), Thresholds((), meaning, start)
    )
    entered = Clock("entered", type=Bool())
    for wanted in (True, False):
        assert list(ways._values(entered, "==", wanted)) == [wanted]
        assert list(ways._values(entered, "!=", wanted)) == [not wanted]
        assert all(type(value) is bool for value in ways._values(entered, "==", wanted))
