"""What several checks, and the passes behind them, ask about a system; each computed once."""

from specc.analysis.facts import Decided, Facts, Proofs
from specc.analysis.graph import Step
from specc.analysis.presence import Presence

__all__ = ["Decided", "Facts", "Presence", "Proofs", "Step"]
