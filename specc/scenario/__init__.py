"""Scenarios: refutations of a specification as tests that run its generated code and fail.

A scenario file that `specc witness` wrote imports from here what it needs: `Trial`, and what its
values are spelled with.
"""

from specc.expr.evaluate_builtins import translation
from specc.scenario.trial import Trial
from specc.scenario.values import Fields, Token

__all__ = ["Fields", "Token", "Trial", "translation"]
