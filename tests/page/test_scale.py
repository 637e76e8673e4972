"""Systems with many states, machines, marks and spans, and with names that JavaScript knows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.page.browser import Page
from tests.page.fake import fake_run
from tests.page.runs import ENDED, page_run

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

GATE = "specs/conveyor_gate.yaml"
SYSTEM = """\
specc: 1.3
system: odd
agents:
  {agents}
plant: {{bind: {{{bindings}}}}}
task: {{cycle: {{of: toString.c, from: constructor, to: __proto__}}}}
"""
AGENT = """\
{name}:
    real_receptors: {{desk: {{y: {{stop: bool}}, through: 10 Hz}}}}
    control:
      rate: 10 Hz
      x: {{desk: {{stop: {{type: bool, init: false}}}}}}
      memory: {{__proto__: {{type: int, init: 7}}}}
      conditions: {{terminal: {{late: "elapsed > 0.2[s] and not x.desk.stop and __proto__ == 7"}}}}
      behaviours: {{wait: {{terminal: late}}}}
      states: {{{states}}}
      initial_state: {first}
      transitions: [{rows}]
"""
ODD = ["constructor", "__proto__", "hasOwnProperty", "a" * 60]
MANY = [f"S{number}" for number in range(230)]
IN_PAGE = "import('/static/state.js').then(({{page, emit, take, Question}}) => {{ {} }})"


def agent(name: str, states: list[str]) -> str:
    after = [*states[1:], states[0]]
    rows = [f"[{one}, terminal, always, {next}]" for one, next in zip(states, after, strict=True)]
    texts = ", ".join(f"{state}: wait" for state in states), ", ".join(rows)
    return AGENT.format(name=name, states=texts[0], first=states[0], rows=texts[1])


def in_page(page: Page, script: str) -> Any:
    """What a script finds that knows the state of the page."""
    return page.evaluate(IN_PAGE.format(script))


def labels(page: Page, selector: str) -> list[str]:
    script = f"document.querySelectorAll('{selector}')"
    found = page.evaluate(
        f"JSON.stringify([...{script}].map(one => one.getAttribute('aria-label')))"
    )
    names: list[str] = json.loads(found)
    return names


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    path = tmp_path / "odd.yaml"
    names = ["toString", "many", *(f"m{number}" for number in range(38))]
    states = {"toString": ODD, "many": MANY}
    agents = "\n  ".join(agent(name, states.get(name, MANY[:2])) for name in names)
    bindings = ", ".join(f"{name}.R.desk.stop: {{panel: switch}}" for name in names)
    path.write_text(SYSTEM.format(agents=agents, bindings=bindings))
    return path


def test_many_states_without_a_picture_are_a_list(odd: Path, page: Page, tmp_path: Path) -> None:
    with page_run(tmp_path, "run", odd, "--ui", "--duration", 600) as run:
        page.size(1600, 1000)
        page.open(run.url)
        page.wait_for("document.querySelectorAll('.state-list .state').length == 230")
        page.wait_for("document.querySelector('.state-list .lit')?.textContent.startsWith('S')")
        assert page.evaluate("document.querySelectorAll('.state-list .lit').length") == 1
        assert "not legible" in page.evaluate("document.querySelector('#states').textContent")
        in_page(page, "page.send({type: 'pause'})")
        page.wait_for("document.getElementById('status').classList.contains('is-paused')")
        page.click(".state-list .state:nth-child(230)")
        page.wait_for("document.querySelector('.state-list .breakpoint')")
        assert labels(page, ".state-list .breakpoint") == ["state S229, breakpoint"]

        in_page(page, "page.choose('toString.c')")
        page.wait_for("document.querySelectorAll('#states svg .state').length == 4")
        lit = page.wait_for("document.querySelector('#states .state.lit')?.ariaLabel")
        state = in_page(page, "return page.now.states['toString.c'].state")
        assert state in ODD and lit == f"state {state}"
        page.wait_for(f"document.querySelector('.where b').textContent == '{state}'")
        assert page.errors() == []


def test_nothing_is_lit_where_no_state_is_known(page: Page, tmp_path: Path) -> None:
    with page_run(tmp_path, "run", GATE, "--ui", "--duration", 2) as run:
        page.open(run.url)
        page.wait_for("document.querySelector('#states .state.lit')")
        page.wait_for(ENDED)
        in_page(page, "delete page.shown.states[page.machine]; emit('shown')")
        assert page.evaluate("document.querySelectorAll('#states .lit').length") == 0


def test_a_long_run_does_not_fill_the_page(page: Page) -> None:
    with fake_run(GATE) as run:
        page.size(1600, 1000)
        page.open(run.url)
        page.wait_for(IN_PAGE.format("return Boolean(page.hello)"))
        run.state(3000.0)
        for begin in range(0, 6000, 500):
            times = [number / 2 for number in range(begin, begin + 500)]
            run.send(
                "marks", marks=[{"time_s": t, "kind": "cycle", "text": f"at {t}"} for t in times]
            )
            changes = [
                ["gate.c", t + part / 8, ("closed", "open")[part % 2], ""]
                for t in times
                for part in range(4)
            ]
            run.send("spans", changes=changes)
        counts = "return page.marks.length + ' ' + (page.spans['gate.c']?.length ?? 0)"
        last = "return page.spans['gate.c']?.at(-1)?.[0] == 2999.875"
        page.wait_for(IN_PAGE.format(last))
        assert in_page(page, counts) == "5000 20000"
        page.wait_for("document.querySelector('.mark')")
        found = labels(page, ".mark")
        assert len(found) < 1000
        hidden = sum(int(text.rpartition("\nand ")[2].split()[0]) for text in found if "\n" in text)
        assert len(found) + hidden == 5000


def test_a_lost_connection_answers_no_question(page: Page) -> None:
    script = """
        const sent = [];
        const send = page.send;
        page.send = (message) => sent.push(message.id);
        const question = new Question("why");
        question.ask({}), question.ask({});
        emit("connection");
        question.ask({}), question.ask({});
        page.send = send;
        return sent.join(" ");
    """
    with fake_run(GATE) as run:
        page.open(run.url)
        page.wait_for(IN_PAGE.format("return Boolean(page.hello)"))
        assert in_page(page, script) == "1 2"


def test_arrow_keys_go_around_the_rows_of_a_state(page: Page, tmp_path: Path) -> None:
    press = "document.activeElement.dispatchEvent(new KeyboardEvent('keydown', {key: 'KEY'}))"
    label = "document.activeElement.getAttribute('aria-label')"
    with page_run(tmp_path, "run", GATE, "--ui", "--duration", 2) as run:
        page.open(run.url)
        page.wait_for("document.querySelector('#states .state.lit')")
        page.evaluate("document.querySelector('#states [id$=-s-opening]').focus()")
        rows = []
        for key in ("ArrowLeft", "ArrowLeft", "ArrowRight", "Escape", "ArrowRight"):
            page.evaluate(press.replace("KEY", key))
            rows.append(page.evaluate(label))
        first, last = (
            "row opening terminal always -> passing",
            "row opening error always -> closing",
        )
        assert [text.split(",")[0] for text in rows] == [last, first, last, "state opening", first]


def test_a_recording_opens_where_it_went_wrong_once_that_is_read(page: Page) -> None:
    script = """
        const lists = ["machines", "signals", "requirements", "panel", "live", "constants"];
        const hello = Object.fromEntries(lists.map((name) => [name, []]));
        Object.assign(hello, { usual: [], cameras: [], poses: [], notice: [], bodies: [] });
        hello.can = {};
        take({ ...hello, type: "hello", source: "file", system: "s", title: "s", begin_s: 0 });
        const marks = [{ time_s: 2, kind: "fault", text: "it fell" }];
        take({ type: "now", time_s: 1, status: "ended", states: {}, poses: null });
        const before = page.cursor;
        take({ type: "marks", marks, replace: true });
        take({ type: "now", time_s: 3, status: "ended", states: {}, poses: null });
        const found = page.cursor;
        page.look(null);
        take({ type: "now", time_s: 3, status: "ended", states: {}, poses: null });
        return JSON.stringify([before, found, page.cursor]);
    """
    with fake_run(GATE, begins=False) as run:
        page.open(run.url)
        page.wait_for(IN_PAGE.format("return page.connected"))
        assert json.loads(in_page(page, script)) == [None, 2, None]
