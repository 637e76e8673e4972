"""Where the files live that are not Python: templates, and the specifications that come with specc.

An installed wheel carries them inside the package; a working tree has them beside it.
"""

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


def _data_dir(name: str) -> Path:
    candidates = (_PACKAGE / "_data" / name, _PACKAGE.parent / name)
    for candidate in candidates:
        if candidate.is_dir():
            return candidate
    looked = " nor ".join(str(candidate) for candidate in candidates)
    raise FileNotFoundError(f"this installation of specc lacks its {name}: neither {looked} exists")
