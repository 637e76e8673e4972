"""The keys of a terminal operate the panel; the terminal is as it was afterwards."""

from __future__ import annotations

import json
import os
import pty
import random
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.clock import WallClock
from specc_runtime.keys import Keys, keys_of, legend
from specc_runtime.loading import load_system
from specc_runtime.options import UsageError
from specc_runtime.panel import Panel, PanelElement

from tests.runtime.apart import built, misdeed
from tests.runtime.desk import ENABLE, MODE, PRESSED, SPEC, START, STOP, N, V
from tests.seeds import blocks, short

UP, DOWN = "\x1b[A", "\x1bOB"
OTHERS = "\x1b[15~", "\x1b[1;5C", "\x1b", "ü", "?"


@pytest.fixture(scope="module")
def elements(tmp_path_factory: pytest.TempPathFactory) -> Sequence[PanelElement]:
    package = built(tmp_path_factory.mktemp("desk"), PRESSED)
    return load_system(package, package.parent.parent).panel


def of(name: str, key: str = "") -> PanelElement:
    return PanelElement(f"a.R.b.{name}", "button", key=key)


def test_keys_are_those_that_are_said_or_free_ones(elements: Sequence[PanelElement]) -> None:
    keys = {key: element.name for key, element in keys_of(elements).items()}
    assert keys == {"s": START, "e": ENABLE, "t": STOP, "v": V, "m": MODE, "n": N}
    several = [of("go"), of("g", "g"), of("o", "+"), of("g2"), of("gg"), of("x_1")]
    assert [*keys_of(several)] == ["o", "g", "+", "2", "a", "x"]
    many = [of(f"_{number}") for number in range(62)]
    assert len(keys_of(many)) == 62
    with pytest.raises(UsageError, match=r"no keys left for a\.R\.b\.more"):
        keys_of([*many, of("more")])


def test_what_is_held_has_no_key(elements: Sequence[PanelElement]) -> None:
    held = [replace(elements[0], hold=True), elements[1], replace(elements[2], hold=True)]
    with pytest.raises(UsageError) as refused:
        keys_of(held)
    assert str(refused.value).startswith(f"--keys: {held[0].name}, {held[2].name} has to be held, ")
    with pytest.raises(UsageError, match="there is no panel"):
        keys_of([])


def test_the_legend_tells_what_each_key_does(elements: Sequence[PanelElement]) -> None:
    panel = Panel([replace(elements[0], title="Start"), *elements[1:]], WallClock())
    panel.values[STOP] = True
    assert list(legend(keys_of([*panel.elements.values()]), panel.values)) == [
        "keys operate the panel:",
        f"  s  presses {START} (Start)",
        f"  e  presses {ENABLE}",
        f"  t  switches {STOP}: on",
        f"  v  chooses {V}: 0 to 0.2 m/s in steps of 0.01; 0.1 m/s",
        f"  m  {MODE}: the next of manual, auto; manual",
        f"  n  chooses {N}: 0 to 10 in steps of 1; 1",
        "  arrows up and down change the number that was chosen last",
    ]


def test_keys_operate_elements_of_every_kind(elements: Sequence[PanelElement]) -> None:
    panel = Panel(elements, WallClock())
    keys = Keys(panel, keys_of(elements), quiet=True)
    keys.take(UP + "sS" + "ttt" + "mmm" + "v" + UP + UP + "n" + DOWN + DOWN + "".join(OTHERS))
    made = [(each.element, each.value) for each in panel.begin(7)]
    assert [value for name, value in made if name == V] == pytest.approx([0.11, 0.12])
    assert [(name, value) for name, value in made if name != V] == [
        (START, True),
        *((STOP, value) for value in (True, False, True)),
        *((MODE, value) for value in ("auto", "manual", "auto")),
        *((N, value) for value in (0, 0)),
    ]
    assert {each.by for each in panel.operations} == {"keys"}
    keys.close()


@pytest.mark.parametrize("seeds", blocks(range(5), long=50, each=25))
def test_it_does_not_matter_how_keys_are_read(
    elements: Sequence[PanelElement], seeds: Sequence[int]
) -> None:
    """Whole, or in parts; values stay in their range and on their steps."""
    for seed in seeds:
        random_ = random.Random(seed)
        text = "".join(random_.choices(["s", "t", "v", "m", "n", UP, UP, DOWN, *OTHERS[:2]], k=99))
        panels = [Panel(elements, WallClock()) for _ in range(2)]
        whole, parts = (Keys(panel, keys_of(elements), quiet=True) for panel in panels)
        whole.take(text)
        while text:
            length = random_.randint(1, 4)
            parts.take(text[:length])
            text = text[length:]
            if random_.random() < 0.3:
                panels[1].begin(0)
        for panel in panels:
            panel.begin(1)
        assert panels[0].values == panels[1].values == panels[0].requests
        made = [[(each.element, each.value) for each in panel.operations] for panel in panels]
        assert made[0] == made[1]
        for name, value in made[0]:
            assert panels[0].elements[name].checked(value) == value
            if name == V:
                assert 100 * float(value) == pytest.approx(round(100 * float(value)))
        for keys in (whole, parts):
            keys.close()


class Terminal:
    """A run in a terminal of its own."""

    def __init__(self, *command: object) -> None:
        self.process, self.terminal = pty.fork()
        if not self.process:
            os.environ["OPENBLAS_NUM_THREADS"] = "1"
            os.execv(sys.executable, [sys.executable, *map(str, command)])
        self.text = ""

    @property
    def is_canonical(self) -> bool:
        """Whether the terminal waits for lines, and shows what is typed."""
        local = termios.tcgetattr(self.terminal)[3]
        flags = bool(local & termios.ICANON), bool(local & termios.ECHO)
        assert flags[0] == flags[1]
        return flags[0]

    def type(self, text: str) -> None:
        os.write(self.terminal, text.encode())

    def until(self, *texts: str, timeout_s: float = 30.0) -> None:
        """Read until all these have been shown."""
        end_s = time.monotonic() + timeout_s
        while not all(text in self.text for text in texts):
            assert time.monotonic() < end_s, self.text[-2000:]
            self._read(0.2)

    def _read(self, wait_s: float) -> bool:
        if not select.select([self.terminal], [], [], wait_s)[0]:
            return True
        try:
            data = os.read(self.terminal, 4096)
        except OSError:  # nobody writes any more
            return False
        self.text += data.decode(errors="replace")
        return True

    def end(self, timeout_s: float = 30.0) -> int:
        """The exit code."""
        end_s = time.monotonic() + timeout_s
        while self._read(0.05):
            assert time.monotonic() < end_s, self.text
        return os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Callable[..., Terminal]]:
    """What begins a run in a terminal, with a report beside the specification."""
    runs = []

    def begin(text: str, *options: object) -> Terminal:
        spec = tmp_path / "desk.yaml"
        spec.write_text(text)
        report = "--report", tmp_path / "report.json"
        runs.append(Terminal("-m", "specc", "run", spec, "--keys", *report, *options))
        return runs[-1]

    yield begin
    for run in runs:
        os.close(run.terminal)


def report_in(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "report.json").read_text()))


READY = "arrows up and down change"


@pytest.mark.parametrize("pace", short([[], ["--real-time"]], 0))
def test_keys_operate_a_run_until_ctrl_c(
    terminal: Callable[..., Terminal], tmp_path: Path, pace: Sequence[str]
) -> None:
    run = terminal(PRESSED, "--duration", 600, *pace)
    assert run.is_canonical
    run.until(READY)
    run.type("s" + "v" + UP + "m")
    run.until(f"{START}: pressed", f"{V}: 0.11 m/s", f"{MODE}: auto", "running")
    assert not run.is_canonical
    time.sleep(0.3)
    run.type("\x03")
    assert run.end() == 130, run.text
    assert run.is_canonical
    report = report_in(tmp_path)
    made = [(each["element"], each["value"], each["by"]) for each in report["panel"]]
    assert made == [(START, True, "keys"), (V, pytest.approx(0.11), "keys"), (MODE, "auto", "keys")]
    assert 0.5 < report["real_time_factor"] < 1.01, "it goes as the clock does"


@pytest.mark.long
def test_the_terminal_is_restored_after_a_fault(terminal: Callable[..., Terminal]) -> None:
    assume = "        assume: [{that: x.R.n < 3, because: of the test}]\n        behaviours:"
    run = terminal(PRESSED.replace("        behaviours:", assume, 1), "--duration", 600)
    run.until(READY)
    run.type("n" + 3 * UP)
    assert run.end() == 1, run.text
    assert "x.R.n < 3" in run.text
    assert run.is_canonical


@pytest.mark.long
def test_the_terminal_is_restored_when_a_run_is_over(terminal: Callable[..., Terminal]) -> None:
    run = terminal(PRESSED, "--duration", 0.5, "--speed", 10)
    run.until(READY)
    assert run.end() == 0, run.text
    assert run.is_canonical


@pytest.mark.parametrize("number", short([signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT]))
def test_the_terminal_is_restored_after_a_signal(
    terminal: Callable[..., Terminal], number: signal.Signals
) -> None:
    run = terminal(PRESSED, "--duration", 600)
    run.until(READY, "running")
    assert not run.is_canonical
    os.kill(run.process, number)
    assert run.end() == 128 + number, run.text
    assert run.is_canonical


@pytest.mark.long
def test_the_terminal_is_restored_if_a_step_never_ends(terminal: Callable[..., Terminal]) -> None:
    """Ctrl-C ends the process at last, whatever the operator catches."""
    act = 'operators: {ACT: {signature: "(n: int) -> int", python: "tests.runtime.misdeeds:act"}}\n'
    stuck = PRESSED.replace("agents:\n", f"{act}agents:\n", 1).replace(
        "x.R.v * 0.02[s] * x.R.n", "x.R.v * 0.02[s] * ACT(x.R.n + 20)"
    )
    with misdeed("persist"):
        run = terminal(stuck, "--duration", 600)
    run.until(READY)
    run.type("e")
    time.sleep(1.0)
    run.type("\x03")
    assert run.end() == 130, run.text
    assert run.is_canonical


@pytest.mark.long
def test_what_is_held_is_refused(terminal: Callable[..., Terminal]) -> None:
    run = terminal(SPEC)
    assert run.end() == 2
    assert f"error: --keys: {ENABLE} has to be held, " in run.text.replace("\r\n", " ")
    assert run.is_canonical


@pytest.mark.parametrize("standard_input", short([subprocess.DEVNULL, subprocess.PIPE], 0))
def test_what_is_no_terminal_is_refused(standard_input: int, tmp_path: Path) -> None:
    (tmp_path / "desk.yaml").write_text(PRESSED)
    command = [sys.executable, "-m", "specc", "run", tmp_path / "desk.yaml", "--keys"]
    found = subprocess.run(
        command, stdin=standard_input, capture_output=True, text=True, check=False
    )
    assert found.returncode == 2
    assert "error: --keys: standard input is no terminal; " in found.stderr
