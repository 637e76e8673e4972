"""The `specc` command."""

from specc.cli.interruption import loading

with loading():
    from specc.cli.main import main

__all__ = ["main"]
