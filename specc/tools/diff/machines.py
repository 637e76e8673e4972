"""Compares two machines: conditions, behaviours, states and rows, by proofs and not by names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, TypeVar

from specc.lang import show
from specc.model.expr import FALSE
from specc.model.fsm import Behaviour, Condition, State, Trace, Transition
from specc.model.system import Subsystem
from specc.reachable import grouped
from specc.source import Place
from specc.tools.diff.changes import ChangeLog, PartLog
from specc.tools.diff.equivalence import Equivalence


@dataclass(frozen=True, slots=True)
class MachineDiff:
    """Compares the machines of two subsystems; `compare_fields` compares two parts of one name."""

    log: ChangeLog
    equivalence: Equivalence
    compare_fields: Callable[[PartLog, Any, Any], None]

    def conditions(self, old: Subsystem, new: Subsystem) -> None:
        """A condition matters where it is used; only adding or removing it changes nothing."""
        before, after = ({(c.kind, c.name): c for c in s.conditions} for s in (old, new))
        self._compare_renamable(before, after, _is_same_condition, lambda c: show(c.when))

    def when(self, part: PartLog, old: Condition, new: Condition) -> None:
        part.compare_expressions("meaning", old.when, new.when, self.equivalence.compare_conditions)

    def behaviours(self, old: Subsystem, new: Subsystem) -> None:

        def text(behaviour: Behaviour) -> str:
            functions = ", ".join(sorted(f.name for f in behaviour.functions)) or "no functions"
            errors = ", ".join(error.name for _, error in behaviour.errors)
            return f"{functions}; terminal {behaviour.terminal.name}, error {errors}"

        before, after = ({b.name: b for b in s.behaviours} for s in (old, new))
        self._compare_renamable(before, after, _is_same_behaviour, text)

    def _compare_renamable(
        self,
        old: Mapping[Any, _Renamable],
        new: Mapping[Any, _Renamable],
        is_same: Callable[[_Renamable, _Renamable, Equivalence], bool],
        text: Callable[[_Renamable], str],
    ) -> None:
        """Compare parts by name; one that only one version has may be the same as another."""

        def part(item: Condition | Behaviour) -> PartLog:
            kind = f"{item.kind} condition" if isinstance(item, Condition) else "behaviour"
            return self.log.part(kind, item.name)

        for key in sorted(old.keys() & new.keys()):
            self.compare_fields(part(old[key]), old[key], new[key])
        added = {key: new[key] for key in sorted(new.keys() - old.keys())}
        for before in (old[key] for key in sorted(old.keys() - new.keys())):
            same = (key for key, after in added.items() if is_same(before, after, self.equivalence))
            if (again := next(same, None)) is not None:
                part(before).remark("name", before.name, added.pop(again).name)
            else:
                part(before).removed(text(before), semantic=isinstance(before, Behaviour))
        for after in added.values():
            part(after).added(text(after), semantic=isinstance(after, Behaviour))

    def effects(self, part: PartLog, old: Behaviour, new: Behaviour) -> None:
        """How a behaviour ends, and what it assigns; what parts of both do is compared there."""
        self._compare_endings(part, old.terminal, new.terminal)
        self._compare_errors(part, old, new)
        before, after = (
            {a.target: (f.name, a.value) for f in b.functions for a in f.assignments}
            for b in (old, new)
        )
        common = {f.name for f in old.functions} & {f.name for f in new.functions}
        for target in sorted(before.keys() | after.keys()):
            (name, value), (again, now) = (of.get(target, ("", None)) for of in (before, after))
            if value is None or now is None:
                is_compared = (name or again) in common
            else:
                is_compared = name == again or self.equivalence.compare(value, now).same
            if not is_compared:
                part.changed(
                    target, *("not assigned" if e is None else show(e) for e in (value, now))
                )

    def _compare_errors(self, part: PartLog, old: Behaviour, new: Behaviour) -> None:
        before, after = map(_errors, (old, new))
        # One that only one version has may have another name now.
        common = [name for name in before if name in after]
        lost = [before[name] for name in before if name not in after]
        added = [after[name] for name in after if name not in before]
        both = [(before[name], after[name]) for name in common]
        for one, other in (*both, *zip_longest(lost, added, fillvalue=_NEVER)):
            self._compare_endings(part, one, other)
        order = (", ".join(n for n in own if n in common) for own in (before, after))
        part.changed("order of error conditions", *order)

    def _compare_endings(self, part: PartLog, old: Condition, new: Condition) -> None:
        """A condition of one name in both is compared where it is declared."""
        if old.name != new.name:
            verdict = self.equivalence.compare_conditions(old.when, new.when)
            part.verdict(verdict, (old.name, new.name), f"{old.kind} condition")

    def initial_states(self, old: Subsystem, new: Subsystem) -> None:
        self.log.part("initial state").changed("", old.initial_state, new.initial_state)

    def behaviour(self, state: PartLog, old: State, new: State) -> None:
        both = old.behaviour, new.behaviour
        is_renamed = both[0].name != both[1].name and _is_same_behaviour(*both, self.equivalence)
        state.changed("behaviour", *(b.name for b in both), semantic=not is_renamed)
        for aspect, side, field in (
            ("ignored events", "x", "ignores"),
            ("held outputs", "y", "holds"),
        ):
            one, other = (sorted(getattr(each, field)) for each in (old, new))
            texts = (
                ", ".join(f"{side}.{peer}.{name}" for peer, name in names) or "none"
                for names in (one, other)
            )
            state.changed(aspect, *texts, guarantee="weaker" if {*other} - {*one} else "stronger")

    def rows(self, old: Subsystem, new: Subsystem) -> None:
        """Rows of one state, cause and target are one arc: any of their conditions leads there."""
        arcs = (
            grouped((f"{row.source} --{row.cause}--> {row.target}", row) for row in s.transitions)
            for s in (old, new)
        )
        conditions = self.equivalence.conditions
        for arc, before, after in self.log.pair("row", arcs, _condition_names):
            arc.remark("trace", *(_traces(rows) for rows in (before, after)))
            if {row.condition.name for row in before} == {row.condition.name for row in after}:
                # A condition of one name in both is compared where it is declared.
                arc.changed("number", len(before), len(after))
                continue
            # When the cause occurs, as far as both versions agree; errors have priority (2.4).
            one, other = (s.state(before[0].source).behaviour for s in (old, new))
            premises: list[Any] = []
            for (when, holds), (again, _) in zip(
                *(behaviour.facts_after(before[0].cause)[::-1] for behaviour in (one, other)),
                strict=False,
            ):
                common = conditions.common([when], [again])
                premises += common if holds else map(conditions.make.negation, common)
            whens = [[row.condition.when for row in rows] for rows in (before, after)]
            texts = _condition_names(before), _condition_names(after)
            arc.verdict(conditions.compare(whens[0], whens[1], premises), texts, "condition")

    def assumptions(self, old: Subsystem, new: Subsystem) -> None:
        """Assumptions have no names; those that mean the same are the same."""
        is_same, added = self.equivalence.is_same_assumption, list(new.axioms)
        for before in old.axioms:
            again = next((after for after in added if is_same(before.that, after.that)), None)
            if again is None:
                note = "runs are no longer checked for it"
                part = self.log.part("assumption")
                part.removed(show(before.that), guarantee="weaker", note=note)
                continue
            added.remove(again)
            assumption = self.log.part("assumption", show(again.that))
            assumption.remark("text", show(before.that), show(again.that))
            assumption.remark("reason", before.because, again.because)
        for after in added:
            note = "proofs rest on it from now on"
            self.log.part("assumption").added(show(after.that), guarantee="weaker", note=note)


def _is_same_condition(one: Condition, other: Condition, machine: Equivalence) -> bool:
    return one.kind == other.kind and machine.compare_conditions(one.when, other.when).same


def _is_same_behaviour(one: Behaviour, other: Behaviour, machine: Equivalence) -> bool:
    """Whether two behaviours do the same and end alike, whatever they are called."""
    before, after = ({a.target: a.value for a in b.assignments} for b in (one, other))
    return (
        before.keys() == after.keys()
        and machine.compare_conditions(one.terminal.when, other.terminal.when).same
        and len(one.errors) == len(other.errors)
        and all(
            cause == again and machine.compare_conditions(error.when, other_error.when).same
            for (cause, error), (again, other_error) in zip(one.errors, other.errors, strict=True)
        )
        and all(machine.compare(before[target], after[target]).same for target in before)
    )


_NEVER = Condition("never", "error", FALSE, "", Trace(), Place("", ()))
_Renamable = TypeVar("_Renamable", Condition, Behaviour)


def _errors(behaviour: Behaviour) -> dict[str, Condition]:
    """The error conditions by their names, highest priority first."""
    return {name: error for name, error in behaviour.errors if error.when != FALSE}


def _traces(rows: Sequence[Transition]) -> str:
    return ", ".join(sorted(str(row.trace) for row in rows if row.trace))


def _condition_names(rows: Sequence[Transition]) -> str:
    return " or ".join(sorted({row.condition.name for row in rows}))
