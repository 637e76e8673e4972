"""Where the files live that are not Python: templates, and the specifications that come with specc.

An installed wheel carries them inside the package; a working tree has them beside it.

Parts of the library are named `specc:pose_tracker`, on all machines alike. This name stands for the
path of the file wherever paths of specifications do; `on_disk` tells where the file is.
"""

import os
import re
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def templates_dir() -> Path:
    """Directory of the templates that generated code is printed from.

    Raises:
        FileNotFoundError: neither the package nor the working tree has it.
    """
    return _data_dir("templates")


def specs_dir() -> Path:
    """Directory of the specifications, plants and object models that come with specc.

    Raises:
        FileNotFoundError: neither the package nor the working tree has it.
    """
    return _data_dir("specs")


LIBRARY = "specc:"
"""What names of parts of the library begin with."""

_PART_NAME = re.compile(r"\w+", re.ASCII)


def is_library_part(path: str) -> bool:
    """Whether a path is the name of a part of the library, which need not exist."""
    return path.startswith(LIBRARY)


@cache
def library_parts() -> tuple[str, ...]:
    """The names of all parts of the library, `specc:` included."""
    return tuple(sorted(f"{LIBRARY}{path.stem}" for path in _library_dir().glob("*.yaml")))


def on_disk(path: str) -> str:
    """Where a file is: a part of the library in this installation, any other where its path says.

    What cannot be the name of a part stays as it is; there is no such file.
    """
    name = path.removeprefix(LIBRARY)
    if not is_library_part(path) or not _PART_NAME.fullmatch(name):
        return path
    return str(_library_dir() / f"{name}.yaml")


def library_name(path: str) -> str:
    """The name of the part of the library that a file is; any other path as it is."""
    folder, file = os.path.split(path)
    name = f"{LIBRARY}{file.removesuffix('.yaml')}"
    is_part = file.endswith(".yaml") and os.path.realpath(folder) == str(_library_dir())
    return name if is_part and name in library_parts() else path


@cache
def _library_dir() -> Path:
    return (specs_dir() / "lib").resolve()


def _data_dir(name: str) -> Path:
    candidates = (_PACKAGE / "_data" / name, _PACKAGE.parent / name)
    for candidate in candidates:
        if candidate.is_dir():
            return candidate
    looked = " nor ".join(str(candidate) for candidate in candidates)
    raise FileNotFoundError(f"this installation of specc lacks its {name}: neither {looked} exists")
