"""All calls of a behaviour are one method, whose parameters are what the behaviour declares."""

from __future__ import annotations

from pathlib import Path

from specc.emit import fill_templates
from specc.lang import show
from specc.lower import lower
from specc.pipeline import compile_spec
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Interpreter
from tests.soundness.running import built, executed

SPEC = """\
specc: 1.2
system: calls
constants: {far: 99}
agents:
  one:
    control:
      rate: 10 Hz
      x: {two: {seen: int}}
      y: {two: {told: int}}
      memory: {n: {type: int, init: 3}, k: {type: int, init: 1}}
      let: {twice: 2 * n}
      functions:
        swap: {n: "min(k, 99)", k: "min(n, 99)"}
        put: {signature: "(a: int, b: int)", y.two.told: a, k: b if entered else k}
        add: {signature: "(by: int)", n: "min(n + by, 99)"}
      behaviours:
        go:
          signature: "(to: int, by: int)"
          title: Count to a number
          functions: [add(to), "put(a: to, b: by + k)"]
          terminal: {when: n > to}
          error: {when: "elapsed > 0.5[s]"}
        rest: {functions: [swap], terminal: always}
      states:
        first: "go(by: x.two.seen if present(x.two.seen) else n, to: far)"
        again: go(twice + k, 2)
        idle: rest
      initial_state: first
      transitions:
        - [first, terminal, always, idle]
        - [first, error, always, again]
        - [again, terminal, always, idle]
        - [again, error, always, idle]
        - [idle, terminal, always, first]
  two:
    control:
      rate: 10 Hz
      x: {one: {told: int}}
      y: {one: {seen: int}}
      memory: {m: {type: int, init: 1}}
      states:
        see:
          functions: [{y.one.seen: m, m: "min(m + 1, 9)"}]
          terminal: {when: present(x.one.told) and m > 5}
      initial_state: see
      transitions: [[see, terminal, always, see]]
"""
METHOD = '''\
    def _go(self, to: int, get_by: Callable[[], int]) -> None:
        """Count to a number."""
        y = self.y
        memory = self.memory
        y.two_told = to
        memory.k = get_by() + memory.k if self._periods == 0 else memory.k
        memory.n = min(memory.n + to, 99)
'''

COSTLY = """\
specc: 1.3
system: calls
operators: {f: {signature: "(k: int) -> int", python: "operators_of_calls:f"}}
agents:
  one:
    control:
      rate: 10 Hz
      x: {two: {told: {type: int, init: 0}}}
      memory: {n: {type: int, init: 0}, m: {type: int, init: 0}}
      functions:
        count:
          signature: "(k: int)"
          n: "min(k + k, 9) if x.two.told > 0 else 0"
          m: "min(k, 9) if x.two.told > 1 else 0"
      behaviours:
        go: {signature: "(k: int)", functions: [count(k)], terminal: {when: "k > 2"}}
      states: {first: go(f(n)), again: go(f(m) + f(n))}
      initial_state: first
      transitions: [[first, terminal, always, again], [again, terminal, always, first]]
  two:
    control: {rate: 10 Hz, y: {one: {told: int}}, through: {y.one.told: 1}}
"""


def test_a_costly_argument_is_computed_once(tmp_path: Path) -> None:
    path = tmp_path / "calls.yaml"
    path.write_text(COSTLY, encoding="utf-8")
    result = compile_spec(str(path))
    assert result.ok, result.diagnostics
    assert result.system is not None
    text = fill_templates(lower(result.system, result.proofs))["one_c.py"]
    assert "next_n = min(get_k() + get_k(), 9) if x.two_told > 0 else 0" in text
    given = [line.strip() for line in text.splitlines() if "self._go(" in line]
    assert "self._go(cache(lambda: f(memory.m) + f_2))" in given
    assert "self._go(cache(lambda: f(memory.n)))" in given


def test_calls_are_one_method(tmp_path: Path) -> None:
    path = tmp_path / "calls.yaml"
    path.write_text(SPEC, encoding="utf-8")
    result = compile_spec(str(path))
    assert result.ok, result.diagnostics
    assert result.system is not None
    text = fill_templates(lower(result.system, result.proofs))["one_c.py"]
    assert METHOD in text
    assert text.count("self._go(twice + memory.k, lambda: 2)") == 2
    assert text.count("  # go.error") == 2
    assert text.count("def _go") == 1

    def nothing(name: str, tick: int) -> object:
        raise AssertionError(name)

    expected = Interpreter(result.system, {}, nothing).run(60)
    assert {step.state for step in expected.steps["one.c"]} == {"first", "again", "idle"}
    for proofs in (None, result.proofs):
        with built(result.system, proofs) as made:
            assert differences(expected, executed(made, None, 60)) == []


HIDING = """\
specc: 1.3
system: calls
agents:
  one:
    control:
      rate: 10 Hz
      x: {two: {told: {type: int, init: 0}}}
      memory: {n: {type: int, init: 0}}
      behaviours:
        go:
          signature: "(k: int)"
          functions: [{n: "min(n + x.two.told, 20)"}]
          terminal: {when: "any(v >= k for v in [n, 5])"}
      states:
        up: "go(3 if any(v > 2 for v in [n, 1]) else 9)"
        down: {functions: [{n: 0}], terminal: always}
      initial_state: up
      transitions: [[up, terminal, always, down], [down, terminal, always, up]]
  two:
    control: {rate: 10 Hz, y: {one: {told: int}}, through: {y.one.told: 1}}
"""


def test_an_argument_hides_no_variable(tmp_path: Path) -> None:
    path = tmp_path / "calls.yaml"
    path.write_text(HIDING, encoding="utf-8")
    result = compile_spec(str(path))
    assert result.ok, result.diagnostics
    assert result.system is not None
    one = result.system.subsystems[0]
    ends = show(one.state("up").behaviour.terminal.when)
    assert ends == "any(v >= (3 if any(v_2 > 2 for v_2 in [n, 1]) else 9) for v in [n, 5])"
