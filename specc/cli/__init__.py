"""The `specc` command."""

from specc.cli.interruption import exiting_on_interrupt

with exiting_on_interrupt():
    from specc.cli.main import main

__all__ = ["main"]
