"""Nested charts, as specifications that run, do what an independent interpreter of SCXML does."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from random import Random
from typing import Any
from xml.etree.ElementTree import Element, fromstring

import pytest
import yaml
from specc_runtime.subsystem import Subsystem

from specc.model.system import Subsystem as Model
from specc.model.types import Enum
from specc.pipeline import build
from specc.tools.importers import Notes
from tests.seeds import Seeds, blocks, every, short
from tests.soundness.running import package
from tests.tools.importers.conftest import Workshop
from tests.tools.importers.statecharts import STATES, EndlessError, Interpreter, random_chart, xml

REACTIONS = 40
MOST_PERIODS = 120
QUIET = 3
"""Periods without a transition after which there is none any more: nothing changes meanwhile."""

CHARTS: Mapping[str, Any] = yaml.safe_load(Path(__file__).with_name("charts.yaml").read_text())
IMPORTED: Mapping[str, str] = CHARTS["imported"]


@pytest.mark.parametrize("chart", every(3, list(IMPORTED.values())), ids=IMPORTED)
def test_charts_do_what_the_interpreter_does(chart: str, workshop: Workshop) -> None:
    document = xml(chart)
    made = workshop.scxml(document)
    assert not made.failed, made.diagnostics
    with machines(made, workshop) as (new,):
        entered = {each for seed in range(8) for each in reactions(document, new(), seed)}
    assert entered == atomic_states(document)


@pytest.mark.parametrize("case", CHARTS["refused"].values(), ids=CHARTS["refused"])
def test_what_modes_cannot_say_is_refused_with_the_reason(
    case: dict[str, str], workshop: Workshop
) -> None:
    made = workshop.scxml(xml(case["chart"]))
    assert made.text == ""
    errors = [d for d in made.diagnostics if d.severity == "error"]
    assert case["reason"] in [error.message for error in errors]
    assert {error.code for error in errors} == {"E0803"} and all(e.help for e in errors)


def test_a_state_may_be_called_as_what_was_never_left(workshop: Workshop) -> None:
    chart = IMPORTED["pause and resume"].replace("first", "never")
    made = workshop.scxml(xml(chart))
    assert workshop.compile(made).diagnostics == ()
    assert "state `never` is called `never_2`" in [d.message for d in made.diagnostics]


@pytest.mark.parametrize("around", short(["", "work\n  stop if p -> work\n"], 1))
def test_large_charts_are_imported_soon(around: str, workshop: Workshop) -> None:
    states = "".join(f"  s{n}\n    e -> s{n * 7 % 1500}\n" for n in range(1500))
    assert not workshop.scxml(xml(f"{around}{states}")).failed


def test_a_chart_with_too_many_rows_is_refused(workshop: Workshop) -> None:
    transitions = "".join(f"  e{n} -> s0\n" for n in range(290))
    made = workshop.scxml(xml(f"work\n{transitions}" + "".join(f"  s{n}\n" for n in range(20))))
    assert [d.code for d in made.diagnostics if d.severity == "error"] == ["E0017"]


@pytest.mark.parametrize("seeds", blocks(range(6), also=range(24), long=60, each=20))
def test_random_charts_do_what_the_interpreter_does(seeds: Seeds, workshop: Workshop) -> None:
    moved = 0
    for seed in seeds:
        chart = random_chart(Random(seed))
        document = xml(chart)
        made = workshop.scxml(document)
        if made.failed:
            for error in (d.message for d in made.diagnostics if d.severity == "error"):
                assert is_right(error, document), (chart, error)
            continue
        # States are out of reach, and conditions exclude each other, in the charts themselves.
        with machines(made, workshop, ("W0412", "W06")) as (new,):
            try:
                moved += len(set(reactions(document, new(), seed))) > 2
            except EndlessError:
                continue
    assert seeds.are_fresh or moved > len(seeds) / 4


def is_right(message: str, document: str) -> bool:
    """Whether a chart has what it is refused for."""
    root = fromstring(document)
    named = re.findall("`([^`]*)`", message)
    if message.startswith("`done.state"):
        ended = root.find(f".//*[@id='{named[0].removeprefix('done.state.')}']")
        without = [each for each in root.iter("transition") if not each.get("event")]
        return ended is not None and ended.find("final") is not None and without != []
    history = root.find(f".//history[@id='{named[0]}']")
    parent = root.find(f".//history[@id='{named[0]}']/..")
    assert history is not None and parent is not None
    if "shallow" in message:
        return history.get("type") == "shallow" and parent.find("state/state") is not None
    targets = {each.get("target", "") for each in parent.iter("transition")}
    begins = {e.get("id") for e in parent.iter() if named[0] in (e.get("initial"), starts_at(e))}
    return "is not left here" in message and bool(targets & {named[0], *begins})


def starts_at(state: Element) -> str:
    found = state.find("initial/transition")
    return "" if found is None else found.get("target", "")


def test_regions_may_have_states_inside(workshop: Workshop) -> None:
    """Each of them is judged as a chart of its own."""
    charts = IMPORTED["pause and resume"], IMPORTED["what ends leads on"]
    regions = [
        re.sub(r"\b(work|first|second|rest)\b", rf"\1_{name}", xml(chart))
        for name, chart in zip("ab", charts, strict=True)
    ]
    inner = [re.sub("scxml[^>]*>", "state>", region) for region in regions]
    made = workshop.scxml(f'<scxml><parallel id="both">{"".join(inner)}</parallel></scxml>')
    with machines(made, workshop) as news:
        for new, region in zip(news, regions, strict=True):
            assert len(set(reactions(region, new(), 1))) > 2


# Machines are stepped by themselves: what comes from outside is put where their code reads it.


class Machine:
    """The generated subsystem of a chart; what guards ask is named as in the chart."""

    def __init__(self, code: Subsystem, events: tuple[str, ...]) -> None:
        self._code, self.events = code, events
        self._code.step()

    @property
    def state(self) -> str:
        return self._code.state

    def step(self, event: str, answers: Mapping[str, bool]) -> bool:
        """One period, in which an event may come; whether a row was taken."""
        inputs = {f"outside_{name}": answer for name, answer in answers.items()}
        inputs |= {"fresh_outside_event": event != ""} | ({"outside_event": event} if event else {})
        for name in inputs.keys() & set(type(self._code.x).__slots__):
            setattr(self._code.x, name, inputs[name])
        return self._code.step() >= 0


@contextmanager
def machines(
    made: Notes, workshop: Workshop, allowed: tuple[str, ...] = ("W0412",)
) -> Iterator[list[Callable[[], Machine]]]:
    """What makes a machine anew, for each chart of a document; little is found about them."""
    found = workshop.compile(made)
    assert all(d.code.startswith(allowed) for d in found.diagnostics), found.diagnostics
    assert found.system is not None
    text = str(workshop.folder / "made.yaml")
    with package(build(text, is_read=False).files) as modules:
        system = modules["system.py"]

        def maker(index: int, events: tuple[str, ...]) -> Callable[[], Machine]:
            return lambda: Machine(system.build("").subsystems[index].subsystem, events)

        charts = [s for s in found.system.subsystems if s.agent != "outside"]
        yield [maker(at, events_of(subsystem)) for at, subsystem in enumerate(charts)]


def events_of(machine: Model) -> tuple[str, ...]:
    """The members of the type of its events."""
    port = machine.port("x", "outside")
    elements = port.elements if port else ()
    return next((e.type.members for e in elements if isinstance(e.type, Enum)), ())


def reactions(document: str, machine: Machine, seed: int) -> list[str]:
    """Let a chart and its machine react to the same; returns the states that were entered.

    A chart reacts to everything before it looks at the next event. A machine makes a transition in
    a period, in which it does not look at an event if it makes one without: it gets time.
    """
    rng, chart = Random(seed), Interpreter(document)
    named = {e for t in fromstring(document).iter("transition") for e in t.get("event", "").split()}
    events = {e.removesuffix(".*") for e in named if e != "*" and "done.state." not in e}
    entered = [machine.state]
    answers = {name: rng.random() < 0.5 for name in ("p", "q")}

    def react(event: str) -> None:
        quiet = 0
        for _ in range(MOST_PERIODS):
            is_taken = machine.step(event, answers)
            event, quiet = "", 0 if is_taken else quiet + 1
            if is_taken:
                entered.append(machine.state)
            elif quiet == QUIET:
                legal = [re.sub(r"\W", "_", name) for name in chart.entered]
                assert without_repeats(entered) == without_repeats(legal)
                return
        raise EndlessError

    chart.start(answers)
    react("")
    for _ in range(REACTIONS):
        if rng.random() < 0.4:
            answers = {name: rng.random() < 0.5 for name in answers}
            chart.ask(answers)
            react("")
        event = rng.choice(sorted(events | {"unheard_of"}))
        member = re.sub(r"\W", "_", event)
        if member not in machine.events:
            member = "any_other" if "any_other" in machine.events else ""
        chart.send(event)
        react(member)
    return chart.entered


def without_repeats(states: list[str]) -> list[str]:
    return [state for state, _ in groupby(states)]


def atomic_states(document: str) -> set[str]:
    states = [each for each in fromstring(document).iter() if each.tag in STATES]
    inner = [s for s in states if not any(each.tag in STATES for each in s)]
    return {each.get("id", "") for each in inner}
