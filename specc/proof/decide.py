"""Decides whether conditions cover and exclude each other, by tables or by the solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from specc.limits import OUT_OF_STEPS, spend
from specc.proof.formula import Arrival, Atom, Formula, atoms_of
from specc.proof.numbering import Numbering
from specc.proof.relations import Relations, components, conjuncts, connected, variables_of
from specc.proof.table import Cases, DecisionProcedure, Table
from specc.proof.verdict import (
    INSTALL,
    Decision,
    InputName,
    TooLargeError,
    UnsureError,
    rounding,
    time,
)
from specc.proof.witness import describe, no_row, two_rows

if TYPE_CHECKING:
    from specc.proof.solver import Session, Theory


MOST_SESSIONS = 8
"""That are open at once: each takes 18 MB."""
_OF_A_SESSION = 4_000
"""Steps of proofs that making one takes."""


class Sessions:
    """The sessions of the solvers of a system; the one that was not asked longest makes room."""

    def __init__(self) -> None:
        self._open: dict[Solver, Session] = {}

    def of(self, solver: Solver) -> Session:
        """The session of a solver. Raises UnsureError if none can be made."""
        session = self._open.pop(solver, None)
        if session is None:
            try:
                from specc.proof.solver import Session
            except ImportError:
                message = "it needs the solver, which is not installed"
                raise UnsureError(message, INSTALL) from None
            solver.was_asked = True
            if not spend("proof", _OF_A_SESSION):
                raise UnsureError(OUT_OF_STEPS)
            if len(self._open) >= MOST_SESSIONS:
                del self._open[next(iter(self._open))]
            session = Session()
        self._open[solver] = session
        return session

    def close(self, solver: Solver) -> None:
        """Let go of the memory of a session; the next question makes it anew."""
        self._open.pop(solver, None)


class Solver:
    """The solver for the questions about one subsystem; z3 is not imported before it is asked."""

    def __init__(self, numbering: Numbering, sessions: Sessions | None = None) -> None:
        self._numbering = numbering
        self._sessions = sessions or Sessions()
        self.relations = Relations(numbering)
        self.was_asked = False
        """Whether a question has needed the solver."""

    def between(self, atoms: Sequence[Atom]) -> DecisionProcedure | None:
        """What decides about answers of the atoms; None if all are possible together."""
        return self.procedure(atoms) if self.relations.are_related(atoms) else None

    def procedure(self, atoms: Sequence[Atom]) -> DecisionProcedure:
        """What decides about answers of the atoms, whatever they have in common."""
        return DecisionProcedure(partial(self._theory, atoms))

    def _theory(self, atoms: Sequence[Atom], *, exact: bool) -> Theory:
        session = self._sessions.of(self)
        from specc.proof.solver import Theory

        return Theory(session, self._numbering, atoms, exact=exact)

    def release(self) -> None:
        """Let go of the memory of the solver; the next question makes it anew."""
        self._sessions.close(self)


# Decides on truth tables whether exactly one of several conditions holds.


class Question:
    """Whether exactly one of `conditions` holds whenever the context and the axioms do."""

    def __init__(
        self,
        conditions: Sequence[Formula],
        context: Sequence[Formula],
        axioms: Sequence[Formula],
        solver: Solver,
    ) -> None:
        """The `solver` is asked where the tables alone refute."""
        self._solver = solver
        self._conditions = conditions
        self._given = conjuncts(context)
        self.about = [*conditions, *self._given]
        """What it is about, without the axioms."""
        self._assumed = self._given + connected(conjuncts(axioms), self.about)
        others = [axiom for axiom in conjuncts(axioms) if axiom not in self._assumed]
        self._more = connected(others, self.about, solver.relations.things)
        """Axioms that are related only by what their numbers are computed from."""
        self.arrivals = frozenset(
            (variable.peer, variable.element)
            for variable in variables_of([*conditions, *self._assumed])
            if isinstance(variable, Arrival)
        )
        """Inputs about whose arrival something is asked."""

    def concerns(self, formula: Formula) -> bool:
        """Whether a formula has to do with what is asked, directly or through axioms."""
        return bool(
            connected([formula], [*self.about, *self._assumed], self._solver.relations.things)
        )

    def decide(self, facts: Sequence[Formula]) -> Decision:
        """The answer where the facts hold as well; what is unsure refutes nothing."""
        assumed = [*self._assumed, *facts]
        atoms = atoms_of([*self._conditions, *assumed, *self._more])
        unsure = [atom for atom in atoms if atom.unsure]
        decision = self._decided(assumed)
        if not unsure or not (decision.gap or decision.overlap):
            return decision
        return time(decision, unsure[0].text)

    def _decided(self, assumed: Sequence[Formula]) -> Decision:
        try:
            return self._by_table(assumed)
        except TooLargeError as error:
            reason = str(error)
        except UnsureError as error:
            return self._unknown(str(error), error.way_out)
        # What the context says of other things cannot help a proof, but makes the table larger.
        try:
            smaller = self._by_table(connected(assumed, self._conditions))
            if smaller.proved:
                return smaller
        except (TooLargeError, UnsureError):
            pass
        return self._by_solver(assumed, reason)

    def _by_table(self, assumed: Sequence[Formula]) -> Decision:
        formulas = [*self._conditions, *assumed]
        table = Table(formulas)
        decision = _decision(table, Cases(table, assumed, None, self._given), self._conditions)
        atoms = list(atoms_of(formulas))
        if decision.proved:
            return self._with_possible_rows(decision, table, assumed, atoms)
        if self._more:
            assumed = [*assumed, *self._more]
            table, atoms = Table([*formulas, *self._more]), [*atoms, *atoms_of(self._more)]
        procedure = self._solver.between(list(dict.fromkeys(atoms)))
        if procedure is None:
            return decision
        return _decision(table, Cases(table, assumed, procedure, self._given), self._conditions)

    def _with_possible_rows(
        self, proved: Decision, table: Table, assumed: Sequence[Formula], atoms: Sequence[Atom]
    ) -> Decision:
        """A proof, without rows that can never apply because of the values of their numbers."""
        procedure = self._solver.between(atoms) if self._solver.relations.in_sums(atoms) else None
        if procedure is None:
            return proved
        try:
            exact = _decision(
                table, Cases(table, assumed, procedure, self._given), self._conditions
            )
        except UnsureError:
            return proved
        return replace(exact, gap=None, overlap=None, unknown="", way_out="")

    def _by_solver(self, assumed: Sequence[Formula], reason: str) -> Decision:
        try:
            from specc.proof.solver import solve
        except ImportError:
            return self._unknown(reason)
        procedure = self._solver.procedure(list(atoms_of([*self._conditions, *assumed])))
        try:
            rounded = procedure.rounded
            return solve(rounded, lambda: procedure.exact, self._conditions, assumed)
        except UnsureError as error:
            return self._unknown(f"{reason}, and {error}", error.way_out)

    def _unknown(self, reason: str, way_out: str = "") -> Decision:
        return Decision(
            possible=True,
            satisfiable=(True,) * len(self._conditions),
            ensures=(frozenset(),) * len(self._conditions),
            unknown=reason,
            way_out=way_out,
        )


_OF_A_QUESTION = 40
"""Steps that finding out takes which parts have to do with each other, however few these are."""


def is_satisfiable(formulas: Sequence[Formula], solver: Solver | None) -> bool | None:
    """Whether all formulas can hold together; None if the question is too large.

    Without a solver they can where truth tables do not refute it.
    """
    parts = conjuncts(formulas)
    if any(part.kind == "false" for part in parts):
        return False
    if not spend("proof", _OF_A_QUESTION):
        return None
    answer: bool | None = True
    for group in components(parts):
        try:
            if not Cases(Table(group), group, None).allowed:
                return False
        except TooLargeError:
            answer = None
    if solver is None or not solver.relations.are_related(list(atoms_of(parts))):
        return answer
    for group in components(parts, solver.relations.things):
        try:
            table = Table(group)
            cases = Cases(table, group, solver.between(list(atoms_of(group))))
            if not cases.find_model(cases.allowed) and not cases.find_rounded_model(table.full):
                return False
        except (TooLargeError, UnsureError):
            answer = None
    return answer


def _decision(table: Table, cases: Cases, conditions: Sequence[Formula]) -> Decision:
    """Raises UnsureError where the decision procedure of the cases does."""
    rows = [table.bits(condition) for condition in conditions]
    enabled = both = 0
    for row in rows:
        both |= enabled & row
        enabled |= row
    without = table.full & ~enabled
    none, several = cases.find_model(without), cases.find_model(both)
    # Combinations of rounded numbers alone are left in `wrong` only where exact ones prove it.
    wrong = 0 if none or several else cases.find_rounded_model(both | without)
    asked = frozenset(atoms_of(conditions))
    facts = describe(table, wrong, cases.allowed | wrong, asked)[0] if wrong else ()
    holding = [cases.find_model(row) | cases.find_rounded_model(row) for row in rows]
    decision = Decision(
        possible=bool(cases.find_model(cases.allowed) or cases.find_rounded_model(table.full)),
        satisfiable=tuple(map(bool, holding)),
        ensures=_ensured(table, holding),
    )
    if wrong:
        decision = rounding(decision, facts)
    # What is told comes last: it may spend what questions to the decision procedure are left.
    gap = no_row(table, cases, none, conditions) if none else None
    overlap = two_rows(table, cases, several, conditions) if several else None
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
