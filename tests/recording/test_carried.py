"""What a run that goes on takes over from a recording, whatever its types are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from specc_runtime.recording import budget, snapshots

from tests.recording.runs import messages, report_of, specc
from tests.runtime.test_disturbances import MODEL, SPEC
from tests.seeds import every, short

SQUARES = """specc: 1.1
system: squares
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {n: int}}
      memory: {n: {type: int, init: 2}}
      behaviours: {square: {functions: [{n: n * n, y.b.n: n}], terminal: never}}
      states: {S0: square}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {n: int}}
      memory: {k: {type: int, init: 0}}
      behaviours: {keep: {functions: [{k: x.a.n if present(x.a.n) else k}], terminal: never}}
      states: {S0: keep}
      initial_state: S0
require:
"""


def required(that: str) -> str:
    """An entry of `require`."""
    return f'  - {{that: "{that}", because: test}}\n'


@pytest.mark.parametrize(
    ("that", "verdict", "margin", "shown"),
    short(
        [
            ("always(a.c.n > 1)", "met", 3.0, {}),
            (f"always(a.c.n < {10**30})", "violated", None, {"a.c.n": str(2**128)}),
            ("always(a.c.n < 5)", "violated", None, {"a.c.n": 16}),
            ("within(1[s], a.c.n > 1000)", "met", None, {}),
        ],
        0,
        1,
    ),
)
def test_whole_numbers_of_any_size(
    that: str, verdict: str, margin: float | None, shown: dict[str, object], tmp_path: Path
) -> None:
    spec, file = tmp_path / "squares.yaml", tmp_path / "run.mcap"
    spec.write_text(SQUARES + required(that))
    whole = ("run", spec, "--duration", 2, "--report")
    first = specc(*whole, tmp_path / "a.json", "--record", file)
    assert first.returncode == (verdict == "violated"), first.stderr
    told = report_of(tmp_path / "a.json")
    entry = told["requirements"][0]
    assert (entry["verdict"], entry["margin"], entry["values"]) == (verdict, margin, shown)
    again, more = tmp_path / "again.mcap", ("--record-exact", "--record")
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@1.5", *more, again)
    assert done.returncode == first.returncode and "--from" not in done.stderr, done.stderr
    assert report_of(tmp_path / "b.json") == told
    for recorded in (file, again):
        replayed = specc("replay", recorded, "--spec", spec)
        assert f"{verdict} {that}" in replayed.stdout, replayed.stderr
        assert "differs" not in replayed.stdout


OPERATORS = """from dataclasses import dataclass
from specc_runtime.plant import NO_SAMPLE

@dataclass(frozen=True)
class T:
    n: int

@dataclass(frozen=True)
class Pair:
    n: int
    t: T

def make(n): return T(n)
def pair(n): return Pair(n, T(n))
def number(t): return t.n % 100
def pairs(p): return p.n + p.t.n
def odd(n): return T(n) if n % 2 else None
def many(n): return tuple(T(i) for i in range(n % 4))
def total(ts): return sum(t.n for t in ts)
def some(t): return 0 if t is None else t.n % 3

class World:
    def reset(self, seed): self.count = self.last = 0
    def actuate(self, name, value): self.last = value if isinstance(value, int) else value.n
    def advance(self, duration_s): self.count += 1
    def close(self): pass
    def saved(self): return [self.count, self.last]
    def restore(self, saved): self.count, self.last = saved
    def sample(self, name):
        if name.endswith("seldom"):
            return NO_SAMPLE if self.count % 7 else T(self.count)
        return T(self.count + self.last)
"""
TYPES = """specc: 1.1
system: typed
types:
  T: {opaque: true, python: "own:T"}
  Pair: {fields: {n: int, t: T}, python: "own:Pair"}
operators:
  make: {signature: "(n: int) -> T", python: "own:make"}
  pair: {signature: "(n: int) -> Pair", python: "own:pair"}
  number: {signature: "(t: T) -> int", python: "own:number"}
  pairs: {signature: "(p: Pair) -> int", python: "own:pairs"}
  odd: {signature: "(n: int) -> optional[T]", python: "own:odd"}
  many: {signature: "(n: int) -> list[T]", python: "own:many"}
  total: {signature: "(ts: list[T]) -> int", python: "own:total"}
  some: {signature: "(t: optional[T]) -> int", python: "own:some"}
constants: {step: 1}
plant:
  python: "own:World"
  bind: {"a.E.m.t": {}, "a.E.m.often": {rate: 5 Hz}, "a.E.m.seldom": {sporadic: true}}
agents:
  a:
    real_effectors: {m: {x: {t: T}, y: {often: T, seldom: T}}}
    virtual_effectors:
      m:
        rate: 20 Hz
        x: {c: {n: {type: int, init: 0}}, E: {often: T, seldom: T}}
        y: {E: {t: T}, c: {n: int}}
        functions: {f: {y.E.t: make(x.c.n), y.c.n: number(x.E.often) + number(x.E.seldom)}}
        behaviours: {work: {functions: [f], terminal: never}}
        states: {S0: work}
        initial_state: S0
    control:
      rate: 10 Hz
      x:
        m: {n: {type: int, init: 0}}
        b_1: {n: {type: int, init: 0}}
        b_2: {n: {type: int, init: 0}}
      y:
        m: {n: int}
        b_1: {p: Pair, o: "optional[T]", l: "list[T]"}
        b_2: {p: Pair, o: "optional[T]", l: "list[T]"}
      memory: {n: {type: int, init: 0}, t: {type: T, init: make(0)}}
      functions:
        count: {n: n + step + some(odd(x.b_1.n)), t: make(n), y.m.n: number(t) + x.m.n - x.b_2.n}
        tell: {y.b_1.p: pair(n), y.b_1.o: odd(n), y.b_1.l: many(n)}
        too: {y.b_2.p: pair(n), y.b_2.o: odd(n), y.b_2.l: many(n)}
      behaviours: {work: {functions: [count, tell, too], terminal: never}}
      states: {S0: work}
      initial_state: S0
  "b_{i}":
    for: {i: 1..2}
    control:
      rate: 5 Hz
      x: {a: {p: Pair, o: "optional[T]", l: "list[T]"}}
      y: {a: {n: int}}
      functions:
        f:
          y.a.n: >-
            pairs(x.a.p) + some(x.a.o) + total(x.a.l)
            if fresh(x.a.p) and present(x.a.o) and present(x.a.l) else 0
      behaviours: {work: {functions: [f], terminal: never}}
      states: {S0: work}
      initial_state: S0
require:
  - {that: "always(present(b_1.c.x.a.p) implies pairs(b_1.c.x.a.p) < 10000)", because: test}
  - {that: "always(present(a.E.m.t) implies number(a.E.m.t) >= 0)", because: test}
"""


@pytest.mark.no_replay(reason="a run that went on with opaque values has no snapshot to begin with")
@pytest.mark.parametrize("at", every(2, [1.43, 2.9]))
def test_a_specification_that_means_the_same_goes_on_as_the_recorded_one(
    at: float, tmp_path: Path
) -> None:
    (tmp_path / "own.py").write_text(OPERATORS)
    spec, file = tmp_path / "types.yaml", tmp_path / "run.mcap"
    spec.write_text(TYPES)
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    whole = ("run", spec, "--duration", 4, "--report")
    first = specc(*whole, tmp_path / "a.json", "--record", file, env=env)
    assert first.returncode == 0, first.stdout + first.stderr
    spec.write_text(f"# as before\n{TYPES}")
    more = ("--record", tmp_path / "b.mcap")
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at}", *more, env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    same = {"records_sha256": ""}  # it is that of other parts
    assert report_of(tmp_path / "b.json") | same == report_of(tmp_path / "a.json") | same
    before = messages(file)
    for topic, steps in messages(tmp_path / "b.mcap").items():
        told = [data for _, data in steps if "stamp" in data]
        assert told == [data for _, data in before[topic] if "stamp" in data][-len(told) :]
    assert "is as at the beginning" not in done.stderr and "not taken over" not in done.stderr
    spec.write_text(TYPES)
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at}", env=env)
    assert "the run is repeated from its start: a.E.m.seldom, a value of T" in done.stderr


LOOP = """specc: 1.1
system: loop
agents:
  a:
    control:
      rate: 10 Hz
      x: {b: {n: int}}
      y: {b: {n: int}}
      memory: {n: {type: int, init: 0}}
      functions: {f: {n: n + 1, y.b.n: n + (x.b.n if present(x.b.n) else 0)}}
      behaviours: {work: {functions: [f], terminal: never}}
      states: {S0: work}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {n: int}}
      y: {a: {n: int}}
      functions: {f: {y.a.n: "1 if present(x.a.n) and x.a.n > 3 else 0"}}
      behaviours: {work: {functions: [f], terminal: never}}
      states: {S0: work}
      initial_state: S0
require:
  - {that: "always(present(a.c.x.b.n) implies a.c.x.b.n >= 0)", because: test}
"""
REAL = LOOP.replace("{n: int}", "{n: real}")
MORE = LOOP.replace("x: {a: {n: int}}", "x: {a: {n: int, m: int}}").replace(
    "y: {b: {n: int}}", "y: {b: {n: int, m: int}}"
)
MORE = MORE.replace("{n: n + 1,", "{n: n + 1, y.b.m: n,")
ABSENT = MORE.replace("1 if", "x.a.m if present(x.a.m) and")
FRESH = LOOP.replace("1 if present", "1 if fresh")
SLOWER = LOOP.replace("10 Hz", "15 Hz")


@pytest.mark.parametrize(
    ("now", "words"),
    every(
        2,
        [
            (REAL, "b.c: input a.n is as at the beginning: 17 is no float"),
            (REAL, "the last value of a.n of b.c is not taken over: 1 is no float"),
            (ABSENT, "b.c: input a.m is as at the beginning: there was none"),
            (FRESH, "b.c: whether input a.n is fresh was not asked: it is not"),
            (SLOWER, "the specification goes on from 1.8 s"),
        ],
    ),
)
def test_inputs_that_cannot_be_taken_over_are_absent_and_told(
    now: str, words: str, tmp_path: Path
) -> None:
    spec, file = tmp_path / "loop.yaml", tmp_path / "run.mcap"
    spec.write_text(LOOP)
    assert specc("run", spec, "--duration", 3, "--record", file).returncode == 0
    spec.write_text(now)
    done = specc("run", spec, "--duration", 3, "--from", f"{file}@1.7")
    assert done.returncode in (0, 1) and "fault" not in done.stdout, done.stdout + done.stderr
    assert f"--from: {words}" in done.stderr


def test_another_base_tick_goes_on_from_a_snapshot_between_two_of_its_ticks(
    tmp_path: Path,
) -> None:
    """Its tick 10 is not the tick 10 of the recorded run, which cannot be run here."""
    (tmp_path / "own.py").write_text("def up(n): return n + 1\n")
    spec, file, again = (tmp_path / name for name in ("loop.yaml", "run.mcap", "again.mcap"))
    operators = 'operators: {UP: {signature: "(n: int) -> int", python: "own:up"}}\nagents:'
    spec.write_text(LOOP.replace("agents:", operators).replace("n: n + 1,", "n: UP(n),"))
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    assert specc("run", spec, "--duration", 3, "--record", file, env=env).returncode == 0
    spec.write_text(LOOP.replace("10 Hz", "9.3 Hz"))
    told = ("run", spec, "--duration", 3, "--record", again)
    done = specc(*told, "--from", f"{file}@1.5")
    assert done.returncode == 0, done.stderr
    assert "--from: agents go on from 1.07527 s: there is no base tick at 1 s" in done.stderr
    assert "--from: nothing is known of the past for: always(present(a.c" in done.stderr
    assert "a.c: 18 steps are the same" in specc("replay", again, "--spec", spec).stdout


def test_what_is_under_way_is_required_to_be_seen_when_it_is(tmp_path: Path) -> None:
    """Its sender is slower now, and so it is seen later than it would have been."""
    spec, file = tmp_path / "keep.yaml", tmp_path / "run.mcap"
    text = LOOP.replace(
        "y: {a: {n: int}}", "y: {a: {n: int}}\n      memory: {k: {type: int, init: 0}}"
    )
    text = text.replace("f: {y.a.n:", "f: {k: x.a.n if present(x.a.n) else k, y.a.n:")
    text = "rate: 100 Hz".join(text.rsplit("rate: 10 Hz", 1))
    text = text[: text.index("require:")] + "require:\n"
    text += required("always(present(b.c.x.a.n) implies b.c.k == b.c.x.a.n)")
    spec.write_text(text)
    assert specc("run", spec, "--duration", 3, "--record", file).returncode == 0
    spec.write_text(text.replace("rate: 10 Hz", "rate: 2.5 Hz"))
    done = specc("run", spec, "--duration", 3, "--from", f"{file}@1.05")
    assert done.returncode == 0 and "met always(" in done.stdout, done.stdout + done.stderr


def test_a_run_goes_on_until_its_end_and_not_from_behind_it(tmp_path: Path) -> None:
    spec, file = tmp_path / "loop.yaml", tmp_path / "run.mcap"
    spec.write_text(LOOP)
    assert specc("run", spec, "--duration", 3, "--record", file).returncode == 0
    done = specc("run", spec, "--duration", 3, "--from", f"{file}@2.95")
    assert done.returncode == 0, done.stderr
    done = specc("run", spec, "--duration", 1, "--from", f"{file}@2")
    assert done.returncode == 2 and "the run is over before 2 s, at 1 s: --cycles" in done.stderr


def test_devices_of_other_types_are_told(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OPERATORS)
    spec, file = tmp_path / "types.yaml", tmp_path / "run.mcap"
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    spec.write_text(TYPES)
    assert specc("run", spec, "--duration", 2, "--record", file, env=env).returncode == 0
    other = TYPES.replace("  Pair:", '  U: {opaque: true, python: "own:T"}\n  Pair:')
    for old, new in (
        ("x: {t: T}, y: {often: T, seldom: T}", "x: {t: U}, y: {often: T, seldom: U}"),
        ("E: {often: T, seldom: T}}", "E: {often: T, seldom: U}}"),
        ("y: {E: {t: T}", "y: {E: {t: U}"),
        ("y.E.t: make(", "y.E.t: made("),
        ("number(x.E.seldom)", "numbered(x.E.seldom)"),
        ("number(a.E.m.t)", "numbered(a.E.m.t)"),
    ):
        assert other.count(old) == 1
        other = other.replace(old, new)
    named = """operators:
  made: {signature: "(n: int) -> U", python: "own:make"}
  numbered: {signature: "(t: U) -> int", python: "own:number"}
"""
    spec.write_text(other.replace("operators:\n", named))
    done = specc("run", spec, "--duration", 2, "--from", f"{file}@1.5", env=env)
    told = done.stderr
    for name in ("a.E.m.t", "a.E.m.seldom"):
        assert f"the last value of {name} is not taken over: a value of T is none of U" in told
    assert "a.m: input E.seldom is as at the beginning" in told and "Traceback" not in told


@pytest.mark.long
def test_a_disturbance_from_the_start_on_that_is_gone_is_told(tmp_path: Path) -> None:
    (tmp_path / "cart.xml").write_text(MODEL)
    spec, file = tmp_path / "cart.yaml", tmp_path / "run.mcap"
    push = "{because: a push, at: '0[s]', lasts: '3[s]', push: {cart: ['5[N]', 0, 0]}}"
    spec.write_text(f"{SPEC}  disturb: [{push}]\n")
    assert specc("run", spec, "--duration", 2, "--record", file).returncode == 0
    spec.write_text(SPEC)
    done = specc("run", spec, "--duration", 2, "--from", f"{file}@1.5")
    assert done.returncode == 0, done.stderr
    assert "there is no such disturbance, which began in the past: push cart" in done.stderr


MAPS = """specc: 1.1
system: maps
types: {Map: {opaque: true, python: "own:Map", codec: {encode: "own:told", decode: "own:read"}}}
operators:
  draw: {signature: "(n: int) -> Map", python: "own:draw"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {n: int}}
      memory:
        n: {type: int, init: 0}
        first: {type: Map, init: draw(0)}
        last: {type: Map, init: draw(0)}
      functions: {f: {n: n + 1, last: draw(n), first: first, y.b.n: n}}
      behaviours: {work: {functions: [f], terminal: never}}
      states: {S0: work}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {n: int}}
      memory: {k: {type: int, init: 0}}
      behaviours: {keep: {functions: [{k: x.a.n if present(x.a.n) else k}], terminal: never}}
      states: {S0: keep}
      initial_state: S0
"""
MAP = """class Map:
    def __init__(self, n): self.n = n
def draw(n): return Map(n)
def told(drawn): return bytes([drawn.n % 256]) * 1000
def read(data): return Map(data[0])
"""


def test_of_what_is_aside_only_that_of_the_last_snapshot_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.py").write_text(MAP)
    spec, file = tmp_path / "maps.yaml", tmp_path / "run.mcap"
    spec.write_text(MAPS)
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = specc("run", spec, "--duration", 6, "--record", file, env=env)
    assert done.returncode == 0, done.stderr
    monkeypatch.setattr(budget, "_HELD_BYTES", -8 * file.stat().st_size + 40_000)
    kept = snapshots.last_before(file, 5.5)
    memory = kept.saved["subsystems"]["a.c"]["memory"]
    for name, number in (("first", 0), ("last", 49)):
        assert kept.shelf.packed("Map", memory[name]) == bytes([number]) * 1000
