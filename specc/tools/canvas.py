"""Pictures by matplotlib. The door to it: the same content gives the same bytes.

Settings are matplotlib's defaults and the style below; no `matplotlibrc` of a user is read.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import chdir, contextmanager, nullcontext
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

_STYLE: Any = {
    "svg.hashsalt": "specc",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "text.parse_math": False,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
_UNDATED: Any = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@contextmanager
def figure(width_in: float, height_in: float) -> Iterator[Any]:
    """A figure to draw on, whose parts find their places when it is `content`.

    Raises ModuleNotFoundError where matplotlib is not installed.
    """
    matplotlib = _library()
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**matplotlib.rcParamsDefault, **_STYLE}):
        yield Figure(figsize=(width_in, height_in), layout="constrained")


def _library() -> Any:
    """Matplotlib. Raises ModuleNotFoundError."""
    found = None if "matplotlib" in sys.modules else find_spec("matplotlib")
    # Its import reads the `matplotlibrc` of the working folder, before any other one; here that is
    # the file of the defaults.
    with chdir(_folder_of_defaults(found.origin)) if found and found.origin else nullcontext():
        import matplotlib
    return matplotlib


def _folder_of_defaults(origin: str) -> Path:
    folder = Path(origin).with_name("mpl-data")
    return folder if folder.is_dir() else folder.parent


def content(drawn: Any, form: str) -> bytes:
    """The bytes of a file with a figure."""
    file = BytesIO()
    drawn.savefig(file, format=form, dpi=110, metadata=_UNDATED[form])
    return file.getvalue()


def text_width(text: str, size: float) -> float:
    """Points that a text of one line takes."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size)
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])
