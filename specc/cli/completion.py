"""`specc completion`: shells complete commands, options and files."""

import os
from argparse import Namespace

from specc.cli import streams
from specc.cli.parsing import Parser

ASKS = "_ARGCOMPLETE"
"""Is set where a shell asks how a command line may go on."""


def completion(options: Namespace) -> int:
    """Print the lines that a shell reads when it starts."""
    from argcomplete.shell_integration import shellcode

    streams.show(shellcode(["specc"], shell=options.shell) + "\n")
    return 0


def answer(parser: Parser) -> None:
    """End the process with the ways to go on, if that is what a shell asks."""
    if ASKS in os.environ:
        import argcomplete

        chosen = parser
        for word in os.environ.get("COMP_LINE", "").split():
            if word in chosen.commands:
                chosen = chosen.commands[word]
                chosen.prepare()
        argcomplete.autocomplete(parser)
