"""Answers questions about the conditions of one subsystem."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Literal

from specc.model.expr import Expr, Input, children
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.model.types import Enum
from specc.proof.decide import Question, is_satisfiable
from specc.proof.dependencies import Dependencies, conjuncts, connected
from specc.proof.formula import Arrival, Atom, EnumItem, Formula, atoms_of
from specc.proof.translate import Translator
from specc.proof.verdict import Decision, InputName, RowVerdict, freshness, presence
from specc.proof.witness import without_other
from specc.reachable import reachable

EvaluationPoint = Literal["conditions", "functions", "start"]
"""When something holds. Axioms hold except at the start of a run; `entered` and `elapsed` are known
in conditions only, since these are not asked in the first period of a state."""


class Prover:
    """Answers under the axioms of the subsystem; a question is decided once, wherever it is asked.

    Decisions are exact on the Boolean structure of conditions (`specc.proof.translate` says what
    counts as structure); operators are unknown but repeatable functions of their arguments.
    """

    def __init__(
        self,
        subsystem: Subsystem,
        constants: Mapping[str, Expr],
        always_present: Collection[InputName] = (),
    ) -> None:
        """`constants` of the system by name, in order of dependence."""
        own = {c.name: c.value for c in subsystem.constants}
        lets = {item.name: item.value for item in subsystem.lets}
        known = lets, {**constants, **own}, always_present
        period_s = 1 / subsystem.rate_hz if subsystem.has_rate else None
        self._translator = Translator(*known, period_s)
        self._elsewhere = partial(Translator, *known)
        self.numbering = self._translator.numbering
        self._dependencies = Dependencies(self.numbering)
        self._formula = self._translator.formula
        self.timer = self._translator.timer
        self._always_present = frozenset(always_present)
        self._subsystem = subsystem
        self._axiom_conditions = tuple(axiom.that for axiom in subsystem.axioms)
        self._axioms = tuple(map(self._formula, self._axiom_conditions))
        self._questions: dict[object, Question] = {}
        self._decisions: dict[object, Decision] = {}
        self._possible: dict[tuple[Formula, ...], bool | None] = {}

    def prove_rows(
        self,
        state: str,
        cause: Cause,
        *,
        present: Collection[InputName] = (),
        fresh: Collection[InputName] = (),
        invariants: Collection[Expr] = (),
        without: int | None = None,
    ) -> RowVerdict:
        """Whether exactly one row of a state and cause applies whenever the cause occurs.

        `present` and `fresh` name inputs that are known to have a value in the conditions of the
        state, or a new one; `invariants` always hold. `without` leaves an axiom out, by its index.
        """
        question, rows = self._question(state, cause, without)
        known = question.arrivals.intersection(present) - self._always_present
        new = question.arrivals.intersection(fresh)
        key = (question, known, new, *invariants)
        decision = self._decisions.get(key)
        if decision is None:
            facts: list[Expr] = [*map(presence, sorted(known)), *invariants]
            came = tuple(map(freshness, sorted(new)))
            decided = question.decide([*map(self._formula, (*facts, *came))])
            decision = self._decisions[key] = _with_freshness(decided, came)
        return RowVerdict(rows, with_repair(decision, rows), question.arrivals)

    def _question(
        self, state: str, cause: Cause, without: int | None
    ) -> tuple[Question, tuple[Transition, ...]]:
        """What is asked about the rows of a state and cause, and these.

        States whose conditions are the same share a question.
        """
        rows = tuple([row for _, row in self._subsystem.rows(state, cause)])
        behaviour = self._subsystem.state(state).behaviour
        make = self._translator.make
        conditions = tuple(self._formula(row.condition.when) for row in rows)
        ended = ((self._formula(when), holds) for when, holds in behaviour.facts_after(cause))
        context = tuple(f if holds else make.negation(f) for f, holds in ended)
        key = conditions, context, without
        if key not in self._questions:
            axioms = [a for index, a in enumerate(self._axioms) if index != without]
            self._questions[key] = Question(conditions, context, axioms, make, self._dependencies)
        question = self._questions[key]
        return question, rows

    def is_related(self, state: str, cause: Cause, axiom: int) -> bool:
        """Whether an axiom, by its index, has to do with the rows of a state and cause."""
        question, _ = self._question(state, cause, None)
        near = connected(conjuncts(self._axioms), question.about, self._dependencies.of)
        return any(part in near for part in conjuncts((self._axioms[axiom],)))

    def related_facts(self, state: str, cause: Cause, facts: Iterable[Expr]) -> tuple[Expr, ...]:
        """The facts that have to do with the rows of a state and cause."""
        question, _ = self._question(state, cause, None)
        return tuple(fact for fact in facts if question.concerns(self._formula(fact)))

    def satisfiable(self, conditions: Iterable[Expr]) -> bool | None:
        """Whether all conditions can hold together; None if the question is too large."""
        return self._is_satisfiable([*map(self._formula, conditions)], self._axioms)

    def constant(self, condition: Expr, *, assuming: bool = True) -> bool | None:
        """The truth value of a condition that has only one; None for others and if unknown.

        The axioms are left out unless they are to be assumed.
        """
        formula = self._formula(condition)
        for asked, value in ((formula, False), (self._translator.make.negation(formula), True)):
            if self._is_satisfiable([asked], self._axioms if assuming else ()) is False:
                return value
        return None

    def implies(
        self,
        context: Iterable[Expr],
        fact: Expr,
        moment: EvaluationPoint = "conditions",
        *,
        assuming: bool = True,
    ) -> bool | None:
        """Whether the fact holds whenever the context does; None if the question is too large.

        In conditions the axioms are left out unless they are to be assumed.
        """
        if moment == "conditions":
            negated = self._translator.make.negation(self._formula(fact))
            asked = [*map(self._formula, context), negated]
            possible = self._is_satisfiable(asked, self._axioms if assuming else ())
            return None if possible is None else not possible
        translator = self._anywhere
        said = [*context, *(self._axiom_conditions if moment == "functions" else ())]
        negated = translator.make.negation(translator.formula(fact))
        possible = is_satisfiable([*map(translator.formula, said), negated])
        return None if possible is None else not possible

    def reacts(self, condition: Expr, element: Input, member: str) -> bool:
        """Whether a condition may be different because an input came with a member of its enum,
        rather than not, whatever the input was before.
        """
        make, formula = self._translator.make, self._formula(condition)
        enum = element.type
        assert isinstance(enum, Enum)
        number = self.numbering.number(element)

        def answered(value: str, fresh: bool, present: bool) -> Formula:
            def answer(atom: Atom) -> bool | None:
                match atom.variable:
                    case EnumItem(number=of) if of == number:
                        return value in atom.test
                    case Arrival(peer=peer, element=name) if (peer, name) == element.key:
                        return fresh if atom.test == "fresh" else present
                return None

            return make.substituted(formula, answer)

        came = answered(member, True, True)
        before = (answered(old, False, there) for old in enum.members for there in (True, False))
        for other in dict.fromkeys(before):
            if other is not came:
                differs = make.choice(came, make.negation(other), other)
                if is_satisfiable([differs]) is not False:
                    return True
        return any(self._reads(atom, element) for atom in atoms_of([came]))

    def _reads(self, atom: Atom, element: Input) -> bool:
        """Whether the question of an atom is about an input, directly or through lets."""
        through = self.numbering.resolve
        parts = reachable(
            [through(atom.expr)] if atom.expr else [],
            lambda part: map(through, children(part)),
        )
        return any(isinstance(part, Input) and part.key == element.key for part in parts)

    def refutes(self, conditions: Iterable[Expr]) -> bool:
        """Whether truth tables alone show that conditions never hold together, at any moment."""
        return is_satisfiable(map(self._anywhere.formula, conditions)) is False

    def contradiction(self) -> tuple[int, ...]:
        """Indices of axioms that cannot all hold, as few as suffice; empty if they can."""
        core = list(range(len(self._axioms)))
        if is_satisfiable(self._axioms) is not False:
            return ()
        for index in tuple(core):
            rest = [i for i in core if i != index]
            if is_satisfiable([self._axioms[i] for i in rest]) is False:
                core = rest
        return tuple(core)

    @cached_property
    def _anywhere(self) -> Translator:
        """Formulas about any moment, in functions as well."""
        return self._elsewhere()

    def _is_satisfiable(
        self, formulas: Iterable[Formula], axioms: Iterable[Formula]
    ) -> bool | None:
        asked = (*formulas, *axioms)
        if asked not in self._possible:
            self._possible[asked] = is_satisfiable(asked)
        return self._possible[asked]


def _with_freshness(decision: Decision, came: Iterable[Expr]) -> Decision:
    """The decision with answers that say what is known to be fresh."""
    known = tuple((each, True) for each in came)
    gap, overlap = (
        w and replace(w, answers=w.answers + known) for w in (decision.gap, decision.overlap)
    )
    return replace(decision, gap=gap, overlap=overlap) if known else decision


def with_repair(decision: Decision, rows: tuple[Transition, ...]) -> Decision:
    """The decision with a repair in terms of the other condition where none is short."""
    overlap = decision.overlap
    if overlap is None or overlap.repair is not None or overlap.repaired is None:
        return decision
    one = overlap.repaired
    (other,) = (index for index in overlap.holding if index != one)
    repair = without_other(rows[one].condition.when, rows[other].condition.when)
    return replace(decision, overlap=replace(overlap, repair=repair))
