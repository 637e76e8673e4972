"""Texts of types and signatures: what they mean, and what is said against wrong ones."""

import pytest
from hypothesis import strategies as st

from specc.lang import ExprError, TypeNames, parse_signature, parse_type
from specc.lang.context import fits, has_variables, substitute, unify
from specc.lang.types import SHAPES, names_of_type
from specc.model.types import (
    Bool,
    Enum,
    File,
    Image,
    Int,
    ListOf,
    Opaque,
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
    point,
)
from specc.model.units import METRE, RADIAN, UNITS, parse_unit
from tests.seeds import drawn

MODE = Enum("Mode", ("u", "c"))


def make_object(frames: tuple[str, ...]) -> Type:
    if len(frames) != 1:
        raise ExprError("Object takes one frame", 0, 0, "write Object[B]", "E0306")
    return Record("Object", frames, (("X", Pose(frames[0], "O")), ("size", Real(METRE))))


NAMES = TypeNames(
    frames={**{f: f for f in "BEKO"}, "P": "K"},
    types={
        "Mode": lambda _: MODE,
        "Motors": lambda _: Vector(6, Real(RADIAN)),
        "Object": make_object,
        "Cloud": lambda frames: Opaque("Cloud", frames, "tool:Cloud"),
    },
)
SIGNATURE_NAMES = TypeNames(NAMES.frames, NAMES.types, variables_allowed=True)
COHERENT = sorted({str(unit) for unit in UNITS.values()} - {"1"})
frames = st.sampled_from("BEKO")
units = st.sampled_from(COHERENT).map(parse_unit)
scalars = st.sampled_from([Bool(), Int(), MODE]) | units.map(Real)
types = st.recursive(
    scalars
    | st.sampled_from([Text(), File(), Enum("", ("open", "closed"))])
    | st.builds(Vector, st.integers(1, 9), scalars)
    | st.builds(Pose, frames, frames)
    | st.builds(Spatial, frames, units, units)
    | st.builds(PartialOf, st.builds(Spatial, frames, units, units))
    | st.builds(PartialOf, st.builds(Vector, st.integers(1, 9), units.map(Real)))
    | st.builds(Image, st.integers(1, 9), st.integers(1, 9), st.sampled_from([1, 3]))
    | frames.map(lambda f: make_object((f,)))
    | frames.map(lambda f: Opaque("Cloud", (f,), "tool:Cloud")),
    lambda inner: inner.map(ListOf),
    max_leaves=3,
)
FEW, MANY = 20, 200
"""Examples of a random test, and of a long one."""


@drawn(types, few=FEW, many=MANY)
def test_a_type_reads_back_from_its_text(type: Type) -> None:
    assert parse_type(str(type), NAMES) == type


@pytest.mark.parametrize(
    ("text", "type"),
    [
        ("Motors", Vector(6, Real(RADIAN))),
        ("vector[6]", Vector(6, Real())),
        ("vector[2, Mode]", Vector(2, MODE)),
        ("vector[2, enum[a, b]]", Vector(2, Enum("", ("a", "b")))),
        ("wrench[P]", parse_type("wrench[K]", NAMES)),
        ("twist[E]", Spatial("E", parse_unit("m/s"), parse_unit("rad/s"))),
        ("image[480, 640]", Image(480, 640, 1)),
        ("real[1]", Real()),
        ("partial[Motors]", PartialOf(Vector(6, Real(RADIAN)))),
        ("vector[6,\n  rad]", Vector(6, Real(RADIAN))),
        ("list[list[Object[P]]]", ListOf(ListOf(make_object(("K",))))),
    ],
)
def test_spellings(text: str, type: Type) -> None:
    assert parse_type(text, NAMES) == type


@pytest.mark.parametrize(
    ("text", "code", "marked", "message", "help"),
    [
        ("vectr[6]", "E0233", "vectr", "unknown type `vectr`", "did you mean `vector`?"),
        ("Motor", "E0233", "Motor", "unknown type `Motor`", "did you mean `Motors`?"),
        (
            "float",
            "O0205",
            "float",
            "type `float` is not there yet",
            "declare it under `types:`, or did you mean `real`?",
        ),
        ("zzz", "O0205", "zzz", "type `zzz` is not there yet", "declare it under `types:`"),
        (
            "vector",
            "E0306",
            "vector",
            "`vector` is not complete",
            "it is spelt like `vector[6, rad]`",
        ),
        (
            "pose[B]",
            "E0306",
            "pose[B]",
            "`pose` does not take these in brackets",
            "it is spelt like `pose[B, E]`",
        ),
        (
            "bool[B]",
            "E0306",
            "bool[B]",
            "`bool` does not take these in brackets",
            "it takes nothing",
        ),
        ("pose[B, Q]", "O0205", "Q", "frame `Q` is not there yet", "declare it under `frames:`"),
        ("pose[B, b]", "E0201", "b", "unknown frame `b`", "did you mean `B`?"),
        ("pose[B, 1]", "E0306", "1", "a frame is a name", "declare it under `frames:`"),
        ("real[mm]", "E0305", "mm", "a type has SI units; only literals have others", "write `m`"),
        (
            "vector[6, deg]",
            "E0305",
            "deg",
            "a type has SI units; only literals have others",
            "write `rad`",
        ),
        ("real[m/sec]", "E0304", "sec", "unknown unit `sec`", "did you mean `s`?"),
        ("real[Rad]", "E0304", "Rad", "unknown unit `Rad`", "did you mean `rad` or `mrad`?"),
        (
            "vector[0]",
            "E0306",
            "0",
            "a size is a whole number from 1 to 100000",
            "for example `vector[6, rad]` or `image[480, 640, 3]`",
        ),
        (
            "vector[True]",
            "E0306",
            "True",
            "a size is a whole number from 1 to 100000",
            "for example `vector[6, rad]` or `image[480, 640, 3]`",
        ),
        (
            "vector[2, Motors]",
            "E0306",
            "Motors",
            "a vector has no `vector[6, rad]` components",
            "any items are allowed in a list",
        ),
        (
            "partial[real]",
            "E0306",
            "real",
            "a `real` is there as a whole or not at all",
            "vectors of reals and spatial vectors have components that may be missing",
        ),
        (
            "image[1, 1, 2]",
            "E0306",
            "2",
            "an image has 3 channels, a depth map 1",
            "for example `image[480, 640, 3]`",
        ),
        ("enum[a, a]", "E0306", "a", "`a` stands twice", "choose another name"),
        (
            "enum[a, elapsed]",
            "E0306",
            "elapsed",
            "`elapsed` is a name of the language",
            "choose another name",
        ),
        (
            "enum[1]",
            "E0306",
            "1",
            "a member of an enum is a name",
            "for example `enum[open, closed]`",
        ),
        ("list[Object]", "E0306", "Object", "Object takes one frame", "write Object[B]"),
        (
            "list[Object[B, E]]",
            "E0306",
            "Object[B, E]",
            "Object takes one frame",
            "write Object[B]",
        ),
        ("6", "E0306", "6", "this is not a type", "for example `vector[6, rad]`"),
        (
            "vector[6",
            "E0306",
            "[",
            "this is not a type",
            "for example `vector[6, rad]` or `pose[B, E]`",
        ),
        (
            "list[" * 70 + "int" + "]" * 70,
            "E0303",
            "list[" * 70 + "int" + "]" * 70,
            "the type is nested more than 64 deep",
            "name a part of it under `types:`",
        ),
    ],
)
def test_what_is_no_type(text: str, code: str, marked: str, message: str, help: str) -> None:
    with pytest.raises(ExprError) as caught:
        parse_type(text, NAMES)
    e = caught.value
    found = (e.code, text[e.start : e.end], e.message, e.help)
    assert found == (code, marked, message, help)


def test_signatures() -> None:
    text = "(T: pose[X, Y], O: list[Object[Y]],\n m: Motors) -> list[Object[X]]"
    parameters, result = parse_signature(text, SIGNATURE_NAMES)
    assert [name for name, _ in parameters] == ["T", "O", "m"]
    assert parameters[0][1] == Pose("?X", "?Y")
    assert result == ListOf(make_object(("?X",)))
    assert parse_signature(" ( ) ->int", SIGNATURE_NAMES) == ((), Int())


@pytest.mark.parametrize(
    ("text", "code", "marked", "message"),
    [
        ("", "E0306", "", "a signature starts with its parameters in brackets"),
        (
            "q: int -> int",
            "E0306",
            "q: int -> int",
            "a signature starts with its parameters in brackets",
        ),
        ("(q: int -> int", "E0306", "(q: int -> int", "the bracket is not closed"),
        ("(q: int)", "E0306", "", "a signature has its result after `->`"),
        ("(q: int) int", "E0306", "int", "a signature has its result after `->`"),
        ("(q: int) ->", "E0306", "", "this is not a type"),
        ("(q) -> int", "E0306", "q", "a parameter is a name, a colon and a type"),
        ("(q: int,) -> int", "E0306", "", "a parameter is a name, a colon and a type"),
        ("(1: int) -> int", "E0306", "1: int", "a parameter is a name, a colon and a type"),
        ("(q: int, q: bool) -> int", "E0306", "q: bool", "parameter `q` stands twice"),
        ("(q: int, v: vectr[6]) -> int", "E0233", "vectr", "unknown type `vectr`"),
        ("(q: int) -> list[intt]", "E0233", "intt", "unknown type `intt`"),
        (
            "(X: pose[B, Y]) -> pose[Z, Y]",
            "E0308",
            "pose[Z, Y]",
            "frame `Z` is neither declared nor in a parameter",
        ),
    ],
)
def test_what_is_no_signature(text: str, code: str, marked: str, message: str) -> None:
    with pytest.raises(ExprError) as caught:
        parse_signature(text, SIGNATURE_NAMES)
    e = caught.value
    assert (e.code, text[e.start : e.end].strip(), e.message) == (code, marked, message)


@drawn(types, st.sets(st.sampled_from("BEK")), few=FEW, many=MANY)
def test_what_a_pattern_was_made_from_unifies_with_it(type: Type, opened: set[str]) -> None:
    pattern = substitute(type, {frame: f"?{frame}" for frame in opened})
    bindings: dict[str, str] = {}
    assert unify(pattern, type, bindings)
    assert substitute(pattern, bindings) == type


@drawn(types, types, few=FEW, many=MANY)
def test_types_without_variables_unify_only_with_what_fits(a: Type, b: Type) -> None:
    assert not has_variables(a)
    assert unify(a, a, {})
    assert fits(b, a) or not unify(a, b, {})


def test_a_list_of_points_is_no_list_of_vectors_and_records_differ_by_their_fields() -> None:
    assert not unify(ListOf(Vector(3, Real(METRE))), ListOf(point("B")), {})
    assert not unify(Record("R", (), (("a", Int()),)), Record("R", (), (("b", Int()),)), {})


def test_a_variable_stands_for_one_frame() -> None:
    bindings = {"?X": "B"}
    assert not unify(Pose("?X", "?X"), Pose("B", "E"), bindings)
    assert not unify(Pose("?Y", "?X"), Pose("K", "E"), bindings)
    assert bindings == {"?X": "B"}
    assert unify(Pose("?Y", "?X"), Pose("K", "B"), bindings)
    assert bindings == {"?X": "B", "?Y": "K"}


@pytest.mark.parametrize("name", SHAPES)
def test_frames_and_sizes_of_a_type_are_mentioned_in_its_text(name: str) -> None:
    examples = {"frame": "B", "size": "n", "layers": "3", "unit": "m", "element": "rad"}
    takes = SHAPES[name].takes
    text = f"{name}[{', '.join(examples.get(taken, 'wrench[B]') for taken in takes)}]"
    found = [(one.kind, one.name, text[one.start : one.end]) for one in names_of_type(text, ())]
    inside = {"type": "frame", "present": "frame", "complete": "frame"}
    named = [inside.get(taken, taken) for taken in takes]
    expected = {"frame": ("frame", "B", "B"), "size": ("size", "n", "n")}
    assert found == [expected[kind] for kind in named if kind in expected]
