"""What several checks, and the passes behind them, ask about a system; each computed once."""

from specc.analysis.facts import Facts
from specc.analysis.machine import Machine, RowVerdictAt

__all__ = ["Facts", "Machine", "RowVerdictAt"]
