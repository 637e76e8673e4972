"""Python that a specification names is defined, as far as its text shows; nothing is imported."""

from __future__ import annotations

import ast
import os
import re
import sys
from collections.abc import Iterator
from functools import lru_cache
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader

from specc.analysis import Facts
from specc.diagnostics import Diagnostic
from specc.limits import spend
from specc.model.system import System, types_used
from specc.model.types import Opaque, Record
from specc.source import Place

MOST_BYTES = 1_000_000
"""Of a module that is read; nothing is known of a longer one."""
_DEEPEST = 20
_DEFINED = re.compile(r"^(?:class|def|async def) (\w+)", re.MULTILINE)
_DYNAMIC = frozenset(("globals", "vars", "exec", "setattr"))
"""Functions that may define names that do not stand in the text."""
_NESTED = ast.If | ast.Try | ast.With | ast.For | ast.While


def lacks(python: str, folder: str = "", known: dict[str, ModuleSpec | None] | None = None) -> bool:
    """Whether the module of a `module:name` surely does not define the name.

    The `folder` of the specification is looked into last, as in a run. Nothing is known of modules
    that are not found or have no text, such as extension modules, of those that may define names
    while they are imported, and of those beyond the allowance of a run. `known` gets the modules
    that are found, so that each is looked for once.
    """
    module, _, name = python.partition(":")
    path = _source_of(module, folder, {} if known is None else known)
    if path is None or not name:
        return False
    try:
        found = os.stat(path)
        text = _text(path, found.st_mtime_ns, found.st_size)
        if name in _names_by_lines(text):
            return False
        if not spend("modules", len(text)):
            return False
        names = _names(text)
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    package = os.path.dirname(path) if os.path.basename(path) == "__init__.py" else ""
    is_module = package and any(
        os.path.exists(os.path.join(package, name + end)) for end in ("", ".py")
    )
    return names is not None and name.partition(".")[0] not in names and not is_module


def _source_of(module: str, folder: str, known: dict[str, ModuleSpec | None]) -> str | None:
    """The file of a module; its packages are looked into and not imported."""
    if module.partition(".")[0] in sys.builtin_module_names or module.count(".") >= _DEEPEST:
        return None
    spec = _spec_of(module, folder, known)
    return spec.origin if spec and isinstance(spec.loader, SourceFileLoader) else None


def _spec_of(module: str, folder: str, known: dict[str, ModuleSpec | None]) -> ModuleSpec | None:
    if module not in known:
        package, _, name = module.rpartition(".")
        folders = [*sys.path, os.path.realpath(folder)]
        if package:
            above = _spec_of(package, folder, known)
            folders = list((above and above.submodule_search_locations) or ())
        known[module] = PathFinder.find_spec(name, folders)  # with a dot, it would look for more
    return known[module]


@lru_cache(maxsize=256)
def _text(path: str, changed_ns: int, size: int) -> str:
    """The text of a module; raises OSError, or ValueError for one that is too long or no text."""
    if size > MOST_BYTES:
        raise ValueError
    with open(path, encoding="utf-8") as file:
        return file.read(MOST_BYTES)


@lru_cache(maxsize=256)
def _names_by_lines(text: str) -> frozenset[str]:
    """The names of classes and functions at the top of a module, found line by line."""
    return frozenset(_DEFINED.findall(text))


@lru_cache(maxsize=256)
def _names(text: str) -> frozenset[str] | None:
    """The names at the top of a module; None where it may define others."""
    tree = ast.parse(text)
    named = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    names = frozenset(_names_defined_by(tree.body))
    return None if named & _DYNAMIC or {"__getattr__", "*"} & names else names


def _names_defined_by(body: list[ast.stmt]) -> Iterator[str]:
    for node in body:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name
            case ast.ClassDef(name=name):
                yield name
            case ast.Import(names=names) | ast.ImportFrom(names=names):
                yield from (alias.asname or alias.name.partition(".")[0] for alias in names)
            case _:
                yield from (n.id for n in ast.walk(node) if isinstance(n, ast.Name))
                if isinstance(node, _NESTED):
                    inside = ast.iter_child_nodes(node)
                    yield from _names_defined_by(
                        [part for part in inside if isinstance(part, ast.stmt)]
                    )
                    handlers = getattr(node, "handlers", [])
                    yield from _names_defined_by(
                        [part for handler in handlers for part in handler.body]
                    )


def names_defined(facts: Facts) -> Iterator[Diagnostic]:
    """W0241, once for each object that is named."""
    folder = os.path.dirname(facts.system.file)
    known: dict[str, ModuleSpec | None] = {}
    for python, place in dict(_named_objects(facts.system)).items():
        if lacks(python, folder, known):
            module, _, name = python.partition(":")
            yield Diagnostic(
                "W0241",
                f"the module `{module}` does not define `{name}`",
                place,
                help="correct the name, or define it in the module",
            )


def _named_objects(system: System) -> Iterator[tuple[str, Place]]:
    """Yield the Python objects that a system names, with their places."""
    for operator in system.operators:
        yield operator.python, operator.place.below("python")
    places = {named.name: named.place for named in system.types}
    for type_ in types_used(system):
        if isinstance(type_, Record | Opaque) and type_.name in places:
            place = places[type_.name]
            yield type_.python, place.below("python")
            if isinstance(type_, Opaque):
                verbs = zip(("encode", "decode"), type_.codec, strict=False)
                yield from ((codec, place.below("codec", verb)) for verb, codec in verbs)
    if system.plant is not None:
        yield system.plant.python, system.plant.place.below("python")
        for binding in system.plant.bindings:
            yield binding.through, binding.place.below("through")
    if system.task is not None:
        yield system.task.scene, system.task.place.below("scene")
        yield system.task.judge, system.task.place.below("judge")
