"""What recorded runs tried of a specification, and what they did not (`specc coverage`)."""

from specc.tools.coverage.counting import Coverage, ForeignRunError, Share, total
from specc.tools.coverage.items import KINDS, CoverageItem, ItemKind

__all__ = ["KINDS", "Coverage", "CoverageItem", "ForeignRunError", "ItemKind", "Share", "total"]
