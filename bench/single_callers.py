"""How many functions of a package have one caller, and how many of them are short.

A call is any use of a function's name. A private name is looked for in its own module, a public
one in the whole package. Left out: functions of one name in several places of that range, since
their uses are not told apart; special methods; functions that a decorator other than of the
standard library registers somewhere; overridden methods.
"""

from __future__ import annotations

import argparse
import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bench.harness.tables import table

ROOT = Path(__file__).resolve().parents[1]
SHORT = 5
"""Lines of code, without signature, docstring and comments, up to which a function is short."""
HARMLESS = {"property", "cached_property", "staticmethod", "classmethod", "contextmanager", "cache"}
Def = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, slots=True)
class Function:
    """A function or method of a module."""

    module: Path
    name: str
    code_lines: int


def code_lines(node: Def, lines: list[str]) -> int:
    """Lines of the body without its docstring, comments and empty lines."""
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    if not body:
        return 0
    text = (line.strip() for line in lines[body[0].lineno - 1 : node.end_lineno])
    return sum(bool(line) and not line.startswith("#") for line in text)


def functions(path: Path, source: str, tree: ast.Module) -> Iterator[Function]:
    """Functions of a module whose callers can be counted."""
    lines = source.splitlines()
    for node in ast.walk(tree):
        if isinstance(node, Def) and not node.name.startswith("__"):
            decorators = {ast.unparse(one).split("(")[0] for one in node.decorator_list}
            if decorators <= HARMLESS:
                yield Function(path, node.name, code_lines(node, lines))


def uses(tree: ast.Module) -> Counter[str]:
    """How often each name is read, as a name or an attribute."""
    names: Counter[str] = Counter()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            names[node.id] += 1
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load):
            names[node.attr] += 1
    return names


def docstring_lines(tree: ast.Module) -> int:
    """Lines of texts that are statements: docstrings, and those below attributes."""
    return sum(
        (node.end_lineno or node.lineno) - node.lineno + 1
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def with_one_caller(package: Path) -> Iterator[Function]:
    """Functions of a package whose name is used once."""
    found: list[Function] = []
    used: dict[Path, Counter[str]] = {}
    for path in sorted(package.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        found += functions(path, source, tree)
        used[path] = uses(tree)
    everywhere = sum(used.values(), Counter[str]())
    in_package = Counter(function.name for function in found)
    in_module = Counter((function.module, function.name) for function in found)
    for function in found:
        private = function.name.startswith("_")
        alike = in_module[function.module, function.name] if private else in_package[function.name]
        calls = (used[function.module] if private else everywhere)[function.name]
        if alike == 1 and calls == 1:
            yield function


def main() -> None:
    """Print a row for each package."""
    parser = argparse.ArgumentParser(description=__doc__, prog="python -m bench.single_callers")
    parser.add_argument("package", nargs="?", type=Path, default=ROOT / "specc")
    parser.add_argument("--list", action="store_true", help="list the short ones")
    arguments = parser.parse_args()
    package: Path = arguments.package.resolve()
    once = list(with_one_caller(package))
    short = [function for function in once if function.code_lines <= SHORT]
    if arguments.list:
        for function in short:
            print(f"{function.module.relative_to(package.parent)}: {function.name}")
    groups: dict[str, list[int]] = {}
    for path in sorted(package.rglob("*.py")):
        names = path.relative_to(package).parts[:-1]
        group = "/".join(names[: 2 if names[:1] == ("tools",) else 1]) or "."
        row = groups.setdefault(group, [0] * 5)
        row[0] += 1
        source = path.read_text(encoding="utf-8")
        row[1] += source.count("\n")
        row[2] += docstring_lines(ast.parse(source))
        row[3] += sum(function.module == path for function in once)
        row[4] += sum(function.module == path for function in short)
    total = [sum(column) for column in zip(*groups.values(), strict=True)]
    rows = [[name, *map(str, row)] for name, row in [*groups.items(), ("all", total)]]
    short_head = f"of these up to {SHORT} lines"
    heads = ["package", "modules", "lines", "of docstrings", "one caller", short_head]
    print(table("Functions with one caller", heads, rows))


if __name__ == "__main__":
    main()
