"""What changed between two specifications in what they mean."""

from specc.tools.diff.record import Comparison, Difference
from specc.tools.diff.system import compare

__all__ = ["Comparison", "Difference", "compare"]
