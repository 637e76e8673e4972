"""Seeded faults between machines are found with a way to them, and their mended twins have none.

A case says at its head what is found in it: a code, and `rests` if not every run gets there. The
text behind `#+` on a line is that line in the mended twin.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from specc.pipeline import Result, compile_spec
from specc.tools.explore.explorer import Exploration, explore
from tests.seeds import every, short
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Interpreter
from tests.soundness.operators import PLAIN
from tests.soundness.running import built, executed

CASES = sorted(Path(__file__).parent.glob("cases/*.yaml"))
ACCEPTED = Path(__file__).parents[1] / "cases"
HEAD = re.compile(r"# (?P<code>W\d{4})(?P<rests> rests)?: ")


def mended(text: str) -> str:
    """The twin of a case without its fault."""
    return re.sub(r"^(\s*(?:- )?).*#\+ (?:- )?(.*)$", r"\1\2", text, flags=re.MULTILINE)


def compiled(text: str, folder: Path) -> Result:
    (folder / "spec.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(folder / "spec.yaml"))
    assert result.ok, [d for d in result.diagnostics if d.severity == "error"]
    return result


def explored(text: str, folder: Path) -> tuple[Result, Exploration]:
    result = compiled(text, folder)
    return result, explore(result.proofs, 20_000)


@pytest.mark.parametrize("case", every(2, CASES), ids=lambda case: case.stem)
def test_a_seeded_fault_is_found_and_its_mended_twin_has_none(case: Path, tmp_path: Path) -> None:
    text = case.read_text(encoding="utf-8")
    head = HEAD.match(text)
    assert head
    result, found = explored(text, tmp_path)
    assert {finding.code for finding in found.findings} == {head["code"]}
    assert all(finding.trace.is_decided != bool(head["rests"]) for finding in found.findings)
    assert all(each.complete for each in found.slices)
    assert_traces_are_runs(result, found)
    assert_senders_tell_what_is_found(result, found)
    assert mended(text) != text
    result, found = explored(mended(text), tmp_path)
    assert [finding.message for finding in found.findings] == []
    assert_senders_tell_what_is_found(result, found)


def assert_traces_are_runs(result: Result, found: Exploration) -> None:
    """A trace that rests on nothing is what interpreter and generated code do, stamp for stamp."""
    assert result.system is not None

    def nothing(name: str, tick: int) -> Any:
        return 0.0

    run = Interpreter(result.system, PLAIN, nothing).run(400)
    if result.system.plant is None:
        with built(result.system, None) as made:
            assert not differences(run, executed(made, None, 400))
    for finding in found.findings:
        if finding.trace.is_decided:
            expected = {
                name: [(s.state, s.transition) for s in run.steps[name]] for name in run.steps
            }
            stamps = dict.fromkeys(expected, 0)
            for step in finding.trace.steps:
                name = step.walker.name
                stamp = stamps[name]
                stamps[name] += 1
                if step.transition.broken:
                    (failure,) = run.failures
                    assert (failure.subsystem, failure.stamp) == (name, stamp)
                    assert failure.about == tuple(map(str, step.transition.broken))
                else:
                    assert expected[name][stamp] == (step.transition.target, step.transition.row)


def assert_senders_tell_what_is_found(result: Result, found: Exploration) -> None:
    """What the check of senders says of an assumption is not what exploring refutes."""
    for name, axiom, verdict in found.assumptions:
        machine = next(m for m in result.proofs.machines if m.subsystem.qualified_name == name)
        grounds = result.proofs.assumption_checker.check_assumption(machine, axiom).grounds
        assert not (grounds == "proved" and verdict != "proved")
        assert not (grounds == "broken" and verdict == "on your word")


@pytest.mark.parametrize("share", short([16, 1], 0))
def test_accepted_cases_have_no_finding(share: int) -> None:
    """What no check has anything to say of; those with open points are not explored."""
    explored = 0
    for case in sorted(ACCEPTED.rglob("ok-*.yaml"))[::share]:
        result = compile_spec(str(case))
        if result.ok and result.system is not None:
            found = explore(result.proofs, 20_000)
            assert [finding.message for finding in found.findings] == [], case
            assert all(each.complete for each in found.slices), case
            explored += 1
    assert explored > 50 / share
