"""Witnesses: refutations of a specification as tests that run its generated code and fail.

A test that `specc witness` wrote imports from here what it needs: `Trial`, and what its values are
spelled with.
"""

from specc.lang.values import Fields, Token, translation
from specc.tools.witness.trial import Trial

__all__ = ["Fields", "Token", "Trial", "translation"]
