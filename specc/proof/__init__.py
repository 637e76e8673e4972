"""Proofs about conditions: exact on their Boolean structure, by truth tables.

What the tables are too small for is `unknown`, with a reason; another way to decide goes there.
"""

from specc.proof.numbering import Depths, Numbering
from specc.proof.prover import Moment, Prover
from specc.proof.verdict import Decision, InputName, RowVerdict, Witness

__all__ = [
    "Decision",
    "Depths",
    "InputName",
    "Moment",
    "Numbering",
    "Prover",
    "RowVerdict",
    "Witness",
]
