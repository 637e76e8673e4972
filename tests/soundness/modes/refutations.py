"""Whether what a finding says about rows is so: a situation of that kind, in the interpreter.

A finding names states, why they ended, and what holds; it may add values as an example. Situations
of that kind are drawn until in one of them no row applies (E0601), or several do (E0602).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

from specc.diagnostics import Diagnostic
from tests.soundness.evaluator import Absent, Key, Value
from tests.soundness.modes.hierarchical import Machine, Undecided, Written
from tests.soundness.modes.random_machines import SPORADIC, STEADY
from tests.soundness.modes.scripted import values
from tests.soundness.modes.text_values import Now, parsed, worth

DRAWN = 6000
CODE = re.compile(r"`([^`]*)`")


@dataclass(frozen=True, slots=True)
class Fact:
    """What an expression is worth in the situations that a finding is about."""

    expression: ast.expr
    among: tuple[Value, ...]


def facts_of(finding: Diagnostic) -> list[Fact]:
    """What holds by the message, or else by the example."""
    told = finding.message.partition(" when ")[2]
    parts = re.findall(r"`([^`]*)` is (\w+(?: or \w+)*)", told)
    if not parts and (alone := CODE.findall(told)):
        parts = [(alone[0], "true")]
    return [
        Fact(parsed(text), tuple(_value(v) for v in answers.split(" or ")))
        for text, answers in parts
    ]


def example_of(finding: Diagnostic) -> dict[str, tuple[bool | None, Value]]:
    """Expression -> whether it is fresh, if that is said, and its value or `...` for any."""
    found: dict[str, tuple[bool | None, Value]] = {}
    for text, rest in re.findall(
        r"`([^`]*)`((?: = [^,`]+| \(not fresh\)| fresh)*)", finding.example
    ):
        fresh = None if "fresh" not in rest else "not fresh" not in rest
        value = rest.partition(" = ")[2].partition(" (")[0].partition(" fresh")[0].strip()
        found[text] = fresh, _value(value.split()[0]) if value else ...
    return found


def _value(text: str) -> Value:
    known = {"true": True, "false": False, "None": None}
    if text in known:
        return known[text]
    try:
        return float(text)
    except ValueError:
        return text


def is_confirmed(written: Written, finding: Diagnostic, rng: Random) -> bool:
    """Whether a situation of the kind of the finding does what it says."""
    told, example = facts_of(finding), example_of(finding)
    named = re.findall(r"`(S\d+)`", finding.message.partition(" when ")[0])
    states = list(written.states) if " more " in finding.message else named
    for number in range(DRAWN):
        state = states[number % len(states)]
        machine, inputs, fresh = _situation(written, state, example, rng)
        found = _rows(machine, inputs, fresh, told, finding)
        if found == 0 if finding.code == "E0601" else found > 1:
            return True
    return False


def _rows(
    machine: Machine, inputs: dict[Key, Value], fresh: set[Key], told: list[Fact], about: Diagnostic
) -> int:
    """How many rows apply; as many as is said where a condition has no value, and 1 where the
    situation is another one.

    Proofs take `held > 1` and `held is None` for questions that have nothing to do with each other.
    """
    now, said = machine.now(inputs, fresh), 0 if about.code == "E0601" else 2
    try:
        if any(_worth(fact.expression, machine, now) not in fact.among for fact in told):
            return 1
    except (Absent, ValueError):
        return 1
    try:
        cause = machine.cause(now)
        if cause and _is_named(cause, machine, about):
            machine.the_row(cause, now)
    except Undecided as error:
        return len(error.args[1])
    except (Absent, ValueError):
        return said
    return 1


def _worth(expression: ast.expr, machine: Machine, now: Now) -> Value:
    """The value; in messages `left(mode)` is the state that was left last."""
    match expression:
        case ast.Call(func=ast.Name(id="left"), args=[ast.Name(id=mode)]):
            return machine.left.get(mode, "never")
    return worth(expression, now)


def _is_named(cause: str, machine: Machine, about: Diagnostic) -> bool:
    """Whether the finding is about states that end so."""
    kind = "terminal" if cause == "terminal" else "error"
    words = (about.label, *(related.message for related in about.related))
    return any(f"{kind} condition" in text for text in words) or f"`{cause}`" in " ".join(words)


def _situation(
    written: Written, state: str, example: dict[str, tuple[bool | None, Value]], rng: Random
) -> tuple[Machine, dict[Key, Value], set[Key]]:
    """One in which the values of the example hold, and the rest is drawn."""
    # At some rates a time in a condition takes many periods.
    machine = Machine(written, state, periods=rng.randrange(1, rng.choice((8, 60))))
    inputs: dict[Key, Value] = {("m", n): v for n, v in values(rng, STEADY).items()}
    fresh = set(inputs)
    if rng.random() < 0.8:
        inputs |= {("v", n): v for n, v in values(rng, SPORADIC).items()}
        fresh |= {("v", n) for n in SPORADIC if rng.random() < 0.6}
    machine.memory = {name: _drawn(name, rng) for name in written.memory}
    for mode in written.modes:
        least = machine.periods if mode in machine.stack else 0
        machine.lasted[mode] = least + rng.randrange(9)
        inside = [s for s in written.states if mode in written.modes_of(s)]
        machine.left |= {mode: rng.choice(inside)} if rng.random() < 0.7 else {}
    for text, (is_fresh, value) in example.items():
        _put(machine, inputs, fresh, text, is_fresh, value)
    return machine, inputs, fresh


def _drawn(name: str, rng: Random) -> Value:
    of: dict[str, tuple[Value, ...]] = {
        "flag": (False, True),
        "held": (None, 0, 1, 2),
    }
    return rng.choice(of.get(name, (0, 1, 2, 3)))


def _put(
    machine: Machine,
    inputs: dict[Key, Value],
    fresh: set[Key],
    text: str,
    is_fresh: bool | None,
    value: Value,
) -> None:
    """Have one thing as the example says it is."""
    if text.startswith("x."):
        key = (text.split(".")[1], text.split(".")[2])
        if value is not ...:
            inputs[key] = value
        if is_fresh:
            inputs.setdefault(key, 1)
            fresh.add(key)
        elif is_fresh is False:
            fresh.discard(key)
    elif text == "elapsed":
        machine.periods = round(value * machine.written.rate_hz)
    elif text.startswith("elapsed("):
        machine.lasted[text[8:-1]] = round(value * machine.written.rate_hz)
    elif text.startswith("periods("):
        machine.lasted[text[8:-1]] = round(value)
    elif text in machine.memory and value is not ...:
        machine.memory[text] = value


def unconfirmed(written: Written, findings: Any, seed: str) -> Iterator[str]:
    """Findings about rows that no situation confirms."""
    for finding in findings:
        about_rows = finding.code in ("E0601", "E0602")
        if about_rows and not is_confirmed(written, finding, Random(seed)):
            yield f"{finding.code} {finding.message}; {finding.label}; {finding.example}"
