"""Model to plan: exactly what the templates print, in order, already named and spelled."""

from specc.lower.flow import Proofs
from specc.lower.names import FilePlan
from specc.lower.system import lower
from specc.lower.terms import TooLarge

__all__ = ["FilePlan", "Proofs", "TooLarge", "lower"]
