"""What a command needs beside the compiler, and the line that installs it here."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from urllib.parse import unquote, urlsplit

_EXTRAS = {
    "numpy": "run",
    "mujoco": "run",
    "networkx": "run",
    "pinocchio": "run",
    "rich": "run",
    "ruckig": "run",
    "cv2": "vision",
    "mcap": "record",
    "orjson": "record",
    "lz4": "record",
    "zstandard": "record",
    "rosbags": "bags",
    "apsw": "bags",
    "backports": "bags",
    "pygls": "editor",
    "lsprotocol": "editor",
    "pygraphviz": "graph",
    "matplotlib": "plot",
    "typst": "doc",
    "ziafont": "doc",
    "ziamath": "doc",
    "fontTools": "doc",
    "brotli": "doc",
    "websockets": "ui",
    "dask": "sweep",
    "distributed": "sweep",
}
"""Packages, and the extra of the package `specc` that brings each."""


def remedy(error: ModuleNotFoundError) -> str:
    """What is not installed and how to install it."""
    package = (error.name or "").partition(".")[0]
    if package not in _EXTRAS:
        return (
            f"there is no module {error.name}; "
            "install it, put it beside the specification, or add its folder to PYTHONPATH"
        )
    return lacking(package)


def lacking(package: str) -> str:
    """That a package of an extra is not installed, and the line that installs it."""
    return f"{package} is not installed: `{_pip()} install {_source(_EXTRAS[package])}` brings it"


def _pip() -> str:
    """The pip of this interpreter, as it is called from the working directory."""
    found, here = shutil.which("pip"), os.path.dirname(sys.executable)
    if found and os.path.dirname(found) == here:
        return "pip"
    inside = Path(sys.executable).is_relative_to(Path.cwd())
    python = os.path.relpath(sys.executable) if inside else sys.executable
    return f"{shlex.quote(python)} -m pip"


def _source(extra: str) -> str:
    """An extra from where specc itself is from: a folder, a repository or an index."""
    try:
        origin = distribution("specc").read_text("direct_url.json")
        where = json.loads(origin) if origin else {}
    except (PackageNotFoundError, ValueError):
        tree = Path(__file__).parents[2]
        where = {"url": tree.as_uri(), "dir_info": {"editable": True}} if _is_ours(tree) else {}
    url = where.get("url", "")
    if "vcs_info" in where:
        vcs = where["vcs_info"]
        return f"'specc[{extra}] @ {vcs['vcs']}+{url}@{vcs['commit_id']}'"
    if not url.startswith("file:") or "dir_info" not in where:
        return f"'specc[{extra}]'"
    folder = os.path.relpath(unquote(urlsplit(url).path))
    option = "-e " if where["dir_info"].get("editable") else ""
    named = folder if not folder.startswith("..") else os.path.abspath(folder)
    return option + shlex.quote(f"{named}[{extra}]")


def _is_ours(tree: Path) -> bool:
    return (tree / "pyproject.toml").is_file() and (tree / "specc" / "__init__.py").is_file()
