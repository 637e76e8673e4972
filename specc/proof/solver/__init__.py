"""What tables cannot decide: relations between numbers, and too many facts. The door to z3."""

from specc.proof.solver.solver import Session, Theory, solve

__all__ = ["Session", "Theory", "solve"]
