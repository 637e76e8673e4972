"""Names are terms of the field: a participle that could stand for anything says nothing."""

import ast
from collections.abc import Iterator

import pytest

from tests.house.tree import Module, modules

BANNED = {
    "told", "said", "asked", "kept", "held", "settled", "lasting", "misfit", "misfits", "vague",
    "meant", "spelt", "spelled", "taken",
}  # fmt: skip
"""Words that are no names by themselves, private ones included; as part of a name they may do."""
OF_GENERATED_CODE = {
    "specc_runtime.ages": {"asked", "held"},
    "specc_runtime.requirement": {"asked"},
}
"""Arguments that packages give that people have built already."""


def defined(module: Module) -> Iterator[tuple[str, int]]:
    """The names that a module defines, each with its line: what it imports is named elsewhere."""
    for node in ast.walk(ast.parse(module.path.read_text(encoding="utf-8"))):
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name, node.lineno
            case ast.ClassDef(name=name) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield name, node.lineno


@pytest.mark.parametrize(("root", "package"), [("runtime", "specc_runtime"), (".", "specc")])
def test_no_name_is_a_bare_participle(root: str, package: str) -> None:
    found = [
        f"{module.name}:{line}: {name}"
        for module in modules(root, package)
        for name, line in defined(module)
        if name.lower().strip("_") in BANNED and name not in OF_GENERATED_CODE.get(module.name, ())
    ]
    assert found == []
