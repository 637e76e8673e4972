"""Lets `python -m specc` stand for the `specc` command."""

import sys

from specc.cli import main

if __name__ == "__main__":
    sys.exit(main())
