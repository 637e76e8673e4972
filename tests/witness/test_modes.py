"""Scenarios of machines with modes: runs that wait for a mode's time, and that resume one."""

from __future__ import annotations

from pathlib import Path

import pytest
from specc_runtime.faults import UndecidedTransition

from tests.seeds import every
from tests.witness.runs import run, written

SPEC = """\
specc: 1.2
system: cell
agents:
  desk:
    control:
      rate: 20 Hz
      y: {arm: {n: int, seen: int}}
      memory: {n: {type: int, init: 0}}
      conditions: {terminal: {much: n > 1000}}
      functions: {count: {n: n + 1, y.arm.n: n}, tell: {y.arm.seen: n}}
      behaviours:
        count: {functions: [count], terminal: much}
        tell: {functions: [tell], terminal: never}
      states: {S0: count, S1: tell}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
  arm:
    control:
      rate: 20 Hz
      x: {desk: {n: {type: int, init: 0}, seen: int}}
      memory: {last: {type: int, init: 0}, times: {type: int, init: 0}}
      conditions:
        terminal: {half: "elapsed > 0.5[s]", low: x.desk.n < 0}
        initial: {lifted: "LIFTED", few: x.desk.n < 10}
      functions: {note: {last: SEEN}, count: {times: times + 1}}
      behaviours:
        wait: {terminal: low}
        move: {terminal: half}
        place: {functions: [note], terminal: half}
        pause: {functions: [count], terminal: always}
      states: {looking: wait, lifting: move, placing: place, paused: pause}
      modes:
        working:
          states: [looking, lifting, placing]
          initial: looking
          error: {tired: "elapsed(working) > 12[s]", pause: x.desk.n > 100}
      initial_state: working
      transitions:
        - [working, tired, TIRED, paused]
        - [working, pause, always, paused]
        - [looking, terminal, always, lifting]
        - [lifting, terminal, lifted, placing]
        - [placing, terminal, always, looking]
        - [paused, terminal, always, resume(working)]
"""


def scenario(
    tmp_path: Path, *options: str, lifted: str = "", tired: str = "always", seen: str = "0"
) -> tuple[str, Exception | None]:
    """The text of the one scenario that is written, and what it raises."""
    text = SPEC.replace("LIFTED", lifted or "times < 9").replace("TIRED", tired)
    text = text.replace("SEEN", seen)
    if not lifted:
        text = text.replace(
            "[lifting, terminal, lifted, placing]", "[lifting, terminal, always, placing]"
        )
    (tmp_path / "cell.yaml").write_text(text, encoding="utf-8")
    (one,) = written(tmp_path / "cell.yaml", tmp_path / "out", *options)
    return one.read_text("utf-8"), run(one, tmp_path)


def test_a_mode_is_resumed_on_the_way(tmp_path: Path) -> None:
    text, error = scenario(tmp_path, lifted="times != 1")
    assert "# paused terminal always -> " in text
    assert "set directly" not in text
    assert isinstance(error, UndecidedTransition)
    assert (error.state, error.cause, error.rows) == ("lifting", "terminal", ())


@pytest.mark.parametrize("state", every(3, ["looking", "lifting", "placing"]))
def test_the_time_of_a_mode_is_waited_for_where_that_is_possible(
    state: str, tmp_path: Path
) -> None:
    options = ("--code", "E0601", "--state", state)
    text, error = scenario(tmp_path, *options, tired="few")
    assert "set directly" not in text
    assert isinstance(error, UndecidedTransition)
    assert (error.state, error.cause, error.rows) == (state, "tired", ())


def test_what_has_not_come_is_read_in_a_mode(tmp_path: Path) -> None:
    text, error = scenario(tmp_path, seen="x.desk.seen")
    assert "set directly" not in text
    assert isinstance(error, AttributeError)
