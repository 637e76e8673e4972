"""What tables cannot decide: sums of several quantities, and too many facts. The door to z3."""

from specc.proof.solver.solver import Solver, UnsureError

__all__ = ["Solver", "UnsureError"]
