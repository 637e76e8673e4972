"""The import of MuJoCo, which must not depend on a graphics library.

With MUJOCO_GL naming a backend whose libraries are missing, `import mujoco` itself fails. Here it
is imported without a backend; plants that draw open one later, if there is one.
"""

import importlib
import os
from typing import Any

GL_VARIABLE = "MUJOCO_GL"


def _import_without_graphics() -> Any:
    preferred = os.environ.get(GL_VARIABLE)
    os.environ[GL_VARIABLE] = "disable"
    try:
        return importlib.import_module("mujoco")
    finally:
        if preferred is None:
            del os.environ[GL_VARIABLE]
        else:
            os.environ[GL_VARIABLE] = preferred


mujoco = _import_without_graphics()
