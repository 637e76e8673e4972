"""Random tables over inputs with few values, and every situation that those values allow.

The values of reals are eighths, and what conditions compare with are halves, so that sums are
exact and wherever conditions differ there is an eighth that shows it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any

from specc.model.system import Subsystem
from tests.soundness.evaluator import Situation, Value, value
from tests.soundness.specifications import Tree

EIGHTHS = tuple(n / 8 for n in range(-12, 21))
QUARTERS = EIGHTHS[::2]
MODES = ("u", "c", "g")
WHOLE = tuple(range(-4, 6))
DOMAINS: dict[str, tuple[str, tuple[Any, ...]]] = {
    "p": ("real", EIGHTHS),
    "q": ("real", EIGHTHS),
    "n": ("int", WHOLE),
    "k": ("int", WHOLE),
    "m": ("Mode", MODES),
    "e": ("Mode", MODES),
    "go": ("bool", (False, True)),
    "b": ("vector[2, Mode]", tuple(itertools.product(MODES, repeat=2))),
    "w": ("vector[2]", tuple(itertools.product(QUARTERS, repeat=2))),
    "l": (
        "list[int]",
        tuple(i for n in range(4) for i in itertools.product(range(-1, 4), repeat=n)),
    ),
}
"""Element -> its type and the values that are tried."""
ARRIVALS = ((None, False), (0, False), (1, False), (0, True), (1, True))
"""What came from the peer, and whether it is fresh."""
TWINS = {"p": "q", "n": "k", "m": "e"}
"""Elements of one type."""
OPERATOR = "passes"
PREDICATES = tuple(
    dict(zip(MODES, t, strict=True)) for t in itertools.product((False, True), repeat=3)
)
"""All that the operator `passes` may be."""
ATOMS: dict[str, tuple[str, ...]] = {
    "p": ("{p} < {c}", "{p} >= {c}", "{c} <= {p}", "-{p} < {c}", "near({p}, {c}, 0.5)",
          "abs({p}) <= {c}", "{c} < {p} <= 1.5", "2 * {p} > {c}", "{p} / 2 <= {c}",
          "floor({p}) < {c}", "round({p}) <= {c}", "sign({p}) == {i}", "clamp({p}, 0, 1) > {c}"),
    "pq": ("{p} < {q}", "{q} <= {p}", "{p} + {q} < {c}", "{q} - {p} >= {c}", "near({p}, {q}, {t})",
           "max({p}, {q}) > {c}", "min({q}, {p}) <= {c}", "abs({p} - {q}) > {c}",
           "clamp({p}, {q}, 1) > {c}", "floor({p}) <= round({q})"),
    "n": ("{n} == {i}", "{n} < {i}", "{n} >= {i}", "{n} != {i}", "2 * {n} > {i}", "{n} + 1 <= {i}"),
    "nk": ("{n} < {k}", "{n} == {k}", "{n} + {k} > {i}", "{n} - {k} == {i}", "max({n}, {k}) < {i}"),
    "m": ("{m} == {a}", "{m} in {{{a}, {o}}}", "{m} != {a}", "{m} not in {{{a}}}", "passes({m})"),
    "me": ("{m} == {e}", "{m} != {e}", "passes({e})"),
    "go": ("{go}", "not {go}"),
    "b": ("{b}[0] == {a}", "{b}[0] == {b}[1]", "any(v == {a} for v in {b})",
          "all(v in {{{a}, {o}}} for v in {b})", "all(passes(v) for v in {b})",
          "{b} == [{a}, {o}]", "all(v != {a} for v in {b})"),
    "bm": ("any(v == {m} for v in {b})", "all(v == {m} for v in {b})", "{b}[1] == {m}"),
    "w": ("{w}[0] < {c}", "{w}[0] <= {w}[1]", "{w}[0] + {w}[1] > {c}", "near({w}, [0, 0.5], {t})",
          "all(v < {c} for v in {w})", "any(v >= {c} for v in {w})"),
    "l": ("len({l}) > {i}", "len({l}) == 0", "any(v > {i} for v in {l})",
          "all(v < {i} for v in {l})", "any(v == 1 for v in {l})"),
    "ln": ("any(v == {n} for v in {l})", "all(v <= {n} for v in {l})", "len({l}) > {n}"),
    "lgo": ("any(v > 0 and {go} for v in {l})",),
    "": ("fresh(x.c.g)", "present(x.c.g)", "fresh(x.c.g) and x.c.g > 0"),
}  # fmt: skip
"""Questions: {c} is a number, {t} a tolerance, {i} a whole number, {a} and {o} are modes."""


@dataclass(frozen=True, slots=True)
class Table:
    """A subsystem whose only state has a random table, and the elements that it asks about."""

    tree: Tree = field(repr=False)
    asked: tuple[str, ...]
    terminal: str
    rows: tuple[str, ...]
    axioms: tuple[str, ...]


def table(rng: Random) -> Table:
    """A random table about two or three elements; half of them are made so as to decide."""
    asked = tuple(rng.sample(list(DOMAINS), rng.choice((2, 2, 3))))
    while _count(asked) > 8000:
        asked = tuple(rng.sample(list(DOMAINS), 2))
    author = _Author(rng, asked)
    rows = tuple(author.rows())
    terminal = rng.choice(("always", "always", author.condition(1)))
    axioms = (author.condition(1),) if rng.randrange(4) == 0 else ()
    return Table(_tree(asked, terminal, rows, axioms), asked, terminal, rows, axioms)


def _count(asked: tuple[str, ...]) -> int:
    total = 3
    for name in asked:
        total *= len(DOMAINS[name][1])
    return total


@dataclass(slots=True)
class _Author:
    rng: Random
    asked: tuple[str, ...]

    def atom(self) -> str:
        """A question about one or two of the elements; what relates two is asked more often."""
        rng = self.rng
        texts = {name: f"x.E.{name}" for name in DOMAINS}
        for one, other in TWINS.items():
            if other in self.asked and (one not in self.asked or rng.randrange(2)):
                texts[one], texts[other] = texts[other], texts[one]
        known = {name for name in DOMAINS if texts[name].removeprefix("x.E.") in self.asked}
        fitting = [key for key in ATOMS if key and known.issuperset(_elements(key))]
        related = [key for key in fitting if len(_elements(key)) > 1]
        key = "" if rng.randrange(8) == 0 else rng.choice([*fitting, *related * 3])
        a, o = rng.sample(MODES, 2)
        c, i = rng.choice(("0", "0.5", "1")), rng.choice(("0", "1", "2"))
        t = "0.25" if c == "0" else c
        return f"({rng.choice(ATOMS[key]).format(a=a, o=o, c=c, t=t, i=i, **texts)})"

    def condition(self, depth: int) -> str:
        if depth == 0 or self.rng.randrange(4) == 0:
            return self.atom()
        a, b = self.condition(depth - 1), self.condition(depth - 1)
        return self.rng.choice((
            f"({a} and {b})", f"({a} or {b})", f"(not {a})", f"({a} if {self.atom()} else {b})",
        ))  # fmt: skip

    def rows(self) -> Iterator[str]:
        first, second = self.condition(1), self.condition(1)
        if self.rng.randrange(2):
            yield from (first, second, f"not ({first} or {second})")[: self.rng.choice((2, 3, 3))]
            return
        yield first
        yield f"not {first} and {second}"
        yield f"not {first} and not {second}"


def _elements(key: str) -> tuple[str, ...]:
    return ("go",) if key == "go" else ("l", "go") if key == "lgo" else tuple(key)


def _tree(
    asked: tuple[str, ...], terminal: str, rows: tuple[str, ...], axioms: tuple[str, ...]
) -> Tree:
    reports = {name: DOMAINS[name][0] for name in asked}
    initial = {f"r{i}": text for i, text in enumerate(rows)}
    conditions: Tree = {"initial": initial}
    if terminal != "always":
        conditions["terminal"] = {"ended": terminal}
    made: Tree = {
        "rate": "10 Hz",
        "x": {"E": reports, "c": {"g": "int"}},
        "y": {"E": {"u": "real"}, "c": {"n": "int"}},
        "conditions": conditions,
        "functions": {"drive": {"y.E.u": 1, "y.c.n": 1}},
        "behaviours": {
            "drive": {
                "functions": ["drive"],
                "terminal": "always" if terminal == "always" else "ended",
            }
        },
        "states": {"S0": "drive"},
        "initial_state": "S0",
        "transitions": [["S0", "terminal", name, "S0"] for name in initial],
        "assume": [{"that": text, "because": "it is so"} for text in axioms],
    }
    if not axioms:
        del made["assume"]
    return {
        "specc": 1,
        "system": "table",
        "types": {"Mode": f"enum[{', '.join(MODES)}]"},
        "operators": {
            OPERATOR: {"signature": "(m: Mode) -> bool", "python": "tests.soundness.worlds:passes"}
        },
        "agents": {
            "a": {
                "real_effectors": {"m": {"x": {"u": "real"}, "y": reports}},
                "control": {
                    "rate": "5 Hz",
                    "x": {"m": {"n": "int"}},
                    "y": {"m": {"g": "int"}},
                    "functions": {"tell": {"y.m.g": 1}},
                    "behaviours": {
                        "tell": {"functions": ["tell"], "terminal": "always"},
                        "rest": {"terminal": "always"},
                    },
                    "states": {"S0": "rest", "S1": "tell"},
                    "initial_state": "S0",
                    "transitions": [
                        ["S0", "terminal", "always", "S1"],
                        ["S1", "terminal", "always", "S0"],
                    ],
                },
                "virtual_effectors": {"m": made},
            }
        },
    }


current: dict[str, bool] = PREDICATES[0]
"""What the operator is in the world that generated code is in; `in_world` sets it."""


def passes(mode: str) -> bool:
    """The operator of the tables."""
    return current[mode]


def worlds(made: Table) -> Iterator[Situation]:
    """Every situation of the second period: values, arrivals, and what the operator is."""
    everything = [DOMAINS[name][1] for name in made.asked]
    uses_operator = OPERATOR in str(made.tree["agents"])
    uses_arrival = "x.c.g" in str(made.tree["agents"])
    for values in itertools.product(*everything):
        inputs = {("E", n): v for n, v in zip(made.asked, values, strict=True)}
        fresh = frozenset(inputs)
        for sent, is_new in ARRIVALS if uses_arrival else ARRIVALS[:1]:
            seen = inputs if sent is None else {**inputs, ("c", "g"): sent}
            new = fresh | {("c", "g")} if is_new else fresh
            for predicate in PREDICATES if uses_operator else PREDICATES[:1]:
                yield _situation(seen, new, predicate)


def _situation(
    inputs: dict[tuple[str, str], Value],
    fresh: frozenset[tuple[str, str]],
    predicate: dict[str, bool],
) -> Situation:
    operators: dict[str, Callable[..., Value]] = {OPERATOR: predicate.__getitem__}
    return Situation(inputs, fresh, {}, {}, {}, operators, 0.1, False, 0.1)


def enabled(subsystem: Subsystem, at: Situation) -> list[int] | None:
    """The rows that hold; None where the state does not end or an assumption does not hold."""
    if not all(value(axiom.that, at) for axiom in subsystem.axioms):
        return None
    if not value(subsystem.states[0].behaviour.terminal.when, at):
        return None
    return [i for i, row in enumerate(subsystem.transitions) if value(row.condition.when, at)]


def in_world(machine: Any, at: Situation, convert: Callable[[Any, str], Any]) -> Any:
    """Put a generated subsystem into a situation; `convert` makes values of the runtime."""
    global current
    current = {m: bool(at.operators[OPERATOR](m)) for m in MODES}
    for (peer, name), given in at.inputs.items():
        setattr(machine.x, f"{peer}_{name}", convert(given, name))
    for name in type(machine.x).__slots__:
        for kind, known in (("fresh", at.fresh), ("present", at.inputs)):
            if name.startswith(f"{kind}_"):
                peer, _, element = name.removeprefix(f"{kind}_").partition("_")
                setattr(machine.x, name, (peer, element) in known)
    return machine
