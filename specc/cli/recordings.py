"""`specc recover`: what can be done with recordings of runs; the runtime does it."""

from __future__ import annotations

from argparse import Namespace
from importlib import import_module
from pathlib import Path
from typing import Any

from specc.cli import streams


def recover(options: Namespace) -> int:
    """Make a clean file with an index of a recording that was cut; 2 if there is none in it."""
    out = Path(options.out or options.file)
    try:
        reading: Any = import_module("specc_runtime.recording.reading")
        saved = reading.Recovered(Path(options.file), out)
    except ModuleNotFoundError as error:
        return _unusable(import_module("specc_runtime.extras").remedy(error))
    except OSError as error:
        return _unusable(f"cannot write {out}: {(error.strerror or 'unknown reason').lower()}")
    except Exception as error:
        if type(error).__name__ != "Unusable":
            raise
        return _unusable(str(error))
    missing = f", {saved.damaged} damaged parts left out" if saved.damaged else ""
    words = "it had been cut" if saved.cut else "it was whole"
    streams.say(
        f"specc: {out}: {saved.messages} messages until {saved.last_s:.3f} s; {words}{missing}"
    )
    return 0


def _unusable(words: str) -> int:
    streams.say(f"specc: {words}")
    return 2
