"""Examples of findings: their values, evaluated, give no row or the rows that the finding names."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from specc.analysis import Facts, RowVerdictAt
from specc.analysis.must_may import is_incomplete
from specc.model.expr import Expr
from specc.proof import Witness
from specc.search import Interpreter, runnable
from specc.search.example import Example, is_complete_answer

SAID = re.compile(r"`([^`]+)`( fresh)? = (\[.*?\]|[^,]*)")


def refuted_of(facts: Facts) -> Iterator[tuple[Facts, RowVerdictAt, Witness]]:
    for decided in facts.row_verdicts:
        decision = decided.verdict.decision
        for witness in (decision.gap if decided.verdict.rows else None, decision.overlap):
            if witness:
                yield facts, decided, witness


def shown(facts: Facts, decided: RowVerdictAt, witness: Witness) -> Example:
    """The example of a refutation, which shows it; it is not told if the message says all."""
    found = facts.examples().find(decided, witness)
    if not witness.everywhere and all(is_complete_answer(asked) for asked, _ in witness.answers):
        assert facts.examples().text(decided, witness, "facts") == ""
    assert found is not None, witness.facts
    shows(found, facts, decided, witness)
    return found


def shows(found: Example, facts: Facts, decided: RowVerdictAt, witness: Witness) -> None:
    """The values give no row, or the rows of the witness, and are those that are said."""
    meaning = Interpreter(facts.system, decided.subsystem)

    def true(condition: Expr) -> bool:
        return bool(meaning.value(runnable(condition), found.situation, strictly=True))

    behaviour = decided.state.behaviour
    assert all(true(when) is holds for when, holds in behaviour.facts_after(decided.cause))
    assert all(true(axiom.that) for axiom in decided.subsystem.axioms)
    invariants = facts.of(decided.subsystem).invariants
    assert is_incomplete(decided.subsystem, decided.state, decided.cause) or all(
        map(true, invariants)
    )
    assert [true(asked) for asked, _ in witness.answers] == [yes for _, yes in witness.answers]
    held = tuple(i for i, r in enumerate(decided.verdict.rows) if true(r.condition.when))
    assert held == witness.holding or (len(witness.holding) > 1 and {*witness.holding} < {*held})
    said_as_it_is(found, decided)


def said_as_it_is(found: Example, decided: RowVerdictAt) -> None:
    """The text has the values of the situation."""
    at, period_s = found.situation, float(1 / decided.subsystem.rate_hz)
    for name, fresh, text in SAID.findall(found.text):
        if name == "elapsed":
            assert float(text.removesuffix(" s")) == pytest.approx(at.periods * period_s)
        elif re.fullmatch(r"x\.\w+\.\w+", name):
            element = tuple(name.split(".")[1:])
            assert element in at.present and (element in at.fresh) == bool(fresh)
            assert plain(at.inputs[element]) in (None, read(text))
        elif name in at.memory:
            assert plain(at.memory[name]) in (None, read(text))


def read(text: str) -> object:
    """A value as it is said, without its unit."""
    if text.startswith("["):
        inside = text[1 : text.index("]")]
        return [read(item) for item in inside.split(", ")] if inside else []
    try:
        return float(text.split(" ")[0])
    except ValueError:
        return text.split(" ")[0]


def plain(value: object) -> object:
    """A value as `read` gives it; None for records and poses."""
    if isinstance(value, tuple):
        parts = [plain(item) for item in value]
        return parts if all(isinstance(part, (str, float)) for part in parts) else None
    if isinstance(value, (bool, str)):
        return str(value).lower() if isinstance(value, bool) else value
    return float(value) if isinstance(value, (int, float)) else None
