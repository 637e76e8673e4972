"""A system that does not hang together is refused with all that is wrong; the static timeline."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.system import Connection, PlantInput, PlantSpec, Scheduled, System, Task
from specc_runtime.wiring import SensorRate, timeline

from tests.runtime.tiny import Node, Run, system


def test_all_problems_of_a_system_are_named() -> None:
    a, b = Node("a", 2), Node("b", 3)
    plant = PlantSpec(
        "m.xml",
        (SensorBinding("a.E.m", rate_hz=300.0),),
        inputs=(PlantInput("a.E.q", "d", "E_q"),),
    )
    with pytest.raises(ValueError) as caught:
        System(
            "odd",
            0.002,
            (Scheduled(a, 2), Scheduled(b, 4), Scheduled(a, 2)),
            (Connection("a", "value", "c", "a"),),
            plant,
            Task("e", "S0", "S1"),
        )
    for text in (
        "b: 4 ticks, but its period is 3",
        "a occurs twice",
        "no subsystem c",
        "no subsystem d",
        "no subsystem e",
        "a.E.q is not bound",
        "a.E.m: a period of 0.0033",
    ):
        assert text in str(caught.value)


@pytest.mark.parametrize("tick_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_base_tick_is_positive(tick_s: float) -> None:
    with pytest.raises(ValueError, match="base tick"):
        system(Node("a"), tick_s=tick_s)


def test_connection_to_an_element_that_is_not_there() -> None:
    built = System(
        "t",
        0.002,
        (Scheduled(Node("a"), 1), Scheduled(Node("b"), 1)),
        (Connection("a", "value", "b", "speed"),),
    )
    with pytest.raises(AttributeError, match="no element 'speed'"):
        Run(built, 1)


@given(st.dictionaries(st.sampled_from("abcde"), st.integers(1, 12), min_size=1))
def test_timeline_repeats_and_knows_who_is_due(ticks: dict[str, int]) -> None:
    table = timeline(ticks)
    for tick in range(2 * len(table) + 3):
        due = table[tick % len(table)].subsystems
        assert due == tuple(sorted(n for n, k in ticks.items() if tick % k == 0))


@given(st.dictionaries(st.sampled_from("abc"), st.integers(1, 9), min_size=1), st.integers(1, 9))
def test_only_samples_that_somebody_sees_are_taken(ticks: dict[str, int], period: int) -> None:
    table = timeline(ticks, {"camera": SensorRate(period, tuple(ticks))})
    taken = {t for t, slot in enumerate(table) if slot.sensors}
    stamps = {t for t, slot in enumerate(table) if slot.subsystems}
    assert taken == {t // period * period for t in stamps}


def test_rates_that_never_meet_are_refused() -> None:
    with pytest.raises(ValueError, match="meet again only after"):
        timeline({"a": 10007, "b": 10009})
