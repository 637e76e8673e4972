"""Proofs given contracts of devices, against all runs of small systems with a finite device."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.cycle import Executor

from specc.cli import main
from specc.emit import fill_templates
from specc.lower import lower
from specc.model.requirement import horizon_s
from specc.pipeline import Result, compile_spec
from specc.tools.explore.explorer import explore
from specc.tools.explore.verdicts import RequirementVerdict
from tests.seeds import Seeds, blocks, short
from tests.soundness.running import ScriptedPlant, package

TICKS = 10
"""Of each run, 0.1 s each; the device reports 0 or 1 at each."""
BUDGET = 200_000

RIG = """\
specc: 1.3
system: rig
agents:
  rig:
    real_effectors:
      d:
        x: {{u: {{type: real, safe: 0}}}}
        y: {{m: {{type: real, init: 0}}}}
        through: 10 Hz
        contracts:
          k: "{contract}"
    control:
      rate: {rate}
      conditions:
        terminal: {{{conditions}}}
        initial: {{high: x.d.m > 0.5, low: not x.d.m > 0.5}}
      behaviours: {{{behaviours}}}
      states: {{a: a, b: b, c: c}}
      initial_state: a
      transitions:
{rows}
plant: {{python: "nobody:Plant", bind: {{rig.E.d.u: {{}}, rig.E.d.m: {{}}}}}}
require:
  - {{that: "{that}", because: of the test}}
"""


def rig(rng: Random) -> str:
    """A random system: three states that command 0, 1 or nothing and wait for the device.

    `DEADLINE` stands in what is required.
    """
    period = rng.choice([1, 1, 2])
    times = [f"{0.1 * n:.1f}[s]" for n in (1, 2, 3)]

    def measured() -> str:
        number = rng.choice(["0", "1"])
        return rng.choice(
            [f"abs(x.d.m - {number}) < 0.3", f"abs(x.d.m - {number}) > 0.6", "x.d.m > 0.5"]
        )

    conditions, behaviours, rows = [], [], []
    for state in "abc":
        sent = rng.choice([None, "0", "1", "1"])
        arrived = f"abs(x.d.m - {sent or 1}) < {rng.choice([0.3, 0.5])}"
        test = rng.choice([arrived, arrived, measured(), f"elapsed >= {rng.choice(times)}", "True"])
        if rng.random() < 0.2:
            test = f"{measured()} {rng.choice(['or', 'and'])} elapsed >= {rng.choice(times)}"
        conditions.append(f'end_{state}: "{test}"')
        given = "" if sent is None else f'functions: [{{y.d.u: "{sent}"}}], '
        behaviours.append(f"{state}: {{{given}terminal: end_{state}}}")
        if rng.random() < 0.3:
            rows.append(f"        - [{state}, terminal, high, {rng.choice('abc')}]")
            rows.append(f"        - [{state}, terminal, low, {rng.choice('abc')}]")
        else:
            rows.append(f"        - [{state}, terminal, always, {rng.choice('abc')}]")
    follows = "abs(x.E.d.m - y.E.d.u) < 0.4"
    after = rng.choice(
        [
            *[follows] * 4,
            f"within({rng.choice(times)}, {follows})",
            f"within({rng.choice(times)}, throughout({rng.choice(times)}, {follows}))",
            "x.E.d.m > 0.5",
            f"once({rng.choice(times)}, x.E.d.m > 0.5)",
        ]
    )
    stays = f"stays(y.E.d.u, {rng.choice(times)})"
    contract = rng.choice(
        [
            *[f"always({stays} implies {after})"] * 5,
            f"always({stays} and y.E.d.u > 0.5 implies {after})",
            f"always({after})",
            f"{after}",
            f"always(y.E.d.u > 0.5 implies within({rng.choice(times)}, x.E.d.m > 0.5))",
            f"always({stays} implies not once({rng.choice(times)}, not ({follows})))",
        ]
    )
    one, other = rng.sample("abc", 2)
    is_in, goes = f"state(rig.c) == {one}", f"state(rig.c) == {other}"
    that = rng.choice(
        [
            f"within(DEADLINE, {goes})",
            "within(DEADLINE, not state(rig.c) == a)",
            "always(state(rig.c) == a implies within(DEADLINE, state(rig.c) != a))",
            f"always({is_in} implies within(DEADLINE, {goes}))",
            f"always({is_in} implies within(DEADLINE, not {is_in}))",
            f"always(not ({goes}))",
            f"always({is_in} implies rig.E.d.m < 0.5)",
            f"always({is_in} and stays(rig.E.d.u, {rng.choice(times)}) implies rig.E.d.m > 0.2)",
            f"always(stays(rig.E.d.u, {rng.choice(times)}) implies {goes})",
        ]
    )
    return RIG.format(
        contract=contract,
        rate=f"{10 // period} Hz",
        conditions=", ".join(conditions),
        behaviours=", ".join(behaviours),
        rows="\n".join(rows),
        that=that,
    )


class Sequences:
    """What the device reports, by tick."""

    def __init__(self, values: Sequence[float]) -> None:
        self.values, self.types, self.sporadic = values, _Reals(), frozenset[str]()

    def measure(self, name: str, tick: int) -> float:
        return self.values[min(tick, len(self.values) - 1)]


class _Reals:
    def __getitem__(self, name: str) -> Any:
        from specc.model.types import Real

        return Real()


def runs(result: Result) -> Iterator[tuple[tuple[float, ...], float | None, bool]]:
    """All runs of the generated code: what was reported, the first tick in s that violates the
    requirement, and whether the contract is broken; what is to come is open.
    """
    assert result.system is not None
    with package(fill_templates(lower(result.system, None))) as modules:
        for values in product((0.0, 1.0), repeat=TICKS):
            made = modules["system.py"].build("")
            watched = made.requirements
            of = {s.subsystem.name: (s.subsystem, s.ticks) for s in made.subsystems}
            watched.follow(of, made.tick_s)
            executor = Executor(made, ScriptedPlant(Sequences(values)), [watched], inline=True)  # type: ignore[arg-type]  # a script
            while executor.tick < TICKS and executor.advance():
                watched.advance(executor.tick)
            executor.finish()
            assert not executor.faults
            required, contract = watched.requirements
            found = required.so_far(made.tick_s)
            at_s = found["time_s"] if found["verdict"] == "violated" else None
            yield values, at_s, contract.verdict == "violated"


def counterexample(result: Result) -> tuple[float, ...] | None:
    """What a run reports that keeps the contract as far as it goes, and violates what is required.

    It must go on for as long as the contract looks ahead: a run may be unable to keep it before it
    has broken it.
    """
    assert result.system is not None
    (required,), (contract,) = result.system.requirements, result.system.contracts
    ahead_s = float(horizon_s(required.formula) + horizon_s(contract.formula))
    for values, at_s, is_broken in runs(result):
        if at_s is not None and not is_broken and at_s + ahead_s < (TICKS - 2) / 10:
            return values
    return None


def judged(text: str, folder: Path) -> tuple[Result, RequirementVerdict]:
    (folder / "rig.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(folder / "rig.yaml"))
    assert result.ok, text
    (found,) = explore(result.proofs, BUDGET).requirements
    return result, found


def tightest(text: str, folder: Path) -> tuple[Result, RequirementVerdict]:
    """What is said of the shortest deadline that is proved given a contract, or of the last one."""
    for ticks in range(1, 7):
        result, found = judged(text.replace("DEADLINE", f"0.{ticks}[s]"), folder)
        if found.given or "DEADLINE" not in text:
            break
    return result, found


@pytest.mark.parametrize("seeds", blocks([5], also=[6, 8, 54], long=20, each=5))
def test_what_is_proved_given_a_contract_holds_in_all_runs_that_keep_it(
    seeds: Seeds, tmp_path: Path
) -> None:
    count = 0
    for seed in seeds:
        text = rig(Random(seed))
        result, found = tightest(text, tmp_path)
        if found.given:
            count += 1
            assert counterexample(result) is None, (seed, text)
    assert count or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks((), also=range(6), long=8, each=4)[1:])
def test_what_is_said_of_values_that_stay_holds_in_all_runs(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        rng = Random(seed)
        text = rig(rng).replace("DEADLINE", "0.4[s]")
        one, other = rng.sample("abc", 2)
        stays = f"stays(rig.E.d.u, 0.{rng.randint(1, 4)}[s])"
        that = rng.choice(
            [
                f"always({stays} implies state(rig.c) == {one})",
                f"always(state(rig.c) == {one} implies not {stays})",
                f"within(0.5[s], {stays})",
                f"always(stays(state(rig.c), 0.3[s]) implies state(rig.c) in {{{one}, {other}}})",
            ]
        )
        begin = text.index("require:")
        text = f'{text[:begin]}require:\n  - {{that: "{that}", because: of the test}}\n'
        result, found = judged(text, tmp_path)
        if found.given or found.verdict not in ("proved", "violated"):
            continue
        assert result.system is not None
        ahead_s = float(horizon_s(result.system.requirements[0].formula))
        for values, at_s, _ in runs(result):
            if found.verdict == "proved":
                assert at_s is None or at_s + ahead_s >= (TICKS - 2) / 10, (seed, values)
            elif found.finding and float(found.finding.trace.time_s) + ahead_s < (TICKS - 2) / 10:
                assert at_s is not None, (seed, values)


# Each rule alone.

MOVES = {
    "contract": "always(stays(y.E.d.u, 0.2[s]) implies abs(x.E.d.m - y.E.d.u) < 0.2)",
    "rate": "10 Hz",
    "conditions": "end_a: x.d.m > 0.5",
    "behaviours": 'a: {functions: [{y.d.u: "1"}], terminal: end_a}, b: {terminal: never}',
    "rows": "        - [a, terminal, always, b]",
    "that": "within(0.6[s], state(rig.c) == b)",
}
"""It commands 1 at once. The device has it after two periods, at 0.2 s, and arrives at 0.4 s; that
is seen a period later."""


def moves(**other: str) -> str:
    text = RIG.replace("{{a: a, b: b, c: c}}", "{{a: a, b: b}}")
    text = text.replace("        initial: {{high: x.d.m > 0.5, low: not x.d.m > 0.5}}\n", "")
    return text.format(**MOVES | other)


@pytest.mark.parametrize(
    ("rate", "first"), [("10 Hz", 5), pytest.param("5 Hz", 6, marks=pytest.mark.long)]
)
def test_a_deadline_is_proved_to_the_tick(rate: str, first: int, tmp_path: Path) -> None:
    for ticks, is_proved in ((first - 1, False), (first, True), (first + 1, True)):
        that = f"within(0.{ticks}[s], state(rig.c) == b)"
        result, found = judged(moves(that=that, rate=rate), tmp_path)
        assert bool(found.given) == is_proved
        if ticks <= first:
            # Where it is not proved, a run keeps the contract and is later.
            assert (counterexample(result) is None) == is_proved


def ramp(steps: int, that: str) -> str:
    """It commands more in each period until it commands 1, and then waits for the device."""
    by = 1 / steps
    text = moves(
        that=that,
        behaviours="a: {functions: [{y.d.u: v_n, v: v_n, u_d: 1}], terminal: end_a}, "
        "b: {terminal: never}",
    )
    return text.replace(
        "      conditions:",
        f"      memory: {{v: {{type: real, init: 0}}, u_d: {{type: real, init: 1}}}}\n"
        f'      let: {{v_n: "v + min(max(u_d - v, -{by}), {by})"}}\n'
        "      conditions:",
    )


@pytest.mark.parametrize("steps", short([4, 64]))
def test_a_command_that_comes_by_a_ramp_is_followed_until_it_stays(
    steps: int, tmp_path: Path
) -> None:
    """It commands 1 from the last step on; after that it is as if it had commanded 1 at once."""
    for late, is_proved in ((4, False), (5, True)):
        that = f"within({(steps - 1 + late) / 10:.1f}[s], state(rig.c) == b)"
        result, found = judged(ramp(steps, that), tmp_path)
        assert bool(found.given) == is_proved
        if steps < TICKS - 4:
            assert (counterexample(result) is None) == is_proved


def test_a_verdict_names_the_contract(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, found = judged(moves(), tmp_path)
    assert found.summary() == "proved, given the contract `d.k`"
    assert main(["explore", str(tmp_path / "rig.yaml")]) == 0
    assert "proved, given the contract `d.k`\nall in all: complete\n" in capsys.readouterr().out


def test_without_one_the_verdict_says_which_is_missing(tmp_path: Path) -> None:
    _, found = judged(moves(contract="always(x.E.d.m > -1)"), tmp_path)
    assert found.verdict == "open"
    assert found.summary() == (
        "rests on `end_a` in `rig.c`; a contract of a device that might prove it: "
        "`always(stays(y.E.d.u, T) implies x.E.d.m > 0.5)` of `rig.E.d`"
    )


@pytest.mark.parametrize(
    "contract",
    [
        "always(stays(y.E.d.u, 0.2[s]) implies abs(x.E.d.m - y.E.d.u) < 0.6)",
        "always(stays(y.E.d.u, 0.2[s]) implies x.E.d.m > 0.4)",
        "always(stays(y.E.d.u, 0.2[s]) and y.E.d.u < 0.5 implies x.E.d.m > 0.9)",
        "always(stays(y.E.d.u, 2[s]) implies x.E.d.m > 0.9)",
        "always(within(0.2[s], x.E.d.m > 0.9) or stays(y.E.d.u, 0.1[s]))",
    ],
)
def test_a_contract_that_does_not_imply_the_condition_supports_nothing(
    contract: str, tmp_path: Path
) -> None:
    _, found = judged(moves(contract=contract), tmp_path)
    assert (found.verdict, found.given, found.refusal) == ("open", (), "")


def test_a_reader_that_skips_samples_may_miss_the_answer(tmp_path: Path) -> None:
    """`within` holds at some tick, at which a slow reader may not look."""
    contract = "always(stays(y.E.d.u, 0.1[s]) implies within(0.1[s], x.E.d.m > 0.6))"
    that = "within(1.5[s], state(rig.c) == b)"
    _, fast = judged(moves(contract=contract, that=that), tmp_path)
    _, slow = judged(moves(contract=contract, that=that, rate="5 Hz"), tmp_path)
    assert (fast.given, slow.given) == (("d.k",), ())


def test_a_contract_that_no_device_can_keep_does_not_count(tmp_path: Path) -> None:
    contract = "always(stays(y.E.d.u, 0.2[s]) implies x.E.d.m > 0.9 and x.E.d.m < 0.1)"
    _, found = judged(moves(contract=contract), tmp_path)
    assert (found.verdict, found.given) == ("open", ())
    assert "the contract `d.k` does not count: no device can keep it" in found.summary()


def test_a_contract_that_says_what_is_required_does_not_count(tmp_path: Path) -> None:
    contract, that = "always(x.E.d.m < 1.5)", "always(rig.E.d.m < 2)"
    _, found = judged(moves(contract=contract, that=that), tmp_path)
    assert (found.verdict, found.given) == ("not decided", ())
    assert "follows from it whatever the control subsystem does" in found.summary()


@pytest.mark.long
def test_what_is_measured_is_decided_by_what_is_commanded(tmp_path: Path) -> None:
    that = "always(state(rig.c) == b and stays(rig.E.d.u, 0.3[s]) implies rig.E.d.m > 0.7)"
    result, found = judged(moves(that=that), tmp_path)
    assert found.given == ("d.k",)
    assert counterexample(result) is None


def test_only_the_contracts_that_are_needed_are_named(tmp_path: Path) -> None:
    text = moves(contract='always(x.E.d.m > -1)"\n          j: "' + MOVES["contract"])
    _, found = judged(text, tmp_path)
    assert found.given == ("d.j",)


def test_a_contract_of_a_device_that_is_not_awaited_costs_nothing(tmp_path: Path) -> None:
    """It would make the search larger than it may be."""
    text = moves(
        conditions="end_a: x.d.m > 0.5, end_b: x.e.m > 0.5, end_c: x.e.m < 0.5",
        behaviours='a: {functions: [{y.d.u: "1"}], terminal: end_a}, '
        'b: {functions: [{y.e.u: "1"}], terminal: end_b}, '
        'c: {functions: [{y.e.u: "0"}], terminal: end_c}',
        rows="        - [a, terminal, always, b]\n        - [b, terminal, always, c]\n"
        "        - [c, terminal, always, b]",
        that="within(0.6[s], state(rig.c) == b)",
    )
    text = text.replace("states: {a: a, b: b}", "states: {a: a, b: b, c: c}")
    text = text.replace("rig.E.d.m: {}}", "rig.E.d.m: {}, rig.E.e.u: {}, rig.E.e.m: {}}")
    device, _, _ = text.partition("    control:")[0].partition("contracts:")
    device = device[device.index("      d:") :].replace("      d:", "      e:")
    other = text.replace("    control:", f"{device.rstrip()}\n    control:", 1)
    follows = "always(stays(y.E.e.u, 3[s]) implies abs(x.E.e.m - y.E.e.u) < 0.2)"
    with_contract = other.replace(
        "    control:", f'        contracts: {{k: "{follows}"}}\n    control:', 1
    )

    def least_budget(text: str) -> int:
        """With how many steps it is proved."""
        (tmp_path / "rig.yaml").write_text(text, encoding="utf-8")
        result = compile_spec(str(tmp_path / "rig.yaml"))
        assert result.ok, text
        budgets = (2**n for n in range(8, 20))
        return next(each for each in budgets if explore(result.proofs, each).requirements[0].given)

    assert least_budget(with_contract) == least_budget(other)


def test_one_that_nobody_can_keep_does_not_hide_another(tmp_path: Path) -> None:
    never = "always(stays(y.E.d.u, 0.1[s]) implies x.E.d.m > 0.9 and x.E.d.m < 0.1)"
    text = moves(contract=MOVES["contract"] + '"\n          j: "' + never)
    _, found = judged(text, tmp_path)
    assert found.given == ("d.k",)


NEIGHBOUR = """\
  rig{n}:
    real_effectors:
      d:
        x: {{u: {{type: real, safe: 0}}}}
        y: {{m: {{type: real, init: 0}}}}
        through: 10 Hz
        contracts: {{k: "always(stays(y.E.d.u, 0.3[s]) implies x.E.d.m > 0.6)"}}
    control:
      rate: 10 Hz
      conditions: {{terminal: {{there: x.d.m > 0.5}}}}
      functions: {{go: {{y.d.u: 1}}, stop: {{y.d.u: 2}}, back: {{y.d.u: 3}}}}
      behaviours:
        move: {{functions: [go], terminal: there}}
        stop: {{functions: [stop], terminal: there}}
        back: {{functions: [back], terminal: there}}
      states: {{M: move, R: stop, B: back}}
      initial_state: M
      transitions: [[M, terminal, always, R], [R, terminal, always, B], [B, terminal, always, M]]
"""


def test_contracts_of_agents_that_influence_nothing_do_not_matter(tmp_path: Path) -> None:
    agents = "".join(NEIGHBOUR.format(n=n) for n in range(3))
    bind = ", ".join(f"rig{n}.E.d.{x}: {{}}" for n in range(3) for x in "um")
    that = "always(state(rig0.c) == R and stays(rig0.E.d.u, 0.6[s]) implies rig0.E.d.m > 0.5)"
    text = f"specc: 1.3\nsystem: company\nagents:\n{agents}"
    text += f'plant: {{python: "nobody:Plant", bind: {{{bind}}}}}\n'
    text += f"require: [{{that: {that!r}, because: of the test}}]\n"
    _, verdict = judged(text, tmp_path)
    assert verdict.given == ("rig0.E.d.k",)
