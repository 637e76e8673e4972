"""State charts as specifications; nested ones are in `test_statecharts`."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from specc.lang.evaluate import Environment, evaluate
from specc.model.expr import Expr
from specc.model.system import Subsystem
from specc.pipeline import Result, build
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from specc.tools.importers import Notes, import_scxml
from tests.seeds import examples
from tests.tools.importers.conftest import FILES, Workshop

DOOR = str(FILES / "door.scxml")
Codes = Callable[[Notes | Result], list[str]]


def chart(result: Result) -> Subsystem:
    assert result.system is not None
    return result.system.subsystems[0]


def rows(subsystem: Subsystem) -> list[tuple[str, str]]:
    return [(r.source, r.target) for r in subsystem.transitions]


def test_a_chart_validates_and_builds(workshop: Workshop) -> None:
    made = import_scxml(DOOR)
    found = workshop.compile(made)
    assert found.diagnostics == ()
    assert rows(chart(found)) == [
        ("closed", "opening"),
        ("closed", "refused"),
        ("closed", "broken"),
        ("opening", "wide_open"),
        ("opening", "broken"),
        ("wide_open", "closed"),
        ("wide_open", "wide_open"),
        ("refused", "closed"),
    ]
    assert build(str(workshop.folder / "made.yaml")).files


CHARTS = {
    "sequence": """<state id="rest"><transition event="open" target="check"/></state>
      <state id="check"><transition target="opening"/></state>
      <state id="opening"><transition event="opened" target="rest"/></state>""",
    "guards": """<state id="rest"><transition cond="ready" target="work"/></state>
      <state id="work"><transition cond="!ready" target="rest"/></state>""",
    "both": """<state id="rest"><transition event="go" cond="comes" target="work"/></state>
      <state id="work"><transition event="stop" target="rest"/></state>""",
    "modes": """<state id="rest"><transition event="go" target="back"/></state>
      <state id="work"><history id="back" type="deep"><transition target="one"/></history>
        <transition event="stop" target="rest"/>
        <transition event="done.state.work" cond="done" target="rest"/>
        <state id="one"><transition event="next" target="two"/></state>
        <state id="two"><transition event="next" target="end"/></state><final id="end"/></state>""",
}


@pytest.mark.parametrize("body", CHARTS.values(), ids=CHARTS)
def test_any_event_may_come_at_any_time(body: str, workshop: Workshop) -> None:
    """A chart that waits for an event waits for the outside, which may send it."""
    head = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="rest">'
    found = workshop.compile(workshop.scxml(f"{head}{body}</scxml>"))
    assert found.diagnostics == ()
    told = explore(found.proofs, 10_000)
    assert told.findings == [] and told.status == "complete"
    abstraction = Abstraction(found.proofs)
    (names,) = abstraction.slices()
    composition = Composition(names, abstraction)
    place = names.index(chart(found).qualified_name)
    every = Graph(composition, 10_000).configurations
    assert {composition.state_names(each)[place] for each in every} == {
        state.name for state in chart(found).states
    }


def test_events_are_one_queue_and_guards_are_inputs(workshop: Workshop) -> None:
    door = chart(workshop.compile(import_scxml(DOOR)))
    port = door.port("x", "outside")
    assert port is not None
    event, *guards = port.elements
    assert event.name == "event"
    assert event.type.members == ("open", "error", "close", "error_lock", "any_other")
    assert [(g.name, g.title) for g in guards] == [
        ("locked", "locked"), ("guard_count_3", "count < 3"), ("atEnd", "atEnd"),
    ]  # fmt: skip


def test_what_is_not_carried_over_is_told() -> None:
    made = import_scxml(DOOR)
    told = " | ".join(d.message for d in made.diagnostics)
    for words in (
        "10 ms is assumed",
        "`datamodel` of <scxml> is not",
        "<datamodel> is not",
        "<onentry> is not",
        "guard `count < 3` is the input `guard_count_3`",
        "state `wide-open` is called `wide_open`",
        "event `error.lock` is called `error_lock`",
        "without a target enters `wide-open` again",
        "the chart stops in `broken`",
        "one period after",
    ):
        assert words in told, words
    assert {d.code for d in made.diagnostics} == {"W0801", "W0802"}


def test_texts_between_tags_are_told(workshop: Workshop) -> None:
    states = (
        '<state id="a">one<transition event="e" target="b"/></state>\n<state id="b"> two </state>'
    )
    made = workshop.scxml(f"<scxml>{states}</scxml>")
    told = [d.message for d in made.diagnostics if "text" in d.message]
    assert told == [
        "the text in <state> is not carried over (2 times, first here): it has no meaning there"
    ]


def test_period_and_name_can_be_given(workshop: Workshop) -> None:
    made = import_scxml(DOOR, name="gate", period=Fraction("0.02"))
    found = workshop.compile(made)
    assert chart(found).qualified_name == "gate.c"
    assert chart(found).rate_hz == 50
    assert not any("is assumed" in d.message for d in made.diagnostics)


def test_a_chart_without_events_or_without_transitions(workshop: Workshop, codes: Codes) -> None:
    """It asks for nothing; it tells its state to the outside, which has no use for it yet."""
    timer = workshop.scxml('<scxml><state id="a"><transition target="a"/></state></scxml>')
    assert codes(workshop.compile(timer)) == ["W0412"]
    alone = workshop.scxml('<scxml><final id="a"/></scxml>')
    assert codes(workshop.compile(alone)) == ["W0412"]


@pytest.mark.parametrize("path", sorted(FILES.glob("*.scxml")), ids=lambda path: path.stem)
def test_what_is_written_validates(path: Path, workshop: Workshop) -> None:
    made = import_scxml(str(path))
    assert not made.failed
    found = workshop.compile(made)
    assert {d.code for d in found.diagnostics} <= {"W0412"}
    assert build(str(workshop.folder / "made.yaml")).files


def test_states_without_an_id_get_a_name(workshop: Workshop) -> None:
    body = (
        '<state><transition event="e" target="state_1"/></state><state id="state_1"/>'
        "<state><transition event='e' target='state_1'/></state>"
    )
    made = workshop.scxml(f"<scxml>{body}</scxml>")
    told = [d.message for d in made.diagnostics if "without `id`" in d.message]
    assert told == [f"a <state> without `id` is called `state_{n}`" for n in (2, 3)]
    machine = chart(workshop.compile(made))
    assert machine.initial_state == "state_2"
    assert rows(machine) == [("state_2", "state_1"), ("state_3", "state_1")]


def test_each_region_of_a_parallel_chart_is_an_agent(workshop: Workshop) -> None:
    """They get the same events, and move in the same period."""
    found = workshop.compile(import_scxml(str(FILES / "regions.scxml")))
    assert found.system is not None
    machines = {machine.agent: machine for machine in found.system.subsystems}
    assert {name: rows(machines[name]) for name in ("arm", "base", "clock", "lamp")} == {
        "arm": [("still", "moving"), ("moving", "still")],
        "base": [("parked", "driving"), ("driving", "parked"), ("driving", "parked")],
        "clock": [("tick", "tock"), ("tock", "tick")],
        "lamp": [],
    }
    inputs = {("outside", name): name == "free" for name in ("free", "late")}
    inputs |= {("outside", "event"): "go"}
    fresh = {("outside", "event")}
    assert run(machines["arm"], "still", inputs, fresh) == "moving"
    assert run(machines["base"], "parked", inputs, fresh) == "driving"
    assert run(machines["base"], "driving", inputs, fresh) is None
    told = explore(found.proofs, 10_000)
    assert told.findings == []


def test_a_parallel_chart_may_name_its_start_in_an_element(workshop: Workshop) -> None:
    start = '<initial><transition target="p"/></initial>'
    chart = COUPLED.format('event="go"')
    assert workshop.scxml(f"<scxml>{start}{chart}</scxml>").text != ""


PARALLEL = """<scxml initial="both"><parallel id="both">
  <state id="arm"><transition event="retry" target="both"/></state><state id="base"/></parallel>
  <state id="rest"><transition event="go" target="both"/></state></scxml>"""


def test_a_parallel_state_beside_others_is_there(workshop: Workshop) -> None:
    """What is refused is that two states are active; nothing is said to be missing."""
    made = workshop.scxml(PARALLEL)
    (error,) = (d for d in made.diagnostics if d.severity == "error")
    assert error.code == "E0803"
    assert error.message == (
        "`both` is a parallel state: `arm` and `base` are active at the same time"
    )
    assert error.help.startswith("write a chart for each of them, which becomes an agent, or")


DROPPED = [
    '<ros_topic_callback name="bump" target="b"/>',
    '<x:when xmlns:x="urn:x" target="b c"/>',
    '<group><transition event="e" target="b"/></group>',
    '<group><group><then target="b"/></group></group>',
    '<on_event event="go"><goto next="b"/></on_event>',
]


@pytest.mark.parametrize("element", DROPPED)
def test_a_transition_that_is_not_carried_over_is_an_error(
    element: str, workshop: Workshop
) -> None:
    made = workshop.scxml(
        f'<scxml><state id="a"><transition event="go" target="b"/>{element}</state>'
        '<state id="b"/><state id="c"/></scxml>'
    )
    assert made.text == ""
    assert [d.code for d in made.diagnostics if d.severity == "error"] == ["E0803"]


@pytest.mark.parametrize(
    "element",
    [
        '<onentry><send event="e" target="b"/></onentry>',
        '<e:spot xmlns:e="urn:editor" target="nowhere"/>',
    ],
)
def test_another_element_with_a_target_is_told(element: str, workshop: Workshop) -> None:
    made = workshop.scxml(
        f'<scxml><state id="a"><transition event="go" target="b"/>{element}</state>'
        '<state id="b"/></scxml>'
    )
    assert made.text
    assert any("is not carried over" in d.message for d in made.diagnostics)


COUPLED = (
    '<parallel id="p"><state id="a"><state id="b"><transition {} target="c"/></state>'
    '<state id="c"/></state><state id="d"><state id="e"/></state></parallel>'
)

BROKEN = [
    ('<state id="a"><parallel id="b"/></state>', "E0803"),
    ('<state id="a"><history id="b"/></state>', "E0803"),
    ('<parallel id="a"/>', "E0803"),
    ('<parallel id="a"><history id="h"/><state id="b"/></parallel>', "E0803"),
    ('<parallel id="a"><state id="b"/><transition event="e" target="b"/></parallel>', "E0803"),
    (
        '<parallel id="a"><state id="b"><state id="c"/><transition target="c"/></state></parallel>',
        "E0803",
    ),
    (
        '<parallel id="a"><state id="b"><state id="c"><transition target="d"/></state></state>'
        '<state id="e"><state id="d"/></state></parallel>',
        "E0803",
    ),
    (COUPLED.format("event='go' cond=\"In('e')\""), "E0803"),
    (COUPLED.format("event='done.state.d'"), "E0803"),
    ('<state id="a"><transition target="a b"/></state><state id="b"/>', "E0803"),
    ('<final id="a"><transition target="a"/></final>', "E0803"),
    ('<state id="a"/><state id="a"/>', "E0803"),
    ('<state id="a"><transition target="b"/></state>', "E0803"),
    ("", "E0803"),
]


@pytest.mark.parametrize(("content", "code"), BROKEN)
def test_charts_that_modes_cannot_say_or_that_are_not_whole(
    content: str, code: str, workshop: Workshop
) -> None:
    made = workshop.scxml(f"<scxml>{content}</scxml>")
    assert made.text == ""
    assert code in {d.code for d in made.diagnostics}


def test_a_foreign_element_is_told(workshop: Workshop) -> None:
    made = workshop.scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:e="urn:editor">'
        '<state id="a"><transition event="go" target="a"/><e:spot x="1"/></state></scxml>'
    )
    assert any(d.message.startswith("<urn:editor:spot>") for d in made.diagnostics)


@pytest.mark.parametrize("cond", ["In('a')", "f(g(x)) > 1", "(a + b) > 2", "a =", "a && (b"])
def test_a_guard_of_another_language_is_one_question(cond: str, workshop: Workshop) -> None:
    escaped = cond.replace("&", "&amp;").replace(">", "&gt;")
    made = workshop.scxml(
        f'<scxml><state id="a"><transition event="go" cond="{escaped}" target="a"/></state></scxml>'
    )
    assert workshop.compile(made).diagnostics == ()
    assert any(f"guard `{cond}`" in d.message for d in made.diagnostics)


EVENTS = ("a", "a.b", "c")
Move = tuple[tuple[str, ...], str, int]
"""Event descriptors, guard and target of a transition."""


@st.composite
def charts(draw: st.DrawFn) -> list[list[Move]]:
    size = draw(st.integers(1, 3))
    descriptors = st.lists(st.sampled_from(["a", "a.b", "a.*", "c", "*"]), max_size=2).map(tuple)
    guards = st.sampled_from(["", "p", "q", "!p", "p && q", "p || !q", "true"])
    moves = st.tuples(descriptors, guards, st.integers(0, size - 1))
    return [draw(st.lists(moves, max_size=4)) for _ in range(size)]


def written(states: list[list[Move]]) -> str:
    text = ""
    for index, moves in enumerate(states):
        text += f'<state id="s{index}">'
        for events, guard, target in moves:
            cond = guard.replace("&", "&amp;")
            event = f' event="{" ".join(events)}"' if events else ""
            text += f'<transition{event} cond="{cond}" target="s{target}"/>'
        text += "</state>"
    return f'<scxml initial="s0">{text}</scxml>'


def taken(moves: list[Move], event: str | None, answers: dict[str, bool]) -> int | None:
    """SCXML 3.13: transitions without events first, then the first in document order."""
    for with_events in (False, True):
        for events, guard, target in moves:
            if bool(events) != with_events or not holds(guard, answers):
                continue
            if not with_events or (event and any(matches(d, event) for d in events)):
                return target
    return None


def matches(descriptor: str, event: str) -> bool:
    prefix = descriptor.removesuffix(".*")
    return prefix == "*" or event == prefix or event.startswith(f"{prefix}.")


def holds(guard: str, answers: dict[str, bool]) -> bool:
    text = guard.replace("&&", " and ").replace("||", " or ").replace("!", " not ")
    return not text or eval(text.replace("true", "True"), {}, dict(answers))


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (
            '<state id="a"><transition target="b"/><parallel id="b"/></state>',
            "`b` is a parallel state",
        ),
        (
            '<state id="a"><transition target="d"/></state>'
            '<state id="b"><parallel><state id="d"/></parallel></state>',
            "state `d` is inside a <parallel>: it is active together with others",
        ),
        (
            '<parallel id="a"><state id="b"><transition event="e" target="a"/></state>'
            '<state id="c"/></parallel>',
            "a transition to `a`, into all regions at once, is not carried over",
        ),
    ],
)
def test_a_parallel_state_is_not_said_to_be_missing(
    body: str, told: str, workshop: Workshop
) -> None:
    made = workshop.scxml(f'<scxml version="1.0">{body}</scxml>')
    assert made.text == ""
    assert {d.code for d in made.diagnostics if d.severity == "error"} == {"E0803"}
    assert told in [d.message for d in made.diagnostics]


@pytest.mark.parametrize("examples", examples(6, 60))
def test_rows_do_what_an_interpreter_of_charts_does(examples: int, workshop: Workshop) -> None:
    @settings(max_examples=examples, deadline=None)
    @given(charts())
    def agree(states: list[list[Move]]) -> None:
        rows_do_what_an_interpreter_of_charts_does(states, workshop)

    agree()


def rows_do_what_an_interpreter_of_charts_does(
    states: list[list[Move]], workshop: Workshop
) -> None:
    found = workshop.compile(workshop.scxml(written(states)))
    machine = chart(found)
    assert not {"E0601", "E0602", "E0603"} & {d.code for d in found.diagnostics}
    port = machine.port("x", "outside")
    names = {e.name for e in port.elements} if port else set()
    members = next((e.type.members for e in port.elements if e.name == "event"), ()) if port else ()
    for event, p, q in product([None, *EVENTS, "z"], (False, True), (False, True)):
        member = None if event is None else event.replace(".", "_")
        if member is not None and member not in members:
            # An event that is not named is one that a prefix covers, or any other.
            covering = event.split(".")[0] if event else ""
            member = covering if covering in members else "any_other"
            if member not in members:
                member = None
        inputs = {("outside", "p"): p, ("outside", "q"): q, ("outside", "event"): member}
        fresh = {("outside", "event")} if member is not None else set()
        for index, moves in enumerate(states):
            expected = taken(moves, event, {"p": p, "q": q})
            assert run(machine, f"s{index}", inputs, fresh) == (
                None if expected is None else f"s{expected}"
            ), (names, event, p, q)


def run(machine: Subsystem, state: str, inputs: dict, fresh: set) -> str | None:
    """The state after one period, or None if the behaviour does not end."""

    def true(expr: Expr) -> bool:
        return bool(evaluate(expr, environment))

    environment = Environment(inputs=inputs, fresh=fresh, present=fresh)
    for let in machine.lets:
        environment.lets[let.name] = evaluate(let.value, environment)
    if not true(machine.state(state).behaviour.terminal.when):
        return None
    (row,) = [r for r in machine.transitions if r.source == state and true(r.condition.when)]
    return row.target
