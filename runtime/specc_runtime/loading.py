"""Finding what a run needs by name: the generated system, the scene and the judge."""

from __future__ import annotations

import sys
import traceback
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from specc_runtime.options import UsageError
from specc_runtime.system import System


def load_system(directory: Path, base: Path) -> System:
    """The system of a generated package, with files relative to `base`.

    Raises UsageError when there is no such package or a file that it names is missing.
    """
    package = directory.resolve()
    if not (package / "system.py").is_file():
        raise UsageError(f"{directory} is not a generated system: it has no system.py")
    module = _import(package)
    try:
        system = module.build(str(base))
    except OSError as error:
        raise UsageError(f"{error.filename or base}: {error.strerror or error}") from error
    if not isinstance(system, System):
        raise UsageError(f"{directory}: build() gives no system")
    return system


def load_class(path: str) -> Any:
    """The class that `module:Class` names. Raises UsageError when there is none."""
    module_name, _, class_name = path.partition(":")
    try:
        return getattr(import_module(module_name), class_name)
    except AttributeError as error:
        raise UsageError(f"cannot load {path!r}: {error}") from error
    except Exception as error:  # the user's own module may raise anything
        raise UsageError(f"cannot load {path!r}: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """What is wrong with the user's own modules, and what would help."""
    if isinstance(error, ModuleNotFoundError):
        return f"there is no module {error.name}; install it, or add its folder to PYTHONPATH"
    if isinstance(error, ImportError | SyntaxError):
        return str(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"


def _import(package: Path) -> ModuleType:
    """The module `system` of a package, from that place even if another has the same name."""
    name = package.name
    if not name.isidentifier():
        raise UsageError(f"{package} cannot be imported: {name!r} is not a name")
    for known in [m for m in sys.modules if m == name or m.startswith(f"{name}.")]:
        if not str(getattr(sys.modules[known], "__file__", "") or "").startswith(str(package)):
            del sys.modules[known]
    sys.path.insert(0, str(package.parent))
    try:
        return import_module(f"{name}.system")
    except Exception as error:  # modules of operators may raise anything
        raise UsageError(f"cannot import the operators of {name}: {_reason(error)}") from error
    finally:
        sys.path.remove(str(package.parent))
