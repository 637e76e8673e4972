"""Filling the templates with plans."""

from __future__ import annotations

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from specc.emit.format import formatted
from specc.lower.plan import (
    DevicePlan,
    PackagePlan,
    SubsystemPlan,
    SystemPlan,
    TypesPlan,
    WholePlan,
)
from specc.resources import templates_dir

TEMPLATES = {
    PackagePlan: "package.py.j2",
    TypesPlan: "types.py.j2",
    SubsystemPlan: "subsystem.py.j2",
    DevicePlan: "device.py.j2",
    WholePlan: "system.py.j2",
}


def emit(plan: SystemPlan) -> dict[str, str]:
    """Text of every generated file, by its path in the package of the system.

    Raises:
        FormatError: the formatter is missing or refuses a file.
    """
    return formatted(filled(plan))


def filled(plan: SystemPlan) -> dict[str, str]:
    """The templates filled in: valid Python, but neither sorted nor formatted."""
    environment = _environment()
    return {
        path: environment.get_template(TEMPLATES[type(part)]).render(plan=part)
        for path, part in plan.files
    }


def printed(template: str, plan: object) -> str:
    """One template filled in with a plan of its own, as formatted Python.

    Raises:
        FormatError: the formatter is missing or refuses it.
    """
    text = _environment().get_template(template).render(plan=plan)
    return formatted({"text.py": text})["text.py"]


def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(templates_dir()),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # the output is Python; lowering has spelled every text
    )
