"""`python -m specc_runtime.describing MODEL.xml`: what a MuJoCo model says of itself, as JSON.

Whoever asks gets an object: facts, or `error` with the reason why there are none. Models are
strangers' files and MuJoCo is C code: this is a process of its own.
"""

from __future__ import annotations

import json
import os
import sys

from specc_runtime.extras import remedy


def main(path: str) -> None:
    """Print the facts about the model at `path`."""
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


if __name__ == "__main__":
    main(sys.argv[1])
