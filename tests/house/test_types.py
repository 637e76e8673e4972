"""A type is known by its class in `specc/model/types.py` and its row in `specc/lang/kinds.py`."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest
from specc_runtime import contracts, forms

from specc.lang import Environment, evaluate
from specc.lang.kinds import KINDS, first_value, kind, other_values
from specc.lang.values import NotRecorded
from specc.model import types as t
from specc.model.types import Type
from specc.model.units import RADIAN

SPECC = Path(__file__).resolve().parents[2] / "specc"
TABLE = {"model/types.py", "lang/kinds.py"}
NAMES = {constructor.__name__ for constructor in KINDS}
FEW = 2
"""Constructors that a function may ask for: more are a choice by constructor."""
OTHER_CHOICES = {
    "rules of operators and literals: which types go together, and what helps if they do not": {
        "lang/operators.py": {"_product_type"},
        "lang/names.py": {"_infer_items", "_item", "items"},
        "lang/context.py": {"_shape_help", "fits", "mismatch", "unify"},
    },
    "how types are spelt": {
        "lang/types.py": {"TypeReader._element", "TypeReader._partial_base"},
    },
    "what differs between two types of one text, or two versions of a type": {
        "checks/structure.py": {"_type_details"},
        "tools/diff/equivalence.py": {"_type_parts", "type_text"},
    },
}
"""Reason -> module -> functions."""


def named(node: ast.AST) -> str:
    return node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")


def asked(node: ast.AST) -> Iterator[str]:
    """Names that a node compares with the class of a value."""
    match node:
        case ast.Call(func=ast.Name(id="isinstance"), args=[_, classes]):
            yield from map(named, ast.walk(classes))
        case ast.MatchClass(cls=cls):
            yield named(cls)
        case ast.Dict(keys=keys):
            yield from (named(key) for key in keys if key is not None)
        case ast.Compare(ops=[ast.Is() | ast.IsNot()], comparators=[cls]):
            yield named(cls)


def choices(tree: ast.AST, path: str = "") -> Iterator[tuple[str, set[str]]]:
    """Functions, and tables of modules, with the constructors that they ask for."""
    for node in ast.iter_child_nodes(tree):
        inside = f"{path}{getattr(node, 'name', '')}"
        if isinstance(node, ast.ClassDef):
            yield from choices(node, f"{inside}.")
        else:
            yield inside, {name for part in ast.walk(node) for name in asked(part)} & NAMES


def test_no_function_chooses_by_constructor_but_the_table() -> None:
    excused = {module: names for of in OTHER_CHOICES.values() for module, names in of.items()}
    found: dict[str, set[str]] = {}
    for path in SPECC.rglob("*.py"):
        module, text = path.relative_to(SPECC).as_posix(), path.read_text(encoding="utf-8")
        if module not in TABLE and sum(name in text for name in NAMES) > FEW:
            several = {name for name, of in choices(ast.parse(text)) if len(of) > FEW}
            found |= {module: several} if several else {}
    assert found == excused


# The rows are whole, and their columns agree.


MODE = t.Enum("Mode", ("u", "c"))
SOME: tuple[Type, ...] = (
    t.Bool(),
    t.Int(),
    t.Real(RADIAN),
    t.Text(),
    t.File(),
    MODE,
    t.Vector(2, t.Real()),
    t.Vector(3, MODE),
    t.point("B"),
    t.Spatial("B", *t.SPATIAL_KINDS["wrench"]),
    t.Pose("B", "E"),
    t.Image(2, 3, 1),
    t.Image(2, 3, 3),
    t.ListOf(t.Int(), nonempty=True),
    t.OptionalOf(t.Real()),
    t.PartialOf(t.Vector(2, t.Real())),
    t.Record("R", ("B",), (("a", t.Pose("B", "E")), ("b", MODE))),
    t.Opaque("O", ("B",), "tool:O", ("tool:encode", "tool:decode")),
)


class Texts:
    """Python with the names that it takes from the runtime."""

    def __init__(self, column: str) -> None:
        self.column = column
        self.names: list[str] = []

    def of(self, type: Type) -> str:
        return str(getattr(kind(type), self.column)(type, self))

    def own(self, name: str) -> str:
        self.names.append(name)
        return name

    def named(self, type: Type) -> str:
        return str(type)

    def function(self, path: str) -> str:
        return path


def test_every_constructor_has_a_row() -> None:
    assert set(KINDS) == set(get_args(Type)) == {type(one) for one in SOME}


@pytest.mark.parametrize("one", SOME, ids=str)
def test_columns_of_values_agree(one: Type) -> None:
    def data(type: Type, value: object) -> object:
        return kind(type).data(type, value, data)

    def taken(type: Type, value: object) -> object:
        return kind(type).decode(type, value, taken)

    for value in (first_value(one), *other_values(first_value(one), one)):
        again = taken(one, data(one, value))
        assert again == value or isinstance(again, NotRecorded)
        literal = kind(one).literal(one, value, lambda part, item: None)
        assert literal is None or evaluate(literal, Environment()) == value
    assert taken(one, object()) is ... or isinstance(one, t.OptionalOf | t.Image | t.Opaque)


@pytest.mark.parametrize("one", SOME, ids=str)
def test_generated_code_names_what_the_runtime_has(one: Type) -> None:
    for column, module in (("contract", contracts), ("form", forms)):
        texts = Texts(column)
        assert texts.of(one)
        assert texts.names and all(hasattr(module, name) for name in texts.names)


@pytest.mark.parametrize("one", SOME, ids=str)
def test_a_type_has_the_frames_that_it_is_given(one: Type) -> None:
    moved = one.framed(lambda frame: f"{frame}2")
    assert moved.frames == tuple(f"{frame}2" for frame in one.frames)
    assert moved.framed(lambda frame: frame.removesuffix("2")) == one
