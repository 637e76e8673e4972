"""What stands in the plan beside methods: equation numbers, system, limits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.analysis.rates import base_tick
from specc.emit import fill_templates
from specc.lower import TooLarge, lower
from specc.lower.subsystem import Equations
from specc.model.fsm import Trace
from specc.model.system import System
from tests.lower.models import Known, Spec, install, load
from tests.seeds import every

STEP = {"go": ("(a: real) -> real", abs)}


def traced() -> System:
    """Numbers on everything that can carry one."""
    s = Spec(
        x={"E.m": "real", "E.k": "real"},
        y={"E.u": "real", "E.v": "real"},
        memory={"p": ("real", "0"), "q": ("real", "0")},
        lets={"w": "go(x.E.m)", "v": "w + 1"},
        operators=STEP,
    )
    one = s.behaviour("one", {"E.u": "v", "p": "q"}, terminal="x.E.k > 0")
    two = s.behaviour("two", {"E.v": "p"}, terminal="w > 0")
    system = s.system(
        [one, two], [("one", "terminal", "p > 0", "two"), ("one", "terminal", "p <= 0", "one")]
    )
    (old,) = system.subsystems
    numbers = iter(range(1, 99))

    def numbered(part):
        return replace(part, trace=Trace((next(numbers),)))

    subsystem = replace(
        old,
        lets=tuple(map(numbered, old.lets)),  # w 1, v 2
        memory=tuple(map(numbered, old.memory)),  # p 3, q 4
        ports=tuple(
            replace(port, elements=tuple(map(numbered, port.elements))) for port in old.ports
        ),  # m 5, k 6, u 7, v 8
        transitions=tuple(map(numbered, old.transitions)),  # 9, 10
        states=tuple(
            replace(numbered(state), behaviour=numbered(state.behaviour)) for state in old.states
        ),  # states 11, 13, behaviours 12, 14
    )
    operators = tuple(map(numbered, system.operators))  # 15
    agent = replace(system.agents[0], subsystems=(subsystem,))
    return replace(system, agents=(agent,), operators=operators)


def test_a_number_counts_for_all_that_refers_to_its_bearer() -> None:
    system = traced()
    plan = Equations(system, system.subsystems[0]).tables()
    assert plan is not None
    assert dict(plan["behaviours"]) == {
        "'one'": "(1, 2, 3, 4, 5, 7, 11, 12, 15)",
        "'two'": "(3, 8, 13, 14)",
    }
    assert dict(plan["checks"]) == {
        "'one'": "{'terminal': (6,)}",
        "'two'": "{'terminal': (1, 5, 15)}",
    }
    assert plan["rows"] == ("(3, 9)", "(3, 10)")


rates = st.fractions(min_value=Fraction(1, 10), max_value=1000, max_denominator=10)


@given(st.lists(rates, min_size=1, max_size=4))
def test_the_base_tick_is_the_longest_common_part_of_all_periods(found: list[Fraction]) -> None:
    tick = base_tick(1 / rate for rate in found)
    ticks = [1 / rate / tick for rate in found]
    assert all(t.denominator == 1 for t in ticks)
    for factor in (2, 3, 5, 7, 11, 13):
        assert any((t / factor).denominator != 1 for t in ticks)


def test_a_system_can_be_built() -> None:
    install({"go": abs}, [])
    modules = load(fill_templates(lower(traced(), Known(True))))
    system = modules["system.py"].build("somewhere")
    assert system.name == "demo"
    assert system.spec == "hand.yaml"
    assert system.tick_s == 0.002
    (scheduled,) = system.subsystems
    assert (scheduled.subsystem.name, scheduled.ticks) == ("demo.m", 1)


def nested(count: int, template: str, first: str = "go(x.E.m)", used: str = "{0}") -> System:
    """Lets that refer to their predecessor, in the way of `template`; the last one is `used`."""
    lets = {"w0": first}
    lets |= {f"w{i}": template.format(f"w{i - 1}") for i in range(1, count)}
    s = Spec(x={"E.m": "real", "E.k": "real"}, y={"E.u": "real"}, lets=lets, operators=STEP)
    work = s.behaviour("one", {"E.u": used.format(f"w{count - 1}")})
    return s.system([work], [("one", "terminal", "True", "one")])


@pytest.mark.parametrize(
    "template",
    [
        "{0} * {0} + {0}",
        "go({0}) if x.E.k > {0} else ({0} if x.E.k > 1 else 0)",
        "go({0}) if x.E.k > 1 else ({0} if x.E.k > 2 else 0)",
    ],
)
@pytest.mark.parametrize("used", ["{0}", "{0} if x.E.k > 1 else 0"])
def test_lets_that_call_operators_cost_one_line_each(template: str, used: str) -> None:
    files = fill_templates(lower(nested(60, template, used=used), Known(True)))
    assert len(files["demo_m.py"]) < 12_000


@pytest.mark.parametrize(
    ("count", "template"),
    every(2, [(40, "{0} if x.E.k > 1 else ({0} if x.E.k > 2 else 0)"), (1000, "{0} + 1")]),
)
def test_what_would_become_too_large_is_refused(count: int, template: str) -> None:
    system = nested(count, template, first="x.E.m", used="{0} if x.E.k > 1 else 0")
    with pytest.raises(TooLarge, match=r"one period of `demo\.m` evaluates more than"):
        lower(system, Known(True))
