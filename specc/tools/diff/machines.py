"""Compares two machines: conditions, behaviours, states and rows, by proofs and not by names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any, TypeVar

from specc.lang import show
from specc.model.expr import FALSE
from specc.model.fsm import Behaviour, Cause, Condition, Mode, State, Trace, Transition, mode_name
from specc.model.system import Subsystem
from specc.reachable import grouped
from specc.source import Place
from specc.tools.diff.changes import ChangeLog, Difference, Guarantee, PartLog
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
        states = {
            state.name
            for s in self._versions
            for state in s.states
            if state.behaviour.name == old.name
        }
        is_moved = bool(states) and all(map(self._has_same_errors, states))
        for one, other in (*both, *zip_longest(lost, added, fillvalue=_NEVER)):
            if is_moved and not self._is_same(one, other):
                part.remark("error condition", one.name, other.name)  # a mode has it
            else:
                self._compare_endings(part, one, other)
        order = (", ".join(n for n in own if n in common) for own in (before, after))
        part.changed("order of error conditions", *order)

    def _is_same(self, one: Condition, other: Condition) -> bool:
        return self.equivalence.compare_conditions(one.when, other.when).same

    def _compare_endings(self, part: PartLog, old: Condition, new: Condition) -> None:
        """A condition of one name in both is compared where it is declared."""
        if old.name != new.name:
            verdict = self.equivalence.compare_conditions(old.when, new.when)
            part.verdict(verdict, (old.name, new.name), f"{old.kind} condition")

    def initial_states(self, old: Subsystem, new: Subsystem) -> None:
        self.log.part("initial state").changed("", old.initial_state, new.initial_state)

    def behaviour(self, state: PartLog, old: State, new: State) -> None:
        one, other = (_declared(*each) for each in zip(self._versions, (old, new), strict=True))
        is_renamed = one.name != other.name and _is_same_behaviour(one, other, self.equivalence)
        state.changed("behaviour", one.name, other.name, semantic=not is_renamed)
        for aspect, side, field in (
            ("ignored events", "x", "ignores"),
            ("held outputs", "y", "holds"),
        ):
            before, after = (sorted(getattr(each, field)) for each in (old, new))
            texts = (
                ", ".join(f"{side}.{peer}.{name}" for peer, name in names) or "none"
                for names in (before, after)
            )
            guarantee: Guarantee = "weaker" if {*after} - {*before} else "stronger"
            state.changed(aspect, *texts, guarantee=guarantee)

    def modes(self, old: Subsystem, new: Subsystem) -> None:
        """Which modes there are changes nothing by itself; what they do is told of states."""
        versions = [{mode.name: mode for mode in s.modes} for s in (old, new)]
        remembered = _memory(old) & _memory(new)
        for part, one, other in self.log.pair("mode", versions, _states, semantic=False):
            counts = {mode_name("periods", one.name), mode_name("entered", one.name)}
            is_counted = not counts.isdisjoint(remembered)
            if {*one.states} != {*other.states}:
                part.changed("states", _states(one), _states(other), semantic=is_counted)
            is_resumed = all(any(r.resumes == one.name for r in s.transitions) for s in (old, new))
            initial = (each.initial or "none" for each in (one, other))
            part.changed("initial state", *initial, semantic=is_resumed)
            part.remark("mode around it", one.parent or "none", other.parent or "none")
            part.remark("title", one.title, other.title)
            part.remark("trace", one.trace, other.trace)
        self._compare_errors_of_modes(old, new)

    def _compare_errors_of_modes(self, old: Subsystem, new: Subsystem) -> None:
        """The error conditions that states have by their modes, in which they begin with those."""
        found: dict[tuple[str, tuple[str, str]], list[str]] = {}
        before = {state.name: state for state in old.states}
        for state in new.states:
            if state.name not in before or self._has_same_errors(state.name):
                continue
            one, other = _errors_in(old, before[state.name]), _errors_in(new, state)
            of_modes = {*_errors_of_modes(old, before[state.name]), *_errors_of_modes(new, state)}
            for name in dict.fromkeys((*one, *other)):
                both = [each.get(name, _NEVER) for each in (one, other)]
                if name in of_modes and both[0].name != both[1].name:
                    texts = _text(both[0]), _text(both[1])
                    found.setdefault((f"error condition {name}", texts), []).append(state.name)
            first, last = (
                ", ".join(n for n in own if n in of_modes and n in one and n in other)
                for own in (one, other)
            )
            if first != last:
                aspect = "order of error conditions"
                found.setdefault((aspect, (first, last)), []).append(state.name)
        for (aspect, texts), states in found.items():
            version = old if texts[1] == _text(_NEVER) else new
            name, *more = _names_for(version, states)
            is_mode = not more and any(name == mode.name for mode in version.modes)
            kind = "states" if more else "mode" if is_mode else "state"
            self.log.part(kind, ", ".join((name, *more))).changed(aspect, *texts)

    def _has_same_errors(self, name: str) -> bool:
        """Whether a state has the same error conditions in both versions, in the same order."""
        states = [(s, each) for s in self._versions for each in s.states if each.name == name]
        if len(states) != 2:
            return False
        before, after = ([*_errors_in(*each).values()] for each in states)
        compare = self.equivalence.compare_conditions
        return len(before) == len(after) and all(
            compare(one.when, other.when).same for one, other in zip(before, after, strict=True)
        )

    @property
    def _versions(self) -> tuple[Subsystem, Subsystem]:
        return self.equivalence.subsystems

    def rows(self, old: Subsystem, new: Subsystem) -> None:
        """Rows of one state, cause and target are one arc: any of their conditions leads there.

        Arcs that change alike are told as one if they are of the same rows of a file with modes.
        """
        renamed = {state.name: self._renamed_causes(state.name) for state in old.states}
        before = grouped((_Arc.of(r, renamed.get(r.source, {})), r) for r in old.transitions)
        after = grouped((_Arc.of(r, {}), r) for r in new.transitions)
        arcs = sorted({*before, *after}, key=lambda arc: (arc in after, arc in before, arc.text))
        alike: dict[object, tuple[Difference, list[_Arc]]] = {}
        for arc in arcs:
            log, rows = ChangeLog(self.log.where), (before.get(arc, []), after.get(arc, []))
            self._compare_arc(log.part("row"), *rows)
            places = frozenset(row.place for own in rows for row in own)
            of = (arc.target, places) if old.modes or new.modes else arc
            for change in log.changes:
                alike.setdefault((change, of), (change, []))[1].append(arc)
        for change, own in alike.values():
            names = _names_for(old if change.change == "removed" else new, [a.source for a in own])
            causes = {arc.cause for arc in own}
            cause = own[0].cause if len(causes) == 1 else "error"
            text = _Arc(", ".join(names), cause, own[0].target).text
            self.log.changes.append(replace(change, name=text))

    def _renamed_causes(self, state: str) -> dict[Cause, Cause]:
        """The causes of a state that have another name now, where it has the same conditions."""
        if not self._has_same_errors(state):
            return {}
        before, after = (
            [cause for cause, error in s.state(state).behaviour.errors if error.when != FALSE]
            for s in self._versions
        )
        return {one: other for one, other in zip(before, after, strict=True) if one != other}

    def _compare_arc(
        self, arc: PartLog, before: Sequence[Transition], after: Sequence[Transition]
    ) -> None:
        if not before or not after:
            change = arc.removed if before else arc.added
            change(_condition_names((*before, *after)))
            return
        arc.remark("trace", *(_traces(rows) for rows in (before, after)))
        arc.remark("cause", before[0].cause, after[0].cause)
        remembered = _memory(self._versions[0]) & _memory(self._versions[1])
        arc.changed("effect on modes", *(_effects(rows, remembered) for rows in (before, after)))
        if {row.condition.name for row in before} == {row.condition.name for row in after}:
            # A condition of one name in both is compared where it is declared.
            arc.changed("number", *(len({row.place for row in rows}) for rows in (before, after)))
            return
        # When the cause occurs, as far as both versions agree; errors have priority (2.4).
        conditions = self.equivalence.conditions
        facts = (
            s.state(rows[0].source).behaviour.facts_after(rows[0].cause)[::-1]
            for s, rows in zip(self._versions, (before, after), strict=True)
        )
        premises: list[Any] = []
        for (when, holds), (again, _) in zip(*facts, strict=False):
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


def _declared(subsystem: Subsystem, state: State) -> Behaviour:
    """The behaviour of a state without what its modes add."""
    known = (each for each in subsystem.behaviours if each.name == state.behaviour.name)
    return next(known, state.behaviour)


def _errors_of_modes(subsystem: Subsystem, state: State) -> dict[str, Condition]:
    around = (mode for mode in subsystem.modes if mode.name in state.modes)
    return {name: error for mode in around for name, error in mode.errors}


def _errors_in(subsystem: Subsystem, state: State) -> dict[str, Condition]:
    """The error conditions of a state by their names, highest priority first."""
    return dict(subsystem.errors(state))


def _text(error: Condition) -> str:
    return "none" if error is _NEVER else show(error.when)


def _memory(subsystem: Subsystem) -> set[str]:
    return {item.name for item in subsystem.memory}


def _states(mode: Mode) -> str:
    return ", ".join(mode.states)


def _names_for(subsystem: Subsystem, states: Iterable[str]) -> list[str]:
    """The modes and states that together are these states."""
    left = dict.fromkeys(states)
    found = []
    for mode in subsystem.modes:  # those around others come first
        if len(mode.states) > 1 and left.keys() >= {*mode.states}:
            found.append(mode.name)
            left = {name: None for name in left if name not in mode.states}
    return [*found, *left]


@dataclass(frozen=True, slots=True)
class _Arc:
    """State, cause, and next state or `resume(mode)`."""

    source: str
    cause: Cause
    target: str

    @classmethod
    def of(cls, row: Transition, renamed: Mapping[Cause, Cause]) -> _Arc:
        """The arc that a row is of, with the present name of its cause."""
        target = f"resume({row.resumes})" if row.resumes else row.target
        return cls(row.source, renamed.get(row.cause, row.cause), target)

    @property
    def text(self) -> str:
        return f"{self.source} --{self.cause}--> {self.target}"


def _effects(rows: Sequence[Transition], memory: Set[str]) -> str:
    """Which modes rows enter anew or leave, as far as memory has it."""
    names = (name for row in rows for name, _ in row.sets if name in memory)
    parts = (name.rstrip(")").partition("(") for name in names)
    words = (f"{'leaves' if kind == 'left' else 'enters'} {mode}" for kind, _, mode in parts)
    return ", ".join(sorted({*words})) or "none"


def _traces(rows: Sequence[Transition]) -> str:
    return ", ".join(sorted(str(row.trace) for row in rows if row.trace))


def _condition_names(rows: Sequence[Transition]) -> str:
    return " or ".join(sorted({row.condition.name for row in rows}))
