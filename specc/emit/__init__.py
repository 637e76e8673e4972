"""Plans to files: the templates are filled, then ruff formats all files at once.

See docs/decisions/0003-formatter.md. The only door to jinja2.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from shutil import copytree, which
from tempfile import mkdtemp
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from specc.atomic_files import temporary_folder
from specc.lower import FilePlan
from specc.resources import templates_dir


def emit(plans: Mapping[str, FilePlan]) -> dict[str, str]:
    """Text of every generated file, by its path in the package of the system.

    Raises:
        FormatError: the formatter is missing or refuses a file.
    """
    return format_files(fill_templates(plans))


def fill_templates(plans: Mapping[str, FilePlan]) -> dict[str, str]:
    """The templates filled in: valid Python, but neither sorted nor formatted."""
    return {path: fill(plan.template, plan.parts) for path, plan in plans.items()}


def fill(template: str, parts: Mapping[str, Any]) -> str:
    """The text of one template."""
    return _environment(templates_dir()).get_template(template).render(parts)


@cache
def _environment(folder: Path) -> Environment:
    """The template environment of a folder; keeps compiled templates until their files change."""
    return Environment(
        loader=FileSystemLoader(folder),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # the output is Python; lowering has spelled every text
    )


# Formatting of generated code.


OPTIONS = ("--isolated", "--no-cache", "--quiet", "--target-version", "py311")
SORT_IMPORTS = ("check", *OPTIONS, "--line-length", "100", "--select", "I", "--fix")
FORMAT = ("format", *OPTIONS, "--line-length", "100")


class FormatError(Exception):
    """Generated code could not be formatted; `folder`, if any, has the unformatted text."""

    def __init__(self, message: str, folder: Path | None = None) -> None:
        super().__init__(
            f"{message}\nthe generated code is kept in {folder}" if folder else message
        )
        self.folder = folder


def format_files(files: Mapping[str, str]) -> dict[str, str]:
    """The files (relative path -> Python text) with sorted imports, formatted.

    Raises:
        FormatError: ruff is missing, or a text is not Python.
    """
    ruff = find_ruff()
    with temporary_folder() as directory:
        for path, text in files.items():
            file = directory / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        for arguments in (SORT_IMPORTS, FORMAT):
            run = subprocess.run(  # a fixed program with fixed arguments
                [ruff, *arguments, "."], cwd=directory, capture_output=True, text=True, check=False
            )
            if run.returncode:
                folder = copytree(directory, mkdtemp(prefix="specc-"), dirs_exist_ok=True)
                words = f"ruff refuses generated code: {run.stderr.strip()}"
                raise FormatError(words, Path(folder))
        return {path: (directory / path).read_text(encoding="utf-8") for path in files}


def find_ruff() -> str:
    """The program `ruff` of this environment, else the first one on the search path.

    Raises:
        FormatError: there is none.
    """
    beside = Path(sysconfig.get_path("scripts")) / "ruff"
    for candidate in (str(beside), str(Path(sys.executable).parent / "ruff"), "ruff"):
        if found := which(candidate):
            return found
    raise FormatError("ruff is missing, which formats generated code: pip install ruff")
