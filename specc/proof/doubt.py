"""What is true of exact numbers, and not proved of those that a run has."""

from __future__ import annotations

from dataclasses import replace

from specc.proof.verdict import Decision, Facts

WAY_OUT = (
    "the generated code checks it in every run; to have it proved, compare one and the same sum "
    "in all rows, as in `a + b < c` and `not (a + b < c)`"
)
TIMED = (
    "the generated code checks it in every run; to have it proved, compare `elapsed` itself with "
    "constants"
)


def rounding(facts: Facts) -> Decision:
    """The verdict where only rounded sums can go wrong, with the answers of such a case."""
    case = " and ".join(f"`{question}` {answer}" for question, answer in facts)
    return Decision(
        unknown=f"it holds of exact numbers, but sums are rounded, which may make {case}",
        way_out=WAY_OUT,
    )


def time(refuted: Decision, question: str) -> Decision:
    """The verdict where what a run computes from the time may make a refutation wrong."""
    return replace(
        refuted,
        gap=None,
        overlap=None,
        unknown=f"proofs do not follow how `{question}` changes with the time",
        way_out=TIMED,
    )
