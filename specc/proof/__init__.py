"""Proofs about conditions: one engine, which answers for whole subsystems and says why not.

A `Prover` is asked about the rows of a state and cause (do they cover all cases, do two overlap?)
or about conditions (can they hold together, does one follow?). Its answer about rows is a
`Decision`, and what refutes is a `Witness`. A question travels so:

- `translate` makes formulas of conditions: what is Boolean is structure, everything else an atom, a
  question about a variable. Expressions with the same value have the same number (`numbering`), so
  that atoms about one variable meet; conditions about `elapsed` are bisected (`clock`).
- `decide` tabulates all answers that are consistent with each other (`table`). What holds in every
  combination is proved.
- Where the table refutes and variables depend on each other (`dependencies`), or where it would be
  too large, the decision is an `OpenQuestion`. Values found by `specc.search` may refute it. If z3
  is installed, the `solver` answers it for exact numbers and for floats; no verdict depends on it.
- `witness` describes a refutation in as few words as possible, and the condition that resolves it.

Nothing here knows of messages or of generated code.
"""

from specc.proof.numbering import Depths, Numbering
from specc.proof.prover import EvaluationPoint, Prover
from specc.proof.ticks import Ticks
from specc.proof.verdict import (
    Decision,
    InputName,
    InputNames,
    RowVerdict,
    SolverAnswer,
    Witness,
    freshness,
    presence,
)

__all__ = [
    "Decision",
    "Depths",
    "EvaluationPoint",
    "InputName",
    "InputNames",
    "Numbering",
    "Prover",
    "RowVerdict",
    "SolverAnswer",
    "Ticks",
    "Witness",
    "freshness",
    "presence",
]
