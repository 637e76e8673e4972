"""Generated code of a specification, loaded like any other package."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from types import ModuleType

from specc_runtime.loading import load_system
from specc_runtime.subsystem import Subsystem

from specc import output, pipeline
from specc.resources import specs_dir

SPECS = specs_dir()
FLAGSHIP = SPECS / "irp_picking.yaml"


def generate(spec: Path, directory: Path) -> Path:
    """The package generated from `spec`, in a folder of its own below `directory`.

    Raises:
        ValueError: the specification has errors.
    """
    built = pipeline.build(str(spec))
    if not built.result.ok:
        raise ValueError(f"{spec}: {[finding.message for finding in built.result.diagnostics]}")
    package = directory / built.system
    refused = output.write(package, built.files)
    if refused:
        raise ValueError(f"{package}: {[finding.message for finding in refused]}")
    return package


def fresh(package: Path, base: Path, name: str) -> Subsystem:
    """A subsystem of a generated package that has not started; `base` is where its files are."""
    modules = _modules(package, base)
    sys.modules.update(
        {n: m for n, m in modules.items() if n != "system"}
    )  # another package of that name may have been loaded since
    return modules["system"].build(str(base)).scheduled(name).subsystem  # type: ignore[no-any-return]  # generated


@cache
def _modules(package: Path, base: Path) -> dict[str, ModuleType]:
    """The modules of a package by their names, and the one of the system as `system`."""
    load_system(package, base)
    prefix = f"generated_{package.name}"
    found = {n: m for n, m in sys.modules.items() if n == prefix or n.startswith(f"{prefix}.")}
    return {**found, "system": found[f"{prefix}.system"]}


def module_of(kind: type) -> ModuleType:
    """The module that defines a class."""
    return sys.modules[kind.__module__]
