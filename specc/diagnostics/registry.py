"""All codes, gathered from the modules of `specc.diagnostics.codes`: one module a family."""

import pkgutil
from functools import cache
from importlib import import_module

from specc.diagnostics import codes
from specc.diagnostics.code import Code


@cache
def all_codes() -> dict[str, Code]:
    """Every code by its id, in the order of ids.

    Raises:
        ValueError: two entries share an id.
    """
    entries: dict[str, Code] = {}
    for module in pkgutil.iter_modules(codes.__path__):
        for entry in import_module(f"{codes.__name__}.{module.name}").CODES:
            if entry.id in entries:
                raise ValueError(f"two codes are called {entry.id}")
            entries[entry.id] = entry
    return dict(sorted(entries.items()))
