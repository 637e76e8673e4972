"""What stands in the working tree, for the tests that judge it."""

import ast
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, slots=True)
class Module:
    """A Python module by its dotted name."""

    name: str
    path: Path

    def imports_of(self, known: set[str]) -> Iterator[str]:
        """Those of the `known` modules that it imports: late ones, and for types only, as well."""
        for node in _parsed(self.path).importing:
            if isinstance(node, ast.Import):
                yield from {alias.name for alias in node.names} & known
            elif isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    below = f"{node.module}.{alias.name}"
                    yield from {below if below in known else node.module} & known

    def imports(self) -> Iterator[str]:
        """Dotted names that the module imports, anywhere in it, relative ones resolved."""
        package = self.name.split(".")
        if self.path.name != "__init__.py":
            package = package[:-1]
        for node in _parsed(self.path).importing:
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                above = package[: len(package) - node.level + 1] if node.level else []
                yield ".".join([*above, *filter(None, [node.module])])
            elif isinstance(node, ast.Call):
                yield from _imported_by_call(node)

    def defined(self) -> Iterable[tuple[str, int]]:
        """The names that it defines, each with its line: what it imports is named elsewhere."""
        return _parsed(self.path).defined


class _Parsed(NamedTuple):
    """What tests ask of a module: whole trees of all modules would take much memory."""

    importing: list[ast.Import | ast.ImportFrom | ast.Call]
    """What may import something."""
    defined: list[tuple[str, int]]


@cache
def _parsed(path: Path) -> _Parsed:
    """A module, which is parsed once."""
    found = _Parsed([], [])
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Import() | ast.ImportFrom():
                found.importing.append(node)
            case ast.Call() if any(_imported_by_call(node)):
                found.importing.append(node)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                found.defined.append((name, node.lineno))
            case ast.ClassDef(name=name) | ast.arg(arg=name):
                found.defined.append((name, node.lineno))
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                found.defined.append((name, node.lineno))
    return found


def _imported_by_call(node: ast.Call) -> Iterator[str]:
    """The name in `import_module("name")`, absolute and written out."""
    called = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if called in {"import_module", "__import__"} and node.args:
        name = node.args[0]
        if isinstance(name, ast.Constant) and isinstance(name.value, str):
            yield name.value


@cache
def modules(root: str, under: str) -> tuple[Module, ...]:
    """Modules of the package or folder `under` that is imported from the folder `root`."""
    base = ROOT / root
    return tuple(
        Module(
            ".".join(path.relative_to(base).with_suffix("").parts).removesuffix(".__init__"), path
        )
        for path in sorted((base / under).rglob("*.py"))
    )


@cache
def tracked_files() -> tuple[Path, ...]:
    """Files under version control that exist, with those about to be added."""
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    paths = (ROOT / name for name in listing.split("\0") if name)
    return tuple(path for path in paths if path.is_file())


def text_of(path: Path) -> str | None:
    """Text of a file, or None when it is binary."""
    content = path.read_bytes()
    if b"\0" in content:
        return None
    return content.decode("utf-8", errors="replace")
