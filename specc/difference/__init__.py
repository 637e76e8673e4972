"""What changed between two specifications in what they mean."""

from specc.difference.record import Comparison, Difference
from specc.difference.system import compare

__all__ = ["Comparison", "Difference", "compare"]
