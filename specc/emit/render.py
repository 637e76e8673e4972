"""Filling the templates with plans."""

from __future__ import annotations

from collections.abc import Mapping

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from specc.emit.format import formatted
from specc.lower import FilePlan
from specc.resources import templates_dir


def emit(plans: Mapping[str, FilePlan]) -> dict[str, str]:
    """Text of every generated file, by its path in the package of the system.

    Raises:
        FormatError: the formatter is missing or refuses a file.
    """
    return formatted(filled(plans))


def filled(plans: Mapping[str, FilePlan]) -> dict[str, str]:
    """The templates filled in: valid Python, but neither sorted nor formatted."""
    environment = Environment(
        loader=FileSystemLoader(templates_dir()),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # the output is Python; lowering has spelled every text
    )
    return {
        path: environment.get_template(plan.template).render(plan.parts)
        for path, plan in plans.items()
    }
