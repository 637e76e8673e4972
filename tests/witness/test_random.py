"""Random machines with rows taken away: whatever a scenario says, the generated code does."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from specc_runtime.faults import UndecidedTransition

from specc.analysis import Facts
from specc.emit import fill_templates
from specc.model.system import System
from specc.pipeline import Result
from specc.source import Sources
from specc.tools.witness.code import Script, SubsystemCode
from specc.tools.witness.plan import plan_script
from specc.tools.witness.subject import Refutation, refutations
from specc.tools.witness.text import scenario
from tests.explore.counters import counting
from tests.lower.test_law import systems
from tests.seeds import Seeds, blocks, examples

outcomes: Counter[str] = Counter()


def scripts(system: System) -> Iterator[tuple[Refutation, Script | None]]:
    facts = Facts(system)
    for refutation in refutations(facts):
        with tempfile.TemporaryDirectory() as scratch:
            code = SubsystemCode(system, refutation.subsystem, Path(scratch))
            yield refutation, plan_script(code, facts, refutation)


def fault_of(text: str, system: System) -> Exception | None:
    """What the test in a scenario raises when the system is what its specification says."""
    names: dict[str, object] = {"__file__": __file__}
    exec(compile(text, "scenario", "exec"), names)
    (test,) = (value for name, value in names.items() if name.startswith("test_"))
    read = Result(system, None, (), Sources())
    with (
        tempfile.TemporaryDirectory() as scratch,
        patch("specc.tools.witness.trial.read_spec", return_value=read),
    ):
        try:
            test(Path(scratch))  # type: ignore[operator]  # the only function there
        except Exception as error:  # noqa: BLE001 - which one it is, is what is tested
            return error
    return None


def check(system: System) -> None:
    for refutation, script in scripts(system):
        outcomes["found" if script else "not found"] += 1
        if script is None:
            continue
        with patch("specc.tools.witness.text.emit", fill_templates):
            text = scenario(refutation, script, "hand.yaml")
        error = fault_of(text, system)
        if refutation.absent is not None:
            assert isinstance(error, AttributeError), text
            assert error.__notes__ == [f"`x.{'.'.join(refutation.absent)}` has no value"]
            continue
        assert isinstance(error, UndecidedTransition), text
        assert (error.state, error.cause) == (refutation.state, refutation.cause)
        assert error.rows == script.rows


@pytest.mark.parametrize("examples", examples(8, 12))
def test_scenarios_of_random_machines(examples: int) -> None:
    settings(
        max_examples=examples,
        deadline=None,
        phases=(Phase.generate,),
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )(given(systems(decided=False))(check))()
    # What is not found is what proofs relate too little for, such as `n ** 1 == n`.
    assert outcomes["found"]


@pytest.mark.parametrize("seeds", blocks([1], also=[0, *range(2, 30)], long=4, each=20))
def test_scenarios_of_random_machines_with_modes(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        result = counting(Random(seed), tmp_path, with_modes=True, narrowed=True)
        if result.system is not None:
            check(result.system)
