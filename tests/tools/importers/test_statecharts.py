"""Nested charts, as specifications that run, do what an independent interpreter of SCXML does."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import groupby
from random import Random
from xml.etree.ElementTree import Element, fromstring

import pytest
from specc_runtime.subsystem import Subsystem

from specc.model.system import Subsystem as Model
from specc.model.types import Enum
from specc.pipeline import build
from specc.tools.importers import Notes
from tests.seeds import Seeds, blocks
from tests.soundness.running import package
from tests.tools.importers.conftest import Workshop
from tests.tools.importers.statecharts import STATES, EndlessError, Interpreter, random_chart, xml

REACTIONS = 40
MOST_PERIODS = 120
QUIET = 3
"""Periods without a transition after which there is none any more: nothing changes meanwhile."""

CHARTS = {
    "one transition for all states inside": """
        rest
          go -> work
        work
          stop -> rest
          first
            next -> second
          second
            next -> first
        """,
    "an inner transition comes first": """
        work
          go -> rest
          first
            go -> second
          second
        rest
          go -> work
        """,
    "an outer one comes after an inner guard": """
        work
          go -> rest
          first
            go if p -> second
          second
            go if q -> first
        rest
          go -> work
        """,
    "an outer guard": """
        work
          go if p -> rest
          first
            go if !q -> second
          second
        rest
          go if q -> work
        """,
    "three levels react to one event": """
        all
          a -> out
          work
            a if q -> first
            first
              a if p -> second
            second
              a if p && q -> first
              b -> first
        out
          a -> all
        """,
    "any event inside hides those outside": """
        work
          a -> out
          first
            * -> second
          second
            b -> first
        out
          b -> work
        """,
    "any other event outside": """
        work
          * -> out
          first
            a -> second
          second
            b if p -> first
        out
          c -> work
        """,
    "a longer name inside": """
        work
          a -> out
          first
            a.b -> second
          second
            a.* if p -> first
        out
          a -> work
        """,
    "initial states may be deep": """
        initial third
        work
          initial third
          a -> first
          inner
            second
              a -> third
            third
              b -> first
          first
            a -> inner
            b -> out
        out
          a -> work
        """,
    "initial states by an element": """
        start -> out
        work
          start -> second
          stop -> out
          first
          second
            a -> first
        out
          a -> work
        """,
    "a compound state enters itself": """
        work
          again -> work
          first
            a -> second
          second
            a -> third
          third
            a -> out
        out
          a -> work
        """,
    "an internal transition": """
        work
          a => second
          stop => out
          first
          second
            b -> first
        out
          a -> work
        """,
    "from inside to inside elsewhere": """
        left
          one
            a -> four
          two
            a -> right
        right
          three
            a -> one
            b -> left
          four
            a -> two
        """,
    "from inside to what is around": """
        work
          inner
            first
              a -> second
            second
              a -> inner
              b -> work
          last
            a -> inner
          b -> last
        """,
    "without events, on and on to a guard": """
        work
          stop -> rest
          first
            -> second
          second
            if p -> third
          third
            if q -> fourth
          fourth
            a -> first
        rest
          a -> work
        """,
    "without events out of a compound state": """
        work
          if p -> rest
          first
            a -> second
          second
            a -> first
        rest
          if !p -> second
        """,
    "without events, inside first": """
        work
          if p -> rest
          first
            if p && q -> second
          second
            if q -> third
          third
            a -> first
        rest
          a if !p -> work
        """,
    "a guard without event before an event": """
        work
          if p -> rest
          c -> third
          first
            a -> second
          second
            a -> first
          third
            b -> first
        rest
          a if !p -> work
        """,
    "pause and resume": """
        work
          pause -> paused
          deep where -> first
          first
            next -> second
          second
            next -> third
          third
            next -> first
        paused
          resume -> where
        """,
    "a shallow history of atomic states": """
        work
          pause -> paused
          history where -> second
          first
            next -> second
          second
            next -> first
        paused
          resume -> where
          again -> work
        """,
    "a deep history with levels": """
        work
          pause -> paused
          deep where -> first
          first
            a -> inner
          inner
            b -> first
            second
              a -> third
            third
              a -> innermost
              innermost
        paused
          resume -> where
        """,
    "a history begins elsewhere than its state": """
        initial paused
        work
          pause -> paused
          deep where -> third
          first
            next -> inner
          inner
            second
              next -> third
            third
              next -> first
        paused
          resume -> where
          enter -> work
        """,
    "a history begins in a compound state": """
        initial paused
        work
          pause -> paused
          deep where -> inner
          first
            next -> inner
          inner
            second
              next -> third
            third
              next -> first
        paused
          resume -> where
          enter -> work
        """,
    "a state goes back to where it is": """
        work
          again -> where
          pause -> paused
          deep where -> first
          first
            next -> inner
          inner
            second
              next -> third
            third
        paused
          resume -> where
        """,
    "what is around goes back to where it is": """
        all
          again -> where
          work
            deep where -> first
            pause -> paused
            first
              next -> second
            second
              next -> first
          paused
            resume -> work
        """,
    "a state begins with its history": """
        work
          initial where
          pause -> paused
          deep where -> second
          first
            next -> inner
          inner
            second
              next -> third
            third
              next -> first
        paused
          resume -> work
        """,
    "a shallow history that begins anew inside": """
        work
          pause -> paused
          history where -> first
          first
            next -> inner
          inner
            second
              next -> third
              pause -> paused
            third
              pause -> second
              next -> first
        paused
          resume -> where
        """,
    "a shallow history of what begins with a deep one": """
        work
          pause -> paused
          history where -> first
          first
            next -> inner
          inner
            initial there
            deep there -> second
            second
              next -> third
            third
              next -> first
        paused
          resume -> where
        """,
    "histories of two states": """
        left
          swap -> there
          deep here -> one
          one
            next -> two
          two
            next -> one
        right
          swap -> here
          history there -> four
          three
            next -> four
          four
            next -> three
        """,
    "a history of an inner state": """
        all
          off -> dark
          work
            pause -> paused
            deep where -> first
            first
              next -> second
            second
              next -> first
          paused
            resume -> where
        dark
          on -> all
          resume -> where
        """,
    "a history of what ended": """
        work
          pause -> paused
          deep where -> first
          done.state.work if p -> rest
          first
            next -> end
          final end
        paused
          resume -> where
        rest
          go -> work
        """,
    "what ends leads on": """
        work
          done.state.work -> rest
          first
            next -> second
          second
            next -> end
          final end
        rest
          go -> work
        """,
    "what ends stays until an event comes": """
        work
          done.state.work if p -> rest
          go if q -> work
          stop -> rest
          first
            next -> end
            enter -> work
          final end
        rest
          go -> work
        """,
    "a guard that holds later is too late": """
        work
          done.state.work if p -> rest
          first
            next -> end
          final end
        rest
          go -> work
        """,
    "outer states wait for what ends": """
        all
          done.state.work -> rest
          work
            stop if p -> rest
            first
              next -> end
              skip -> other
            final end
            final other
        rest
          go -> all
        """,
    "any event is one that ends": """
        work
          * if p -> rest
          first
            next -> end
          final end
        rest
          go -> work
        """,
    "the beginning of a name is enough for what ends": """
        work
          done if p -> rest
          first
            next -> end
          final end
        rest
          done -> work
        """,
    "one end leads to another": """
        all
          done.state.all -> rest
          done.state.work -> finish
          work
            first
              next -> end
            final end
          final finish
        rest
          go -> all
        """,
    "a guard comes before the end": """
        work
          if p -> out
          done.state.work -> rest
          first
            next -> end
          final end
        rest
          go -> end
        out
          go -> work
          skip -> end
        """,
    "two guards at the end": """
        work
          done.state.work if p -> one
          done.state.work if q -> two
          done.state.work -> three
          first
            next -> end
          final end
        one
          go -> work
        two
          go -> work
        three
          go -> work
        """,
    "an event that is taken leads nowhere": """
        all
          a -> out
          b -> out
          work
            a if p ->
            b ->
            first
              a if q -> second
            second
              next -> first
        out
          a -> all
        """,
    "an event that is taken is not the end": """
        all
          done.state.work if q -> out
          work
            next if p ->
            first
              next -> end
            final end
          next -> out
        out
          a -> all
        """,
    "the whole chart ends": """
        work
          stop -> end
          first
            next -> second
          second
            next -> first
        final end
        """,
    "nothing comes from outside": """
        work
          done.state.work -> rest
          first
            -> second
          second
            -> end
          final end
        rest
        """,
    "names that are none": """
        wide-open
          close.now -> h-1
          deep h-2 -> first-part
          first-part
            go -> last-part
          last-part
            go -> first-part
        in
          deep h-1 -> n-1
          open -> h-2
          n-1
            go -> n-2
          n-2
            go -> n-1
        """,
}


@pytest.mark.parametrize("chart", CHARTS.values(), ids=CHARTS)
def test_charts_do_what_the_interpreter_does(chart: str, workshop: Workshop) -> None:
    document = xml(chart)
    made = workshop.scxml(document)
    assert not made.failed, made.diagnostics
    with machines(made, workshop) as (new,):
        entered = {each for seed in range(8) for each in reactions(document, new(), seed)}
    assert entered == atomic_states(document)


REFUSED = {
    "a parallel state inside": (
        """
        work
          parallel both
            arm
            base
          alone
        """,
        "`both` is a parallel state: `arm` and `base` are active at the same time",
    ),
    "a state in a parallel one": (
        """
        work
          a -> base
          parallel both
            arm
            base
        """,
        "state `base` is inside `both`: it is active together with others",
    ),
    "a shallow history that begins anew inside": (
        """
        work
          pause -> paused
          history where -> first
          first
          inner
            second
              next -> third
            third
        paused
          resume -> where
        """,
        "`where` is a shallow history: where `work` was left in `third` it leads to `second`, "
        "and `resume` to `third`",
    ),
    "a history from inside": (
        """
        work
          deep where -> first
          first
            a -> where
          second
        """,
        "`where` is a history of `work`, which is not left here",
    ),
    "a history from inside by an internal transition": (
        """
        work
          a => where
          history where -> first
          first
          second
        """,
        "`where` is a history of `work`, which is not left here",
    ),
    "an initial history from inside": (
        """
        all
          a => work
          work
            initial where
            deep where -> first
            first
              a => inner
            inner
              start -> back
              deep back -> second
              second
                b -> back
        """,
        "`back` is a history of `inner`, which is not left here",
    ),
    "histories that begin differently": (
        """
        work
          history one -> first
          deep two -> second
          first
          second
        rest
          a -> one
          b -> two
        """,
        "the histories of `work` begin in different states, `first` and `second`",
    ),
    "an end that waits": (
        """
        all
          done.state.work -> rest
          work
            if p -> other
            first
              a -> end
            final end
          other
        rest
        """,
        "`done.state.work` may come in `other`, after a transition without an event out of `end`",
    ),
    "a history without a beginning": (
        """
        work
          history where
          first
        """,
        "history `where` does not say where it begins",
    ),
    "a history that begins outside": (
        """
        work
          history where -> rest
          first
        rest
        """,
        "`rest` is not inside `work`",
    ),
    "a history that begins with another": (
        """
        work
          deep where -> other
          inner
            history other -> first
            first
        """,
        "history `where` begins with another history",
    ),
    "a history of an atomic state": (
        """
        work
          history where -> work
        """,
        "<history> inside <state> is not carried over",
    ),
    "a history of the chart": (
        """
        work
        history where -> work
        """,
        "<history> inside <scxml> is not carried over",
    ),
    "an initial state outside": (
        """
        work
          initial rest
          first
        rest
        """,
        "`rest` is not inside `work`",
    ),
    "several initial states": (
        """
        work
          initial first second
          first
          second
        """,
        "several initial states need parallel states",
    ),
    "several targets": (
        """
        work
          a -> first second
          first
          second
        """,
        "a transition with several targets needs parallel states",
    ),
    "a transition of a final state": (
        """
        work
          first
          final end
            a -> first
        """,
        "a final state has no transitions: `end`",
    ),
    "a final state with others": (
        """
        work
          first
          final end
            last
        """,
        "<state> inside <final> is not carried over",
    ),
    "a name twice": (
        """
        work
          first
          work
            second
        """,
        "state `work` is there twice",
    ),
    "a name of none": (
        """
        work
          first
            a -> third
          second
        """,
        "there is no state `third`",
    ),
}


@pytest.mark.parametrize(("chart", "reason"), REFUSED.values(), ids=REFUSED)
def test_what_modes_cannot_say_is_refused_with_the_reason(
    chart: str, reason: str, workshop: Workshop
) -> None:
    made = workshop.scxml(xml(chart))
    assert made.text == ""
    errors = [d for d in made.diagnostics if d.severity == "error"]
    assert reason in [error.message for error in errors]
    assert {error.code for error in errors} == {"E0803"} and all(e.help for e in errors)


def test_a_chart_with_too_many_rows_is_refused(workshop: Workshop) -> None:
    transitions = "".join(f"  e{n} -> s0\n" for n in range(290))
    made = workshop.scxml(xml(f"work\n{transitions}" + "".join(f"  s{n}\n" for n in range(20))))
    assert [d.code for d in made.diagnostics if d.severity == "error"] == ["E0017"]


@pytest.mark.parametrize("seeds", blocks(range(24), long=160, each=20))
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
    charts = CHARTS["pause and resume"], CHARTS["what ends leads on"]
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
