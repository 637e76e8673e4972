"""What changed between two specifications in what they mean."""

from specc.tools.diff.changes import Comparison, Difference
from specc.tools.diff.systems import compare

__all__ = ["Comparison", "Difference", "compare"]
