"""Running generated code in this process, without importing the runtime before it is needed."""

import traceback
from importlib import import_module

from specc.cli import streams

_RUNTIME = "specc_runtime"


def launch(arguments: list[str]) -> int:
    """Exit code of a run of generated code; `arguments` are those of the runtime's command.

    Raises:
        SystemExit: the runtime ended the process by itself.
    """
    try:
        runtime = import_module(f"{_RUNTIME}.main")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != _RUNTIME:
            raise
        streams.say("specc: the runtime (package specc_runtime) is not installed")
        return 2
    try:
        return int(runtime.main(arguments) or 0)
    except Exception:  # noqa: BLE001 - operators are the user's own: their traceback mends them
        traceback.print_exc()
        return 1
