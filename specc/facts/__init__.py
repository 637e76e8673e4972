"""What several checks, and the passes behind them, ask about a system; each computed once."""

from specc.facts.facts import Decided, Facts
from specc.facts.presence import Presence
from specc.facts.steps import Step
from specc.facts.summary import Proofs

__all__ = ["Decided", "Facts", "Presence", "Proofs", "Step"]
