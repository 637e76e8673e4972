"""For every state and cause the initial conditions are exhaustive and exclude each other (2.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from specc.analysis import Facts, RowVerdictAt
from specc.analysis.path_conditions import as_conditions
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.lang import show
from specc.model.expr import Call, source_name, walk
from specc.model.fsm import OTHERWISE, Behaviour, Cause, State, Transition
from specc.model.system import Subsystem
from specc.proof import SolverAnswer, Witness

# Phrases about states and refutations.


def ending(behaviour: Behaviour, cause: Cause) -> str:
    """How a behaviour ends by a cause: `by its terminal condition `reached``."""
    condition = behaviour.ending(cause)
    return f"by its {condition.kind} condition `{condition.name}`"


def situation(witness: Witness) -> str:
    """`when a is true and b is false`, or whatever holds in all situations of a witness."""
    if witness.everywhere is not None:
        return f"when `{show(witness.everywhere)}`"
    if not witness.facts:
        return "whatever the conditions are"
    return f"when {facts_of(witness)}{', among other cases' if witness.is_partial else ''}"


def facts_of(witness: Witness) -> str:
    """`a is true and b is false`: one situation of a witness."""
    facts = [f"`{question}` is {answer}" for question, answer in witness.facts]
    return join_words(facts, "and") if facts else ""


def _operators_in(witness: Witness) -> str:
    """A last remark on the operators in a witness; empty if it involves none."""
    nodes = (node for question, _ in witness.answers for node in walk(question))
    calls = (source_name(node.operator) for node in nodes if isinstance(node, Call))
    names = [f"`{name}`" for name in dict.fromkeys(calls)]
    if not names:
        return ""
    kind = "an operator, which" if len(names) == 1 else "operators, which"
    verb = "is" if len(names) == 1 else "are"
    return f"; {join_words(names, 'and')} {verb} {kind} may have any result as far as proofs know"


# Refutations of the rows of several states that have one reason are reported once.


MOST_NAMED = 3
"""States that a message names; further ones are counted."""
MOST_SHOWN = 12
"""States whose places are shown beside the first."""
MOST_COMPARED = 8
"""Refutations about the same conditions with which another one is compared."""
_Key = tuple[str, str, tuple[str, ...]]


@dataclass(eq=False, slots=True)
class SharedRows:
    """Rows of several states that ask the same conditions and fail in the same situations.

    Whenever one of the `others` or the `first` state ends, the `widest` could end as well, so that
    the `witness`, which is about the rows of the `widest`, holds for theirs too.
    """

    first: RowVerdictAt
    widest: RowVerdictAt
    witness: Witness
    others: list[RowVerdictAt] = field(default_factory=list)

    @property
    def states(self) -> str:
        """The states in words: `state `S0``, `states `S0` and `S1``."""
        names = [f"`{decided.state.name}`" for decided in (self.first, *self.others)]
        if len(names) == 1:
            return f"state {names[0]}"
        if len(names) > MOST_NAMED:
            names[MOST_NAMED - 1 :] = [f"{len(names) - MOST_NAMED + 1} more"]
        return f"states {join_words(names, 'and')}"

    @property
    def places(self) -> tuple[Related, ...]:
        """The other states."""
        return tuple(
            Related(other.state.place, f"ended {ending(other.state.behaviour, other.cause)}, too")
            for other in self.others[:MOST_SHOWN]
        )


def group_refutations(
    facts: Facts, witness_of: Callable[[RowVerdictAt], Witness | None]
) -> Iterator[SharedRows]:
    """The refutations that `witness_of` selects, in the order of their first states."""
    alike: dict[_Key, list[SharedRows]] = {}
    for decided in facts.row_verdicts:
        witness = witness_of(decided)
        if witness is not None:
            conditions = tuple(row.condition.name for row in decided.verdict.rows)
            known = alike.setdefault(
                (decided.subsystem.qualified_name, decided.cause, conditions), []
            )
            _add_refutation(decided, witness, known)
    yield from (group for known in alike.values() for group in known)


def _add_refutation(decided: RowVerdictAt, witness: Witness, known: list[SharedRows]) -> None:
    """Add a refutation to those about the same conditions; one that covers it represents it.

    If it covers some of them, it represents them instead.
    """
    compared = known[:MOST_COMPARED]
    for group in compared:
        if _covers(group.widest, decided):
            group.others.append(decided)
            return
    covered = [group for group in compared if _covers(decided, group.widest)]
    if not covered:
        known.append(SharedRows(decided, decided, witness))
        return
    widened, *merged = covered
    widened.widest, widened.witness = decided, witness
    for group in merged:
        widened.others += [group.first, *group.others]
        known.remove(group)
    widened.others.append(decided)


def _covers(one: RowVerdictAt, other: RowVerdictAt) -> bool:
    """Whether the refutation of one state's rows also holds of the rows of another state."""
    present = [one.machine.presence.in_conditions(d.state.name) for d in (one, other)]
    if not present[0] <= present[1]:
        return False
    # What holds whenever a state ends by a cause.
    context, fact = (as_conditions(d.state.behaviour.facts_after(d.cause)) for d in (other, one))
    if context == fact:
        return True
    if one.is_incomplete or other.is_incomplete:
        return False
    return all(one.machine.prover.implies(context, part) for part in fact)


# Whenever a state ends by a cause, some row of that state and cause applies (2.4).


def rows_complete(facts: Facts) -> Iterator[Diagnostic]:
    """E0601, once for all states that fail alike; for causes with rows."""
    examples = facts.examples()
    for group in group_refutations(
        facts, lambda d: d.verdict.decision.gap if d.verdict.rows else None
    ):
        decided, widest, gap = group.first, group.widest, group.witness
        state, rows = decided.state, decided.verdict.rows
        required = dict.fromkeys(
            Related(row.place, f"requires `{row.condition.name}`") for row in rows
        )
        yield Diagnostic(
            "E0601",
            f"no row of {group.states} applies {situation(gap)}",
            state.place,
            f"ended {ending(state.behaviour, decided.cause)}",
            (*group.places, *required),
            _with_one_more_row(group),
            example=examples.text(widest, gap, facts_of(gap)),
        )


def _with_one_more_row(group: SharedRows) -> str:
    decided, also = group.first, " to each of these states" if group.others else ""
    row = f"add the row `[{decided.state.name}, {decided.cause}, {OTHERWISE}, ...]`{also}, or one"
    if any((c.kind, c.name) == ("initial", OTHERWISE) for c in decided.subsystem.conditions):
        row = f"add a row{also}"  # the word has a meaning of its own here
    return (
        f"{row} with a condition for this case, or say under `assume:` why it cannot occur"
        f"{_operators_in(group.witness)}"
    )


# Whenever a state ends by a cause, at most one row of that state and cause applies (2.4).


_MOST = 6
"""Most rows of which every two are compared."""


def rows_exclusive(facts: Facts) -> Iterator[Diagnostic]:
    """E0602, for two rows that can apply together; others of the same states are related."""
    examples = facts.examples()
    for group in group_refutations(facts, lambda decided: decided.verdict.decision.overlap):
        decided, widest, overlap = group.first, group.widest, group.witness
        one, other = overlap.holding
        first, second = decided.verdict.rows[one], decided.verdict.rows[other]
        others = tuple(_other_rows(group))
        also = "and so does this row"
        if others and (own := widest.overlap((one, other))):
            also += f" {situation(own)}"
        yield Diagnostic(
            "E0602",
            f"two rows of {group.states} apply {situation(overlap)}",
            second.place,
            f"applies when the state ended {ending(decided.state.behaviour, decided.cause)}",
            (Related(first.place, also), *others, *group.places),
            _with_one_row_less(group),
            example=examples.text(widest, overlap, facts_of(overlap)),
        )


def _other_rows(group: SharedRows) -> Iterator[Related]:
    """The other rows that can apply together with one, at their places."""
    rows, shown = group.first.verdict.rows, set(group.witness.holding)
    pairs = ((i, j) for j in range(len(rows)) for i in range(j))
    for one, other in pairs if len(rows) <= _MOST else ():
        new, beside = (one, other) if other in shown else (other, one)
        if new not in shown and (overlap := group.widest.overlap((one, other))):
            shown.add(new)
            name = rows[beside].condition.name
            words = f"applies {situation(overlap)}, and so does the row with `{name}`"
            yield Related(rows[new].place, words)


def _with_one_row_less(group: SharedRows) -> str:
    overlap, rows = group.witness, group.first.verdict.rows
    if all(rows[one].is_otherwise for one in overlap.holding):
        return "delete one of the two rows: a state and cause have one row with `otherwise`"
    other = f"or say under `assume:` why this cannot occur{_operators_in(overlap)}"
    also = " in each of these states" if group.others else ""
    if overlap.repair is None or overlap.repaired is None:
        also += ", since a row of a state does not replace one of its mode" * bool(
            group.first.state.modes
        )
        return f"delete one of the two rows{also}, {other}"
    which = "this row" if overlap.repaired == overlap.holding[-1] else "the other row"
    name = rows[overlap.repaired].condition.name
    return f'give {which} the condition "{show(overlap.repair)}" instead of `{name}`{also}, {other}'


# A cause that can occur in a state has rows; a state without any row is not finished.


def causes_have_rows(facts: Facts) -> Iterator[Diagnostic]:
    """E0603, and O0605 where the table says nothing of a state yet."""
    unmet = [decided for decided in facts.row_verdicts if decided.lacks_rows]
    without = {(decided.subsystem.qualified_name, decided.state.name) for decided in unmet}
    for subsystem in facts.subsystems:
        sources, name = {row.source for row in subsystem.transitions}, subsystem.qualified_name
        states = [s for s in subsystem.states if s.name not in sources]
        yield from _missing_rows(subsystem, [s for s in states if (name, s.name) in without])
    examples, groups = facts.examples(), dict[object, SharedRows]()
    for decided in unmet:
        if any(row.source == decided.state.name for row in decided.subsystem.transitions):
            condition = decided.state.behaviour.ending(decided.cause)
            ended = Witness((), answers=((condition.when, True),))
            key = decided.subsystem.qualified_name, decided.cause, condition
            if key in groups:
                groups[key].others.append(decided)
            else:
                groups[key] = SharedRows(decided, decided, ended)
    for group in groups.values():
        state, cause = group.first.state, group.first.cause
        condition = state.behaviour.ending(cause)
        named = f" `{cause}`" if cause not in ("terminal", "error") else ""
        have, also = "has no row for its", ""
        if group.others:
            have, also = "have no row for their", ", to each of these states"
        yield Diagnostic(
            "E0603",
            f"{group.states} {have} {condition.kind} condition{named}",
            state.place,
            f"can end {ending(state.behaviour, cause)}",
            (Related(condition.place, f"the {condition.kind} condition"), *group.places),
            f"add a row, e.g. `[{state.name}, {cause}, always, {state.name}]`{also}",
            example=examples.text(group.first, group.witness, ""),
        )


def _missing_rows(subsystem: Subsystem, ends: list[State]) -> Iterator[Diagnostic]:
    """O0605 for each state without rows, or once if the table is empty."""
    if ends and not subsystem.transitions:
        yield Diagnostic(
            "O0605",
            f"`{subsystem.qualified_name}` has no transitions yet",
            subsystem.place,
            help="add `transitions:` with rows such as "
            f"`[{ends[0].name}, terminal, always, {ends[0].name}]`",
        )
        return
    for state in ends:
        yield Diagnostic(
            "O0605",
            f"no row says what comes after state `{state.name}`",
            state.place,
            f"behaviour `{state.behaviour.name}` can end",
            help=f"add rows such as `[{state.name}, terminal, always, {state.name}]`",
        )


# Every row can be taken in some situation.


def rows_can_apply(facts: Facts) -> Iterator[Diagnostic]:
    """W0604 where the cause never occurs, W0605 where the condition never holds then.

    A row of a mode is reported if it never applies in any state of the mode. A condition
    that never holds at all, and an error that always does, are `conditions_vary`'s matter.
    """
    for machine in facts.consistent_machines:
        for place in machine.subsystem.idle_rows:
            message, label = "no error condition is left to this row", "each has rows of its own"
            yield Diagnostic("W0604", message, place, label, help="delete the row")
    found: dict[tuple[object, ...], list[tuple[RowVerdictAt, Transition, bool]]] = {}
    for decided in facts.row_verdicts:
        verdict = decided.verdict
        for row, possible in zip(verdict.rows, verdict.decision.satisfiable, strict=True):
            written = decided.subsystem.qualified_name, *row.written
            found.setdefault(written, []).append((decided, row, possible))
    for flat_rows in found.values():
        if any(possible for *_, possible in flat_rows):
            continue
        every = ((d.state.name, _impossible(d, row)) for d, row, _ in flat_rows)
        findings = {name: finding for name, finding in every if finding is not None}
        for first in [*findings.values()][:1]:
            others = [f"`{name}`" for name in findings][1:]
            also = f"; nor does the row apply in {join_words(others, 'and')}" if others else ""
            yield replace(first, message=f"{first.message}{also}")


def _impossible(decided: RowVerdictAt, row: Transition) -> Diagnostic | None:
    """The finding on a row that never applies in one of its states; None if another one says it."""
    machine, state, behaviour = decided.machine, decided.state, decided.state.behaviour
    occurs, end = decided.verdict.decision.possible, behaviour.ending(decided.cause)
    if machine.constant_value(end) is False or (
        not occurs and any(machine.constant_value(e) for _, e in behaviour.errors)
    ):
        return None
    if occurs and row.is_otherwise:
        words = f"the other rows of state `{state.name}` leave nothing to `otherwise`"
        hint = "delete the row, or give another row a stricter condition"
        return Diagnostic("W0605", words, row.place, "never taken", help=hint)
    if occurs and machine.constant_value(row.condition) is not None:
        return None
    code, about, named = "W0604", behaviour.place, f"behaviour `{behaviour.name}`"
    words = f"state `{state.name}` never ends {ending(behaviour, decided.cause)}"
    if occurs:
        code, about, named = "W0605", row.condition.place, f"`{row.condition.name}`"
        when = f"when state `{state.name}` ends {ending(behaviour, decided.cause)}"
        words = f"{named} never holds {when}"
    excluded = machine.dwell_times.excludes_row(row)
    return Diagnostic(
        code,
        words,
        row.place,
        "never taken: the times rule it out" if excluded else "never taken",
        (Related(about, named),),
        "delete the row, or change the condition",
    )


# What cannot be proved of rows is said, because it is then checked in every run.


_WAY_OUT = (
    "the generated code checks it in every run; to have it proved, let the conditions of these "
    "rows ask fewer questions, or divide the state into several"
)


def rows_proved(facts: Facts) -> Iterator[Diagnostic]:
    """W0606, for rows of which nothing is proved, with the solver's answer if it is installed."""
    for decided in facts.row_verdicts:
        decision, state = decided.verdict.decision, decided.state
        if not decision.unknown or not decided.verdict.rows:
            continue
        answer = decision.open.solve() if decision.open else SolverAnswer(unknown=decision.unknown)
        one = f"exactly one row of state `{state.name}` applies"
        words = f"it is not proved that {one}: {answer.unknown}"
        help = answer.way_out or decision.way_out or _WAY_OUT
        if answer.proved:
            words = f"truth tables do not prove that {one}, but the solver z3 does"
            help = "the generated code checks it in every run, as it does without the solver"
        for witness, which in ((answer.overlap, "two rows apply"), (answer.gap, "no row applies")):
            if witness:
                words = f"it is not proved that {one}: the solver z3 finds that {which}"
                words += f" {situation(witness)}, but no values that show it were found"
        label = f"ended {ending(state.behaviour, decided.cause)}"
        yield Diagnostic("W0606", words, state.place, label, help=help)
