"""Decides by truth tables whether conditions cover all cases and exclude each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from specc.limits import spend
from specc.model.expr import Expr
from specc.proof.dependencies import Dependencies, components, conjuncts, connected, variables_of
from specc.proof.formula import Answered, Arrival, EnumItem, Formula, Formulas, atoms_of
from specc.proof.table import Column, Table
from specc.proof.verdict import (
    INSTALL,
    ROUNDED,
    Decision,
    FactTexts,
    InputName,
    SolverAnswer,
    SolverError,
    TooLargeError,
    TruthAssignment,
    Witness,
    untracked_time,
)
from specc.proof.witness import fact_texts, gap_witness, overlap_witness, truth_assignment

# What tables leave open: the solver may answer it, or values that somebody finds.


@dataclass(frozen=True, eq=False, slots=True)
class FormulaQuestion:
    """Whether exactly one of `conditions` holds where all of `assumed` do, left open by tables."""

    conditions: tuple[Formula, ...]
    assumptions: tuple[Formula, ...]
    make: Formulas
    dependencies: Dependencies
    reason: str = ""
    """Why tables do not decide it; empty where values of numbers depend on each other."""

    @property
    def faults(self) -> tuple[Formula, Formula]:
        """That no condition holds, and that two do."""
        make, rows = self.make, self.conditions
        several = make.disjunction(map(make.conjunction, combinations(rows, 2)))
        return make.negation(make.disjunction(rows)), several

    def solve(self) -> SolverAnswer:
        """What the solver says, if it is installed."""
        try:
            return self._solve()
        except SolverError as error:
            reasons = filter(None, (self.reason, str(error)))
            return SolverAnswer(unknown=", and ".join(reasons), way_out=error.way_out)

    def _solve(self) -> SolverAnswer:
        rounded = self.models(self.faults)
        if rounded == [None, None]:
            return SolverAnswer()
        exact = self.models(self.faults, exact=True)
        if exact == [None, None]:
            broken = next(model for model in rounded if model is not None)
            facts = self.witness(broken, self._holding_conditions(broken)).facts
            case = " and ".join(f"`{question}` {answer}" for question, answer in facts)
            words = "it is true of exact numbers, but floats are rounded, which may make"
            return SolverAnswer(unknown=f"{words} {case}", way_out=ROUNDED)
        gap, overlap = (
            None if model is None else self.witness(model, self._holding_conditions(model))
            for model in exact
        )
        return SolverAnswer(gap, overlap)

    def models(
        self, faults: Sequence[Formula], *, exact: bool = False
    ) -> list[list[Answered] | None]:
        """Answers with which each of the formulas holds, and all that is assumed.

        Raises:
            SolverError: the solver does not say, or is not installed.
        """
        try:
            from specc.proof.solver import Theory
        except ImportError:
            raise SolverError("it needs the solver, which is not installed", INSTALL) from None
        atoms = list(atoms_of([*self.conditions, *self.assumptions]))
        theory = Theory(self.dependencies.numbering, atoms, exact=exact)
        return [theory.find_model(self.make.conjunction([*self.assumptions, f])) for f in faults]

    def witness_of(self, value: Callable[[Expr], object], holding: tuple[int, ...]) -> Witness:
        """The witness of a situation; see `OpenQuestion`."""
        answers: list[Answered] = []
        for atom in atoms_of(self.conditions):
            variable, test = atom.variable, atom.test
            if isinstance(variable, EnumItem) and variable.expr is not None:
                if (member := value(variable.expr)) is not None:
                    answers.append((atom, member in test))
            elif atom.expr is not None and (yes := value(atom.expr)) is not None:
                answers.append((atom, bool(yes) is atom.holds_if))
        return self.witness(answers, holding)

    def witness(self, answers: Sequence[Answered], holding: tuple[int, ...]) -> Witness:
        """As few of the answers as lead to the two conditions `holding`, or to none."""
        make, rows, known = self.make, self.conditions, dict(answers)
        fault = [make.negation(row) for row in rows]
        if holding:
            fault = [rows[index] for index in holding]
        for atom in list(known):
            rest = {other: yes for other, yes in known.items() if other is not atom}
            if all(make.substituted(part, rest.get) is make.true for part in fault):
                known = rest
        facts: FactTexts = ()
        truth_values: TruthAssignment = ()
        for variable in dict.fromkeys(atom.variable for atom in known):
            atoms = tuple(atom for atom in known if atom.variable == variable)
            column = Column(variable, atoms, (tuple(known[atom] for atom in atoms),), 1)
            facts += tuple(fact_texts(column, 0, frozenset(atoms)))
            truth_values += tuple(truth_assignment(column, 0))
        values_by_atom = {make.atom(atom): yes for atom, yes in known.items()}
        known_formula = make.conjunction(
            f if yes else make.negation(f) for f, yes in values_by_atom.items()
        )
        others = is_satisfiable([*self.assumptions, *fault, make.negation(known_formula)])
        return Witness(facts, holding, answers=truth_values, is_partial=others is not False)

    def _holding_conditions(self, answers: Sequence[Answered]) -> tuple[int, ...]:
        """Two of the conditions that hold with these answers, or none."""
        known, make = dict(answers), self.make
        holds = (make.substituted(row, known.get) is make.true for row in self.conditions)
        return tuple(index for index, yes in enumerate(holds) if yes)[:2]


# Decides on truth tables whether exactly one of several conditions holds.


class Question:
    """Whether exactly one of `conditions` holds whenever the context and the axioms do."""

    def __init__(
        self,
        conditions: Sequence[Formula],
        context: Sequence[Formula],
        axioms: Sequence[Formula],
        make: Formulas,
        dependencies: Dependencies,
    ) -> None:
        self._make = make
        self._dependencies = dependencies
        self._conditions = tuple(conditions)
        self._context = conjuncts(context)
        self.about = [*conditions, *self._context]
        """What it is about, without the axioms."""
        self._assumptions = self._context + connected(conjuncts(axioms), self.about)
        others = [axiom for axiom in conjuncts(axioms) if axiom not in self._assumptions]
        self._related_axioms = connected(others, self.about, dependencies.of)
        """Axioms that are related only by what their numbers are computed from."""
        self.arrivals = frozenset(
            (variable.peer, variable.element)
            for variable in variables_of([*conditions, *self._assumptions])
            if isinstance(variable, Arrival)
        )
        """Inputs about whose arrival something is asked."""

    def concerns(self, formula: Formula) -> bool:
        """Whether a formula has to do with what is asked, directly or through axioms."""
        about = [*self.about, *self._assumptions]
        return bool(connected([formula], about, self._dependencies.of))

    def decide(self, facts: Sequence[Formula]) -> Decision:
        """The answer where the facts hold as well; what is unsure refutes nothing."""
        assumed = [*self._assumptions, *facts]
        try:
            decision, reason = self._decide_by_table(assumed), ""
        except TooLargeError as error:
            decision, reason = self._without_context(assumed, str(error)), str(error)
        if decision.proved:
            return decision
        every = [*assumed, *self._related_axioms]
        atoms = list(atoms_of([*self._conditions, *every]))
        unsure = [atom for atom in atoms if atom.is_uncertain]
        if unsure:
            return untracked_time(decision, unsure[0].text)
        if not reason and not self._dependencies.are_related(atoms):
            return decision
        rows, make = self._conditions, self._make
        question = FormulaQuestion(rows, tuple(every), make, self._dependencies, reason)
        if question.faults == (make.false, make.false):  # of a condition and its opposite
            return replace(decision, unknown="")
        unknown = reason or "the numbers in these conditions depend on each other"
        return replace(decision, gap=None, overlap=None, unknown=unknown, open=question)

    def _without_context(self, assumed: Sequence[Formula], reason: str) -> Decision:
        """What the context says of other things cannot help, but makes a table larger."""
        try:
            smaller = self._decide_by_table(connected(assumed, self._conditions))
            if smaller.proved:
                return smaller
        except TooLargeError:
            pass
        count = len(self._conditions)
        return Decision(True, (True,) * count, (frozenset(),) * count, unknown=reason)

    def _decide_by_table(self, assumed: Sequence[Formula]) -> Decision:
        """Decide whether exactly one condition holds in all cases; describe a gap or an overlap."""
        table = Table([*self._conditions, *assumed])
        allowed = table.all_of(assumed)
        rows = [table.bits(condition) for condition in self._conditions]
        enabled = both = 0
        for row in rows:
            both |= enabled & row
            enabled |= row
        holding = [row & allowed for row in rows]
        without, several = allowed & ~enabled, allowed & both
        decision = Decision(bool(allowed), tuple(map(bool, holding)), _ensured(table, holding))
        gap = (
            gap_witness(table, allowed, without, self._conditions, self._context)
            if without
            else None
        )
        if not several:
            return replace(decision, gap=gap)
        overlap = overlap_witness(table, allowed, several, self._conditions, self._context)
        return replace(decision, gap=gap, overlap=overlap)


def _ensured(table: Table, holding: Sequence[int]) -> tuple[frozenset[InputName], ...]:
    """The inputs that cannot be absent where each condition holds."""
    absent: list[tuple[InputName, int]] = []
    for column in table.columns:
        if isinstance(column.variable, Arrival):
            without = [i for i, answers in enumerate(column.answers) if not any(answers)]
            name = column.variable.peer, column.variable.element
            absent.append((name, sum(table.where(column, i) for i in without)))
    return tuple(frozenset(name for name, bits in absent if not bits & holds) for holds in holding)


_OF_A_QUESTION = 40
"""Steps that finding out takes which parts have to do with each other, however few these are."""


def is_satisfiable(formulas: Iterable[Formula]) -> bool | None:
    """Whether truth tables let all formulas hold together; None if they are too large."""
    parts = conjuncts(formulas)
    if any(part.kind == "false" for part in parts):
        return False
    if not spend("proof", _OF_A_QUESTION):
        return None
    answer: bool | None = True
    for group in components(parts):
        try:
            if not Table(group).all_of(group):
                return False
        except TooLargeError:
            answer = None
    return answer
