"""`python -m specc_runtime.describing MODEL.xml PARENT`: what MuJoCo says of a model, as JSON.

Whoever asks gets an object: facts, or `error` with the reason why there are none. Models are
strangers' files and MuJoCo is C code: this is a process of its own, with bounds, in a folder of its
own, where MuJoCo writes its log. It ends with its parent.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from contextlib import suppress

from specc_runtime.extras import remedy

_SECONDS = 300
"""Of processor time."""
_BYTES = 8_000_000_000
"""Of address space; what is used of it is a fraction."""
_WATCH_S = 0.2
_LOG = "MUJOCO_LOG.TXT"


def main(path: str, parent: int) -> None:
    """Print the facts about the model at `path`, for the process `parent`."""
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    _limit()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what C code prints is no answer
    try:
        from specc_runtime.plants.errors import PlantError
        from specc_runtime.plants.mujoco.describing import described
    except ModuleNotFoundError as error:
        json.dump({"missing": remedy(error)}, answers)
        return
    try:
        json.dump(described(path), answers)
    except PlantError as error:
        json.dump({"error": str(error)}, answers)
    except MemoryError:
        json.dump({"error": f"the model takes more than {_BYTES // 10**9} GB of memory"}, answers)


def _limit() -> None:
    if sys.platform == "win32":
        return
    import resource

    for which, wanted in ((resource.RLIMIT_CPU, _SECONDS), (resource.RLIMIT_AS, _BYTES)):
        most = resource.getrlimit(which)[1]
        least = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
        with suppress(ValueError, OSError):  # some systems have no such limit
            resource.setrlimit(which, (least, most))


def _watch(parent: int) -> None:
    """End with the parent, which then cannot remove the folder any more."""
    while os.getppid() == parent:
        time.sleep(_WATCH_S)
    with suppress(OSError):
        folder = os.getcwd()
        with suppress(FileNotFoundError):
            os.unlink(_LOG)
        os.rmdir(folder)  # only if it is empty
    os._exit(1)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
