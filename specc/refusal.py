"""What cannot be done as it is asked, and why: commands end with that, and exit code 2."""

from __future__ import annotations


class Refused(Exception):
    """What is asked cannot be done; the message says why, and what would help."""


def reason_of(error: OSError) -> str:
    """Why the system refuses something, such as `permission denied`."""
    return (error.strerror or "unknown reason").lower()
