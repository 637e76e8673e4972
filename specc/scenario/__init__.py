"""Scenarios: refutations of a specification as tests that run its generated code and fail.

A scenario file that `specc witness` wrote imports from here what it needs: `Trial`, and what its
values are spelled with.
"""

from specc.example.situation import Fields, Token
from specc.lang.evaluate import translation
from specc.scenario.trial import Trial

__all__ = ["Fields", "Token", "Trial", "translation"]
