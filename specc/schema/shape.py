"""Data of a file to its shape, or to findings about what does not fit."""

from __future__ import annotations

from pydantic import ValidationError

from specc.diagnostics import Diagnostic
from specc.schema.errors import shape_diagnostics
from specc.schema.files import SpecFile


def shape(data: object, file: str) -> tuple[SpecFile | None, list[Diagnostic]]:
    """The shaped file, or None and what is wrong with its shape."""
    try:
        return SpecFile.model_validate(data), []
    except ValidationError as error:
        return None, shape_diagnostics(error, file, SpecFile)
