"""Subsystem definitions of FABRIC as specifications."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

from specc.model.system import Subsystem
from specc.pipeline import Result, build
from specc.tools.importers import Notes, import_fabric
from tests.tools.importers.conftest import FILES, Workshop

PRESS, RAM = str(FILES / "press.xml"), str(FILES / "ram.xml")
Codes = Callable[[Notes | Result], list[str]]


def control(result: Result, agent: str) -> Subsystem:
    assert result.system is not None
    return next(s for s in result.system.subsystems if s.qualified_name == f"{agent}.c")


def rows(subsystem: Subsystem) -> list[tuple[str, str, str, str]]:
    return [(r.source, r.cause, r.condition.name, r.target) for r in subsystem.transitions]


def test_a_sound_definition_validates_and_builds(workshop: Workshop) -> None:
    made = import_fabric([PRESS])
    assert workshop.compile(made).diagnostics == ()
    built = build(str(workshop.folder / "made.yaml"))
    assert built.system == "press"
    assert "press_c.py" in built.files


def test_machine(workshop: Workshop) -> None:
    press = control(workshop.compile(import_fabric([PRESS])), "press")
    assert press.initial_state == "waiting"
    assert press.rate_hz == 500
    assert rows(press) == [
        ("waiting", "terminal", "always", "pressing"),
        ("pressing", "error", "always", "waiting"),
        ("pressing", "terminal", "not_gotOrder", "waiting"),
        ("pressing", "terminal", "gotOrder", "pressing"),
    ]


def test_behaviours_of_a_state_end_together(workshop: Workshop) -> None:
    from specc.lang import show

    press = control(workshop.compile(import_fabric([PRESS])), "press")
    behaviour = press.state("pressing").behaviour
    assert behaviour.name == "watch_and_press"
    assert show(behaviour.terminal.when) == "gotStop"
    assert show(behaviour.ending("error").when) == "not CURRENT_BEHAVIOR_OK or not statusValid"
    targets = {a.target for a in behaviour.assignments}
    assert targets == {"components", "y.press_bottom.ram_cmd", "y.press_top.report"}


def test_predicates_are_operators_on_what_was_read(workshop: Workshop) -> None:
    system = workshop.compile(import_fabric([PRESS])).system
    assert system is not None
    predicate = system.operator("press_gotOrder")
    assert [str(type) for _, type in predicate.parameters] == [
        "press_InputData",
        "press_Components",
    ]
    assert str(predicate.result) == "bool"
    assert predicate.python == "press_parts:gotOrder"
    gathered = system.operator("press_input_data")
    assert [name for name, _ in gathered.parameters] == [
        "ram_st", "ram_st_new", "order", "order_new",
    ]  # fmt: skip


def test_nothing_is_lost_in_silence() -> None:
    made = import_fabric([PRESS])
    told = {d.message for d in made.diagnostics if d.code == "W0801"}
    for lost in ("`converter` of <out>", "<buffer_groups>", "`first_timeout`", "<simulation>"):
        assert any(lost in message for message in told), lost
    head = made.text.partition("specc: 1")[0]
    flat = re.sub(r"\s+", " ", head.replace("#", " "))
    for diagnostic in made.diagnostics:
        line = made.sources.span(diagnostic.primary).line
        assert f"{diagnostic.code} press.xml:{line}: {diagnostic.message}" in flat


@pytest.mark.parametrize(
    ("inserted", "told"),
    [
        ('<state name="waiting" priority="3">', "attribute `priority` of <state>"),
        ('<hook run="x"/><state name="waiting">', "<hook>"),
        ('<state name="waiting"><timer s="1"/>', "<timer>"),
    ],
)
def test_what_is_not_known_is_told(inserted: str, told: str, workshop: Workshop) -> None:
    text = (FILES / "press.xml").read_text().replace('<state name="waiting">', inserted)
    made = workshop.fabric(text)
    assert any(d.code == "W0801" and d.message.startswith(told) for d in made.diagnostics)
    assert workshop.compile(made).diagnostics == ()


def test_faults_of_a_definition_are_found_for_the_right_reason(
    workshop: Workshop, codes: Codes
) -> None:
    found = workshop.compile(import_fabric([RAM]))
    assert codes(found) == ["E0602", "E0603"]
    overlap, missing = sorted(found.diagnostics, key=lambda d: d.code)
    assert "state `holding`" in overlap.message
    assert "ram_cmdValid(input_data, components)` is true" in overlap.message
    assert "state `moving` has no row for its error condition" in missing.message


def test_the_only_cause_of_an_end_is_named(workshop: Workshop) -> None:
    """A predicate that no row asks can be all that ends a state."""
    text = (FILES / "ram.xml").read_text()
    text = text.replace('stop_cond="cmdValid or jammed"', 'stop_cond="cmdValid or inSelfCollision"')
    text = text.replace('init_cond="jammed"', 'init_cond="FALSE"')
    text = text.replace("<predicates>", '<predicates><predicate name="inSelfCollision"/>')
    found = workshop.compile(workshop.fabric(text))
    (gap,) = [d for d in found.diagnostics if d.code == "E0601"]
    assert "cmdValid(input_data, components)` is false and" in gap.message
    assert "inSelfCollision(input_data, components)` is true" in gap.message


def test_assumptions_can_be_added_by_hand(workshop: Workshop, codes: Codes) -> None:
    made = import_fabric([RAM])
    assumed = "assume: [{that: not (cmdValid and jammed), because: a jam voids the command}]"
    text = made.text.replace("      transitions:", f"      {assumed}\n      transitions:", 1)
    assert codes(workshop.compile(Notes(made.sources, text=text))) == ["E0603"]


def test_one_period_is_taken_from_either_form_of_the_format(workshop: Workshop) -> None:
    assert control(workshop.compile(import_fabric([RAM])), "ram").rate_hz == 1000
    given = import_fabric([RAM], period=Fraction("0.0125"))
    assert control(workshop.compile(given), "ram").rate_hz == 80


def test_different_periods_and_none_are_told(workshop: Workshop) -> None:
    text = (FILES / "press.xml").read_text()
    slower = workshop.fabric(text.replace("0.002", "0.01", 1))
    assert any("state `waiting` has another one" in d.message for d in slower.diagnostics)
    assert control(workshop.compile(slower), "unit").rate_hz == 500
    without = workshop.fabric(re.sub(r'min_period="[^"]*"', 'min_period="0"', text))
    assert any("1 ms is assumed" in d.message for d in without.diagnostics)


def test_evident_connections_are_made(workshop: Workshop, codes: Codes) -> None:
    made = import_fabric([PRESS, RAM], name="cell")
    found = workshop.compile(made)
    assert codes(found) == ["E0602", "E0603"]
    assert found.system is not None
    assert [a.name for a in found.system.agents] == ["press", "press_top", "ram"]
    port = control(found, "ram").port("x", "press")
    assert port is not None
    assert [(e.name, e.title) for e in port.elements] == [("ram_cmd", "up_cmd")]


def test_connections_that_are_not_evident_are_asked_for(workshop: Workshop) -> None:
    text = (FILES / "press.xml").read_text()
    double = '<in alias="ram_st2" type="ram_msgs::Status" side="bottom"/></buffers>'
    path = workshop.folder / "press.xml"
    path.write_text(text.replace("</buffers>", double))
    made = import_fabric([str(path), RAM])
    unclear = [d for d in made.diagnostics if "could be connected" in d.message]
    assert {d.message.split("`")[1] for d in unclear} == {
        "press.ram_st", "press.ram_st2", "ram.up_st",
    }  # fmt: skip
    wire = (("press", "ram_st2"), ("ram", "up_st"))
    settled = import_fabric([str(path), RAM], wires=[wire])
    assert not [d for d in settled.diagnostics if "could be connected" in d.message]
    found = workshop.compile(settled)
    port = control(found, "press").port("x", "ram")
    assert port is not None
    assert [e.name for e in port.elements] == ["up_st"]


def test_buffers_of_one_name_are_connected_though_others_would_fit(workshop: Workshop) -> None:
    text = (FILES / "press.xml").read_text().replace('alias="ram_st"', 'alias="up_st"')
    double = '<in alias="ram_st2" type="ram_msgs::Status" side="bottom"/></buffers>'
    path = workshop.folder / "press.xml"
    path.write_text(text.replace("</buffers>", double).replace('"ram_st"', '"up_st"'))
    made = import_fabric([str(path), RAM])
    assert not [d for d in made.diagnostics if "could be connected" in d.message]
    found = workshop.compile(made)
    assert [e.name for e in control(found, "press").port("x", "ram").elements] == ["up_st"]
    assert "ram_st2" in [e.name for e in control(found, "press").port("x", "press_bottom").elements]


def test_an_output_that_several_subsystems_read(workshop: Workshop) -> None:
    press = (FILES / "press.xml").read_text()
    ram = (FILES / "ram.xml").read_text().replace('"up_cmd"', '"ram_cmd"')
    paths = {name: workshop.folder / f"{name}.xml" for name in ("press", "r1", "r2")}
    for name, text in (("press", press), ("r1", ram), ("r2", ram)):
        paths[name].write_text(text)
    made = import_fabric([str(path) for path in paths.values()])
    assert not [d for d in made.diagnostics if "`press.ram_cmd` could be" in d.message]
    found = workshop.compile(made)
    for name in ("r1", "r2"):
        assert [e.name for e in control(found, "press").port("y", name).elements] == ["ram_cmd"]
        assert [e.name for e in control(found, name).port("x", "press").elements] == ["ram_cmd"]
    wires = [(("press", "ram_cmd"), (name, "ram_cmd")) for name in ("r1", "r2")]
    asked = import_fabric([str(path) for path in paths.values()], wires=wires)
    assert "agents" in asked.text
    twice = import_fabric([str(path) for path in paths.values()], wires=[wires[0], wires[0]])
    assert [d.code for d in twice.diagnostics if d.severity == "error"] == ["E0803"]


def test_what_is_left_after_a_connection_is_connected(workshop: Workshop) -> None:
    """Two rams under two presses: once one pair has its name, the other has no choice."""
    press, ram = ((FILES / name).read_text() for name in ("press.xml", "ram.xml"))
    paths = {name: workshop.folder / f"{name}.xml" for name in ("p1", "p2", "r1", "r2")}
    for name, text in (("p1", press), ("p2", press), ("r1", ram), ("r2", ram)):
        paths[name].write_text(text)
    paths["r1"].write_text(ram.replace("up_st", "ram_st"))
    made = import_fabric(
        [str(path) for path in paths.values()], wires=[(("p1", "ram_st"), ("r1", "ram_st"))]
    )
    unclear = [d.message for d in made.diagnostics if "could be connected" in d.message]
    assert not [message for message in unclear if "`p2.ram_st`" in message]
    port = control(workshop.compile(made), "p2").port("x", "r2")
    assert port is not None
    assert [e.name for e in port.elements] == ["up_st"]


def test_a_behaviour_that_no_state_executes_is_told(workshop: Workshop, codes: Codes) -> None:
    text = (FILES / "press.xml").read_text()
    unused = '<behavior name="rest" stop_cond="gotStop" err_cond="FALSE"/></behaviors>'
    made = workshop.fabric(text.replace("</behaviors>", unused))
    (told,) = [d for d in made.diagnostics if "`rest`" in d.message]
    assert (told.code, told.message) == (
        "W0801",
        "behavior `rest` is not carried over: no state executes it",
    )
    assert codes(workshop.compile(made)) == []
    assert "`rest`" in made.text.partition("specc: 1")[0]


@pytest.mark.parametrize(
    ("wire", "code"),
    [
        ((("press", "nothing"), ("ram", "up_st")), "E0803"),
        ((("press", "order"), ("ram", "up_st")), "E0803"),
        ((("press", "ram_cmd"), ("ram", "up_st")), "E0803"),
    ],
)
def test_connections_that_cannot_be_are_refused(wire: Any, code: str) -> None:
    made = import_fabric([PRESS, RAM], wires=[wire])
    assert made.text == ""
    assert made.diagnostics[-1].code == code


BROKEN = [
    ('name="gotStop"', 'name="gotOrder"', "E0803", "predicate `gotOrder` is there twice"),
    ('name="pressing" init_cond="TRUE"', 'name="gone" init_cond="TRUE"', "E0803", "state `gone`"),
    ('<behavior name="press"/>', '<behavior name="gone"/>', "E0803", "behavior `gone`"),
    ("statusValid and gotOrder", "statusValid and gone", "E0803", "predicate `gone`"),
    ("statusValid and gotOrder", "statusValid and", "E0803", "ends where"),
    ("statusValid and gotOrder", "statusValid IN_ERROR", "E0803", "predicate"),
    ('stop_cond="gotStop"', 'stop_cond="IN_ERROR"', "E0803", "known only in `init_cond`"),
    ('stop_cond="gotStop"', "", "E0803", "needs the attribute `stop_cond`"),
    ('initial="waiting"', 'initial="gone"', "E0803", "state `gone`"),
    ('initial="waiting"', "", "E0803", "attribute `initial`"),
    ('side="top"', 'side="left"', "E0803", "`left` is not a side"),
    ("ram_msgs::Status", "Status", "E0803", "`Status` is not a type"),
    ('alias="order"', 'alias="my order"', "E0803", "`my order` is not a name"),
    ('name="order"/>', 'name="gone"/>', "E0803", "input buffer `gone`"),
    ('min_period="0.002"', 'min_period="soon"', "E0803", "`soon` is not a time"),
    ('min_period="0.002"', 'min_period="1/0"', "E0803", "`1/0` is not a time"),
    ('min_period="0.002"', 'min_period="1e999999999"', "E0803", "`1e999999999` is not a time"),
    ('min_period="0.002"', 'min_period="nan"', "E0803", "`nan` is not a time"),
    ("<predicates>", "<predicates/><predicates>", "E0803", "<predicates> is there twice"),
]


@pytest.mark.parametrize(("old", "new", "code", "words"), BROKEN)
def test_broken_definitions_are_refused_at_the_place(
    old: str, new: str, code: str, words: str, workshop: Workshop
) -> None:
    original = (FILES / "press.xml").read_text()
    assert old in original
    count = -1 if "definition" in old else 1
    text = original.replace(old, new, count)
    made = workshop.fabric(text)
    assert made.text == ""
    errors = [d for d in made.diagnostics if d.severity == "error"]
    found = next(d for d in errors if d.code == code and words in d.message)
    changed = text.split("\n").index(next(a for a, b in _pairs(text, original) if a != b)) + 1
    line = made.sources.span(found.primary).line
    # A missing attribute is shown at its element, which may have begun a line earlier.
    assert changed - 1 <= line <= changed + 1 or not new


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<definition/>", "the file has no <subsystem_definition>"),
        ("<a><subsystem_definition/></a>", "the root is <a>, not <subsystem_definition>"),
    ],
)
def test_what_is_no_definition_is_refused(text: str, words: str, workshop: Workshop) -> None:
    made = workshop.fabric(text)
    assert [(d.code, d.message) for d in made.diagnostics] == [("E0803", words)]


def _pairs(a: str, b: str) -> list[tuple[str, str]]:
    return list(zip(a.split("\n"), b.split("\n"), strict=True))


def test_an_unknown_predicate_is_pointed_at_exactly(workshop: Workshop) -> None:
    text = (FILES / "press.xml").read_text().replace("(not gotOrder)", "(not gotLost)")
    made = workshop.fabric(text)
    place = made.diagnostics[0].primary
    assert text[place.start : place.end] == "gotLost"


def test_names_that_python_or_the_language_takes_are_changed_and_told(workshop: Workshop) -> None:
    text = (FILES / "press.xml").read_text()
    made = workshop.fabric(text.replace("waiting", "lambda").replace("gotOrder", "fresh"))
    assert workshop.compile(made).diagnostics == ()
    told = [d.message for d in made.diagnostics]
    assert "state `lambda` is called `n_lambda`" in told
    assert "predicate `fresh` is called `fresh_2`" in told


def test_an_arc_that_is_never_taken_is_told(workshop: Workshop, codes: Codes) -> None:
    text = (FILES / "press.xml").read_text()
    made = workshop.fabric(text.replace('init_cond="IN_ERROR"', 'init_cond="FALSE"', 1))
    assert any("`pressing` to `waiting` is never taken" in d.message for d in made.diagnostics)
    assert codes(workshop.compile(made)) == ["E0603"]
    useless = text.replace('init_cond="TRUE"', 'init_cond="IN_ERROR"')
    assert "W0604" in codes(workshop.compile(workshop.fabric(useless)))


def test_the_same_files_give_the_same_text() -> None:
    assert import_fabric([PRESS, RAM]).text == import_fabric([PRESS, RAM]).text


def test_the_name_of_a_subsystem_is_that_of_its_package(workshop: Workshop) -> None:
    folder = workshop.folder / "ram_unit" / "spec"
    folder.mkdir(parents=True)
    path = folder / "subsystem.xml"
    path.write_text((FILES / "ram.xml").read_text())
    assert "system: ram_unit\n" in import_fabric([str(path)]).text


def test_two_subsystems_of_one_name_are_refused(workshop: Workshop) -> None:
    other = workshop.folder / "ram.xml"
    other.write_text((FILES / "ram.xml").read_text())
    made = import_fabric([RAM, str(other)])
    assert [d.code for d in made.diagnostics] == ["E0803"]
