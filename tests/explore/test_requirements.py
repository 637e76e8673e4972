"""What exploring says of requirements is what monitors of runs say."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import pytest
from mcap.reader import make_reader
from specc_runtime import temporal

from specc.cli import main
from specc.lang.kinds import kind
from specc.model import requirement as r
from specc.model.expr import TRUE
from specc.model.types import Type
from specc.pipeline import Result, compile_spec
from specc.source import Place
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import Monitor, TruthValue, UnsupportedFormulaError
from specc.tools.explore.verdicts import requirement_slices
from tests.explore.verdicts import misjudged, monitored
from tests.scenarios.runs import SPECS
from tests.seeds import Seeds, blocks, every, short
from tests.soundness.running import compiled
from tests.soundness.specifications import specification

CASES = sorted(Path(__file__).parent.glob("cases/required-*.yaml"))
TICKS = 60
FAILING = (5060, 5106, 5125, 54129658)
"""Seeds of systems in which what is required fails with a step, or after one has failed."""
DEAR = (1000, 1001, 5065)
"""Others that are tried whatever the fresh ones are."""
ORDER = {False: 0, None: 1, True: 2}


# The monitor of a graph against that of a run.


class Formulas:
    """Random formulas over two conditions, as the model and the runtime have them."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng
        self.values: list[TruthValue] = [True, True]
        self.order: list[int] = []

    def any(self, depth: int, *, ahead: bool = True) -> tuple[r.TemporalFormula, temporal.Formula]:
        rng = self.rng
        kind = rng.choice(["atom", "not", "and", "or", "ahead", "once", "historically", "since"])
        if not depth or kind == "atom":
            return self._atom(rng.randrange(2))
        if kind == "not":
            inner, follows = self.any(depth - 1, ahead=ahead)
            return r.BoolOp("not", (inner,)), temporal.Not(follows)
        if kind in ("and", "or"):
            (a, f), (b, g) = (self.any(depth - 1, ahead=ahead) for _ in range(2))
            made = temporal.And(f, g) if kind == "and" else temporal.Or(f, g)
            return r.BoolOp(kind, (a, b)), made  # type: ignore[arg-type]  # one of two
        if kind == "since":
            (a, f), (b, g) = (self.any(depth - 1, ahead=False) for _ in range(2))
            return r.Temporal("since", (a, b)), temporal.Since(f, g)
        ticks = rng.randrange(4)
        if kind == "ahead" and ahead:
            op: Any = rng.choice(["within", "throughout"])
        else:
            op = "once" if kind == "once" else "historically"
        inner, follows = self.any(depth - 1, ahead=ahead and op in ("within", "throughout"))
        return r.Temporal(op, (inner,), Fraction(ticks)), getattr(temporal, op.capitalize())(
            ticks, follows
        )

    def _atom(self, index: int) -> tuple[r.TemporalFormula, temporal.Formula]:
        self.order.append(index)

        def judge() -> temporal.Judgement:
            value = self.values[index]
            return temporal.UNKNOWN if value is None else temporal.judged(value)

        follows = temporal.Atom(judge)
        self.atoms = [*getattr(self, "atoms", []), follows]
        return r.TickCondition(TRUE), follows


def worst(said: list[TruthValue]) -> int:
    return min((ORDER[each] for each in said), default=2)


def test_monitors_say_what_those_of_runs_say() -> None:
    rng = Random(7)
    seen = set()
    for _ in range(400):
        formulas = Formulas(rng)
        formula, follows = formulas.any(3)
        requirement = r.Requirement("", "", formula, True, (), Place(""))
        monitor = Monitor(requirement, Fraction(1))
        length = rng.randrange(1, 9)
        tries = [[rng.choice([True, False, None]) for _ in range(2)] for _ in range(length)]
        trace = tries + [tries[-1]] * follows.delay
        state, own, early = monitor.initial_state, list[TruthValue](), 2
        judged = list[TruthValue]()
        for tick, values in enumerate(trace):
            formulas.values = values
            for atom in formulas.atoms:
                atom.update()
            found = follows.step()
            if found is not None:
                (low, _), (high, _) = found
                judged.append(low if low == high else None)
            state, said = monitor.step(state, tuple(values[i] for i in formulas.order), 1)
            own += said
            if tick == length - 1:
                early = worst(own)
        # What follows from the first ticks is said at once, all of it when they are over.
        assert worst(own) <= worst(judged[:length]) <= early
        seen.add((worst(judged[:length]), early))
    assert {(0, 0), (1, 1), (2, 2)} <= seen


def test_steady_ticks_are_stepped_at_once() -> None:
    formula = r.Temporal("within", (r.TickCondition(TRUE),), Fraction(5))
    monitor = Monitor(r.Requirement("", "", formula, True, (), Place("")), Fraction(1))
    assert monitor.step(monitor.initial_state, (False,), 5)[1] == set()
    assert monitor.step(monitor.initial_state, (False,), 6)[1] == {False}
    assert monitor.step(monitor.initial_state, (True,), 1000)[1] == {True}


@pytest.mark.parametrize("formulas", [60, pytest.param(250, marks=pytest.mark.long)])
def test_many_steady_ticks_at_once_are_those_one_by_one(formulas: int) -> None:
    rng = Random(11)
    waited = 0
    for _ in range(formulas):
        formula, _ = Formulas(rng).any(3)
        monitor = Monitor(r.Requirement("", "", formula, True, (), Place("")), Fraction(1, 9))
        state = monitor.initial_state
        for _ in range(4):
            atoms = tuple(rng.choice([True, False, False, None]) for _ in monitor.atoms)
            ticks = rng.randrange(1, 40)
            singly, said = state, set[TruthValue]()
            for _ in range(ticks):
                singly, more = monitor.step(singly, atoms, 1)
                said |= more
            assert monitor.step(state, atoms, ticks) == (singly, said)
            waited += ticks > 1 and singly.obligation not in (
                state.obligation,
                monitor.initial_state.obligation,
            )
            state = singly
    assert waited > formulas / 8


def test_waiting_for_long_takes_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    counted: list[object] = []
    values = Monitor._tick_values
    monkeypatch.setattr(Monitor, "_tick_values", lambda *of: counted.append(of) or values(*of))

    def monitor(op: Any) -> Monitor:
        formula = r.Temporal(op, (r.TickCondition(TRUE),), Fraction(600))
        return Monitor(r.Requirement("", "", formula, True, (), Place("")), Fraction(1, 2000))

    one = monitor("within")
    assert one.step(one.initial_state, (False,), 1_200_000)[1] == set()
    assert one.step(one.initial_state, (False,), 1_200_001)[1] == {False}
    one = monitor("once")
    held = one.step(one.initial_state, (True,), 1)[0]
    assert one.step(held, (False,), 1_200_000)[1] == {True}
    assert one.step(held, (False,), 1_200_001)[1] == {True, False}
    assert len(counted) < 20


def test_what_looks_ahead_from_the_past_is_not_followed() -> None:
    ahead = r.Temporal("within", (r.TickCondition(TRUE),), Fraction(5))
    formula = r.Temporal("once", (ahead,), Fraction(5))
    with pytest.raises(UnsupportedFormulaError):
        Monitor(r.Requirement("", "", formula, True, (), Place("")), Fraction(1))


# Systems.


LIMITS = (-1, 0, 1, 3, 50)


def bounds(result: Result, rng: Random) -> Iterator[str]:
    """Requirements on numbers in memory and on numbers that are sent, whether known or not."""
    assert result.system is not None
    names = {s.qualified_name for s in result.system.subsystems}
    found: list[tuple[Type, str, str]] = []
    for subsystem in result.system.subsystems:
        of = subsystem.qualified_name
        found += [(item.type, f"{of}.{item.name}", "") for item in subsystem.memory]
        for port in (port for port in subsystem.ports if port.direction == "y"):
            peer = f"{of}.y.{port.peer}" if port.other_end in names else port.other_end
            sent = [(element.type, f"{peer}.{element.name}") for element in port.elements]
            found += [(type_, name, f"not present({name}) or ") for type_, name in sent]
    for type_, value, absent in found:
        if kind(type_).sort in ("whole", "real"):
            unit = str(type_).removeprefix("real").removeprefix("int")
            op = rng.choice(("<=", ">=", "<", ">"))
            yield f"always({absent}{value} {op} {rng.choice(LIMITS)}{unit})"


def required(seed: int, folder: Path, *, of_numbers: bool = False) -> Result | None:
    """A random system with random requirements about its states and buffers."""
    rng = Random(seed)
    tree = specification(Random(seed))
    result = compiled(tree, folder)
    if not result.ok or result.system is None:
        return None
    asked = [
        f"state({s.qualified_name}) == {t.name}" for s in result.system.subsystems for t in s.states
    ]
    names = {s.qualified_name for s in result.system.subsystems}
    there = [
        f"present({s.qualified_name}.{port.direction}.{port.peer}.{element.name})"
        for s in result.system.subsystems
        for port in s.ports
        if port.other_end in names
        for element in port.elements
    ]
    asked += rng.sample(there, min(len(there), len(asked)))
    tree["specc"] = 1.1
    forms = [
        "always(not ({} and {}))",
        "always(not ({} and {}))",
        "always({} implies within(0.2[s], {}))",
        "always({} implies once(0.2[s], {}))",
        "always({} or not since({}, True))",
    ]
    said = [form.format(rng.choice(asked), rng.choice(asked)) for form in forms]
    said = list(bounds(result, rng)) if of_numbers else said
    tree["require"] = [{"that": that, "because": "it is so"} for that in said]
    return compiled(tree, folder)


def said_of(seeds: Sequence[int], folder: Path, *, of_numbers: bool = False) -> Counter[str]:
    """How often each verdict was given; raises where a run contradicts one."""
    said = Counter[str]()
    for seed in seeds:
        result = required(seed, folder, of_numbers=of_numbers)
        if result is not None and result.ok:
            found = explore(result.proofs, 6_000)
            assert misjudged(result, found, range(2), TICKS) == [], seed
            said.update(judged.verdict for judged in found.requirements)
    return said


@pytest.mark.parametrize("seeds", blocks(FAILING[:2], also=FAILING[2:], long=5, each=30))
def test_what_is_said_of_random_requirements_holds(seeds: Seeds, tmp_path: Path) -> None:
    said = said_of(seeds, tmp_path)
    assert said["proved"] or seeds.are_fresh
    assert said["violated"] + said["may be violated"] or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks([1], also=[0], long=5, each=30))
def test_what_is_said_of_random_numbers_holds(seeds: Seeds, tmp_path: Path) -> None:
    assert said_of(seeds, tmp_path, of_numbers=True)["proved"] or seeds.are_fresh


@pytest.mark.long
def test_what_is_said_of_requirements_that_take_long_holds(tmp_path: Path) -> None:
    assert said_of(DEAR, tmp_path)


WITH_A_FAULT = """\
specc: 1.1
system: fault
operators:
  far: {signature: "(d: real[m]) -> bool", python: "tests.soundness.operators:far"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {ping: bool}}
      memory: {k: {type: "real[m]", init: "0[m]"}}
      functions: {tell: {y.b.ping: True}}
      behaviours: {tell: {functions: [tell], terminal: never}}
      states: {S0: tell}
      initial_state: S0
      assume: [{that: far(k), because: it is not}]
  b:
    control:
      rate: 10 Hz
      x: {a: {ping: bool}}
      behaviours: {wait: {terminal: never}}
      states: {S0: wait}
      initial_state: S0
require:
  - {that: always(not present(b.c.x.a.ping)), because: it comes with the fault of who sent it}
"""


def test_what_is_violated_with_a_fault_is_said_of_runs_without_it(tmp_path: Path) -> None:
    """The sender fails at the stamp at which others would see what it sent."""
    (tmp_path / "spec.yaml").write_text(WITH_A_FAULT, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    found = explore(result.proofs, 1_000)
    (judged,), ((verdict,), lasted_s) = found.requirements, monitored(result, 0, TICKS)
    assert (judged.verdict, verdict, lasted_s) == ("violated", "unknown", Fraction(1, 10))
    assert judged.summary() == "violated in every run, unless a step fails by then"
    assert misjudged(result, found, range(2), TICKS) == []


BESIDE_A_FAULT = """\
specc: 1.1
system: beside
agents:
  a:
    control:
      rate: 10 Hz
      x: {b: {pong: bool}}
      y: {b: {ping: bool}}
      memory: {since: {type: "real[s]", init: 0}}
      conditions: {terminal: {ponged: x.b.pong}}
      functions: {tell: {y.b.ping: True, since: elapsed}}
      behaviours: {work: {functions: [tell], terminal: ponged}}
      states: {S0: work}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
  b:
    control:
      rate: 10 Hz
      x: {a: {ping: bool}}
      y: {a: {pong: bool}}
      behaviours: {wait: {functions: [{y.a.pong: False}], terminal: never}}
      states: {S0: wait}
      initial_state: S0
      assume: [{that: not fresh(x.a.ping), because: it is wrong}]
require:
  - {that: "always(REQUIRED)", because: it is tried}
"""


@pytest.mark.parametrize(
    ("required", "verdict"),
    [
        ("a.c.since <= 0[s]", "not decided"),
        ("state(b.c) == S0", "proved"),
        ("not present(b.c.x.a.ping) or state(b.c) == S0", "proved"),
        ("not present(b.c.x.a.ping) or a.c.since <= 0[s]", "not decided"),
    ],
)
def test_a_fault_leaves_open_only_what_is_said_of_the_machine_that_fails(
    required: str, verdict: str, tmp_path: Path
) -> None:
    """How long a state has lasted is unknown, whether another machine has failed or not."""
    (tmp_path / "spec.yaml").write_text(BESIDE_A_FAULT.replace("REQUIRED", required), "utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    found = explore(result.proofs, 1_000)
    assert [judged.verdict for judged in found.requirements] == [verdict]
    assert misjudged(result, found, range(2), TICKS) == []


@pytest.mark.parametrize("case", every(3, CASES), ids=lambda case: case.stem)
def test_the_monitor_of_the_recorded_trace_says_so(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["explore", str(case), "--traces", str(tmp_path), "--format", "json"])
    (finding,) = json.loads(capsys.readouterr().out)["findings"]
    with open(finding["recording"], "rb") as file:
        (said,) = (m for m in make_reader(file).iter_metadata() if m.name == "report")
    (item,) = json.loads(said.metadata["report"])["requirements"]
    assert item["verdict"] == "violated"


@pytest.mark.long
def test_what_looks_far_back_takes_nothing_from_what_does_not(tmp_path: Path) -> None:
    agents, _, _ = (SPECS / "conveyor_gate.yaml").read_text(encoding="utf-8").partition("\nplant:")
    opening = "state(gate.c) == opening"
    far = f"always({opening} implies once(600[s], state(belt.c) == running))"
    spec = tmp_path / "spec.yaml"
    spec.write_text(
        f"{agents}\nrequire:\n"
        f"  - {{that: '{far}', because: a}}\n"
        f"  - {{that: 'always(not ({opening} and state(belt.c) == idle))', because: b}}\n",
        encoding="utf-8",
    )
    told = [j.verdict for j in explore(compile_spec(str(spec)).proofs, 20_000).requirements]
    assert told == ["not explored", "proved"]


DESCRIBED = """\
specc: 1.1
parameters: {limit: int, hear: agent}
agent:
  control:
    rate: 10 Hz
    y: {hear: {v: int}}
    memory: {n: {type: int, init: 0}}
    functions: {f: {n: "5 if n < limit else 0", y.hear.v: n}}
    behaviours: {w: {functions: [f], terminal: never}}
    states: {S0: w}
    initial_state: S0
"""
USING = """\
specc: 1.1
system: shadowed
constants: {limit: 3}
agents:
  a: {use: part.yaml, with: {limit: "100", hear: b}}
  b:
    control:
      rate: 10 Hz
      x: {a: {v: {type: int, init: 0}}}
      memory: {k: {type: int, init: 0}}
      functions: {f: {k: x.a.v}}
      behaviours: {w: {functions: [f], terminal: never}}
      states: {S0: w}
      initial_state: S0
require:
  - {that: always(a.c.n < limit), because: of the constant of the system}
  - {that: always(a.c.n < limit + 3), because: of the constant of the system}
"""


def test_constants_of_requirements_are_those_of_the_system(tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(DESCRIBED, encoding="utf-8")
    (tmp_path / "spec.yaml").write_text(USING, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    assert result.ok, result.diagnostics
    verdicts = [each.verdict for each in explore(result.proofs, 1_000).requirements]
    assert verdicts == ["violated", "proved"]


WAITING = """\
specc: 1.1
system: waiting
agents:
  a:
    real_receptors: {eye: {y: {d: "real[m]"}}}
    control:
      rate: 10 Hz
      x: {eye: {near_by: {type: bool, init: False}}}
      conditions: {terminal: {near_by: x.eye.near_by, far: not x.eye.near_by}}
      behaviours: {wait: {terminal: near_by}, rest: {terminal: far}}
      states: {S0: wait, S1: rest}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
    virtual_receptors:
      eye:
        rate: 10 Hz
        x: {R: {d: "real[m]"}}
        y: {c: {near_by: bool}}
        behaviours: {look: {functions: [{y.c.near_by: "x.R.d < 1[m]"}], terminal: never}}
        states: {S0: look}
        initial_state: S0
plant: {python: "world:World", bind: {a.R.eye.d: {}}}
require:
  - {that: "always(state(a.c) == S0 implies within(200[s], state(a.c) == S1))", because: it comes}
"""


@pytest.mark.parametrize(("window_s", "rate_hz"), short([(200, 10), (600, 500)], 0))
def test_what_long_windows_wait_for_is_told(window_s: int, rate_hz: int, tmp_path: Path) -> None:
    """One way is enough for that where there are steps for no more; repeated steps are one."""
    spec = tmp_path / "spec.yaml"
    text = WAITING.replace("200[s]", f"{window_s}[s]").replace("10 Hz", f"{rate_hz} Hz")
    spec.write_text(text, encoding="utf-8")
    found = explore(compile_spec(str(spec)).proofs, 4_000)
    (waits,) = found.requirements
    assert (waits.verdict, waits.assumptions) == ("open", ("`near_by` in `a.c`",))
    assert found.findings == []


@pytest.mark.parametrize("budget", [3, 4])
def test_violations_on_the_last_steps_of_the_budget_are_kept(budget: int) -> None:
    """Also if not all ways from where they are were followed."""
    case = Path(__file__).parent / "cases/required-before.yaml"
    facts = compile_spec(str(case)).proofs
    (subject,) = requirement_slices(facts)
    watched = [subject.requirement]
    graph = Graph(Composition(subject.names, subject.abstraction, requirements=watched), budget)
    assert graph.violated == {0}
    number, (edge,) = graph.violation(0)
    assert number == len(graph.edges) < len(graph.configurations)
    assert edge.violated == (0,)


@pytest.mark.parametrize(
    ("error", "why"), [(KeyboardInterrupt, "interrupted"), (MemoryError, "out of memory")]
)
def test_what_ends_the_telling_of_requirements_leaves_the_rest(
    error: type[BaseException], why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = Path(__file__).parent / "cases/required-section.yaml"
    way = Graph.easiest_path

    def ends(self: Graph, number: int) -> Any:
        if self.composition.tracker is not None:
            raise error
        return way(self, number)

    monkeypatch.setattr(Graph, "easiest_path", ends)
    found = explore(compile_spec(str(case)).proofs, 20_000)
    assert found.broken_off == why
    assert found.slices and all(each.complete for each in found.slices)
    assert [each.verdict for each in found.requirements] == ["not explored"]


ALONE = """\
specc: 1.1
system: alone
agents:
  a:
    control:
      rate: 100 Hz
      y: {b: {n: int}}
      memory: {n: {type: int, init: 94906267}, q: {type: real, init: 0}, r: {type: real, init: 0}}
      conditions: {terminal: {late: "elapsed > 20[s]"}}
      functions: {f: {y.b.n: n, q: n, r: "(n if n > 0 else 0.5) * (n if n > 0 else 0.5)"}}
      behaviours: {w: {functions: [f], terminal: late}, v: {functions: [f], terminal: never}}
      states: {S0: w, S1: v}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
  b:
    control:
      rate: 100 Hz
      x: {a: {n: {type: int, init: 0}}}
      memory: {k: {type: int, init: 0}}
      functions: {f: {k: x.a.n}}
      behaviours: {w: {functions: [f], terminal: never}}
      states: {S0: w}
      initial_state: S0
require:
"""


def _verdicts(requirements: list[str], tmp_path: Path) -> list[str]:
    lines = "".join(f"  - {{that: '{that}', because: it}}\n" for that in requirements)
    (tmp_path / "spec.yaml").write_text(ALONE + lines, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    assert result.ok, result.diagnostics
    return [each.verdict for each in explore(result.proofs, 20_000).requirements]


@pytest.mark.long
def test_integers_that_no_float_is_are_not_known_where_reals_are(tmp_path: Path) -> None:
    """The square of `n` is one more than what 64 bits of a float make of it."""
    exact = "9007199515875288"
    assert _verdicts(
        [f"always(a.c.{name} > {exact} or a.c.{name} < 1)" for name in ("r", "q * a.c.q")], tmp_path
    ) == ["not decided", "not decided"]


def test_what_holds_at_any_time_is_proved_beside_what_needs_times(tmp_path: Path) -> None:
    small, there = "always(a.c.n < 94906268)", "always(state(a.c) == S0)"
    assert _verdicts([small], tmp_path) == ["proved"]
    assert _verdicts([small, there], tmp_path) == ["proved", "violated"]


def test_what_is_never_asked_is_told(tmp_path: Path) -> None:
    agents, _, _ = WAITING.partition("require:")
    spec = tmp_path / "spec.yaml"
    never = "state(a.c) == S1 and not present(a.eye.y.c.near_by)"
    spec.write_text(
        f"{agents}require:\n"
        f"  - {{that: 'always({never} implies state(a.eye) == S0)', because: a}}\n"
        "  - {that: 'always(state(a.c) == S1 implies state(a.eye) == S0)', because: b}\n"
        f"  - {{that: 'always(not ({never}))', because: c}}\n"
        f"  - {{that: 'always({never} and once(1[s], state(a.c) == S0) implies within(1[s], "
        "state(a.eye) == S0))', because: d}\n",
        encoding="utf-8",
    )
    found = explore(compile_spec(str(spec)).proofs, 2_000)
    said = [each.summary() for each in found.requirements]
    assert said == ["proved, but never asked", "proved", "proved", "proved, but never asked"]


def test_what_looks_ahead_from_the_past_is_decided_or_said_to_do_so(tmp_path: Path) -> None:
    """What always was so always is so."""
    agents, _, _ = WAITING.partition("require:")
    spec = tmp_path / "spec.yaml"
    ahead = "within(0.2[s], state(a.eye) == S0)"
    spec.write_text(
        f"{agents}require:\n"
        f"  - {{that: 'always(historically(1[s], {ahead}))', because: a}}\n"
        f"  - {{that: 'always(once(1[s], {ahead}))', because: b}}\n",
        encoding="utf-8",
    )
    found = explore(compile_spec(str(spec)).proofs, 2_000)
    said = [each.summary() for each in found.requirements]
    assert said == ["proved", "not decided, since it looks ahead from the past"]
