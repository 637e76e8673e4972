"""Whether a formula over related numbers, or too many facts, is satisfiable. The door to z3."""

from specc.proof.solver.solver import Theory

__all__ = ["Theory"]
