"""What cannot be done as it is asked, and why: commands end with that, and exit code 2."""

from __future__ import annotations

from importlib import import_module


class Refused(Exception):
    """What is asked cannot be done; the message says why, and what would help."""


def reason_of(error: OSError) -> str:
    """Why the system refuses something, such as `permission denied`."""
    return (error.strerror or "unknown reason").lower()


def missing_package(error: ModuleNotFoundError, *packages: str) -> Refused:
    """What is not installed, and how to install it; raises any error that is not of `packages`."""
    if packages and (error.name or "").partition(".")[0] not in packages:
        raise error
    return Refused(import_module("specc_runtime.extras").remedy(error))
