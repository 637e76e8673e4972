"""From pydantic's errors to findings, on small models that cover what a schema may use."""

from typing import Annotated, Any, Literal

import pytest
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    RootModel,
    Tag,
    ValidationError,
    field_validator,
)

from specc.schema.errors import shape_diagnostics


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Element(Strict):
    type: str
    init: int | None = None


class Circle(Strict):
    kind: Literal["circle"]
    radius: float


class Square(Strict):
    kind: Literal["square"]
    side: float


def _form(value: object) -> str:
    return "short" if isinstance(value, str) else "long"


def _row(value: object) -> object:
    if isinstance(value, list) and len(value) != 2:
        raise ValueError("a row has 2 items")
    return {"type": value[0], "init": value[1]} if isinstance(value, list) else value


Checked = Annotated[str, BeforeValidator(lambda value: value)]


class Names(RootModel[list[str]]):
    pass


class Open(Strict):
    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Element]
    eq: int = 0


class File(Strict):
    specc: Literal[1] = 1
    system: str = "demo"
    arguments: dict[str, int] = Field({}, alias="with")
    elements: dict[str, str | Element] = {}
    guarded: Annotated[Element, BeforeValidator(lambda value: value)] | Checked = "x"
    tagged: (
        Annotated[
            Annotated[str, Tag("short")] | Annotated[Element, Tag("long")], Discriminator(_form)
        ]
        | None
    ) = None
    shapes: list[Annotated[Circle | Square, Field(discriminator="kind")]] = []
    rows: list[Annotated[Element, BeforeValidator(_row)]] = []
    pair: tuple[int, Element] | None = None
    names: Names | None = None
    open: Open | None = None
    keyed: dict[Annotated[str, Field(pattern="^[a-z]+$")], int] = {}
    count: int = Field(1, ge=1, le=9)
    flag: bool = False
    short: str = Field("a", max_length=3)
    either: list[int] | dict[str, int] = []

    @field_validator("system")
    @classmethod
    def _one_word(cls, value: str) -> str:
        if " " in value:
            raise ValueError("a name is one word")
        return value


def findings(**data: Any) -> list[tuple[str, tuple[str | int, ...], str, str, str]]:
    try:
        File.model_validate(data)
    except ValidationError as error:
        found = shape_diagnostics(error, "a.yaml", File)
        assert all(item.primary.file == "a.yaml" for item in found)
        return [
            (item.code, item.primary.route, item.primary.part, item.message, item.help)
            for item in found
        ]
    return []


def test_unknown_keys_come_with_the_nearest_known_ones() -> None:
    assert findings(sistem="x") == [
        ("E0101", ("sistem",), "key", "unknown key `sistem`", "did you mean `system`?")
    ]
    ((_, route, _, message, hint),) = findings(elements={"T": {"type": "t", "q": 1}})
    assert route == ("elements", "T", "q")
    assert message == "unknown key `q` in `elements.T`"
    assert hint == "known keys: `type`, `init`"


def test_a_key_is_known_by_its_alias() -> None:
    ((_, _, _, _, hint),) = findings(wiht={})
    assert hint == "did you mean `with`?"
    assert findings(arguments={})[0][0] == "E0101"
    assert findings(**{"with": {"a": "x"}})[0][1] == ("with", "a")


def test_a_missing_key_points_at_the_key_of_its_mapping() -> None:
    (finding,) = findings(open={"m": {}})
    assert finding == (
        "E0102",
        ("open", "m"),
        "key",
        "missing key `type` in `open.m`",
        "add `type: ...`",
    )


def test_a_way_out_is_written_for_what_stands_there() -> None:
    assert findings(open={"m": "x"})[0][-1] == "write `{type: ...}`"
    assert findings(rows="a")[0][-1] == "write `[a]`"
    assert findings(open={"eq": "a"})[0][-1] == "write a number or a list of numbers, e.g. `[4, 5]`"
    assert findings(rows="a, b")[0][-1].startswith("a list is written `[a, b]`")


def test_a_file_that_is_no_mapping_is_told_what_one_is() -> None:
    class Needy(Strict):
        specc: int

    with pytest.raises(ValidationError) as caught:
        Needy.model_validate("<xml>")
    (found,) = shape_diagnostics(caught.value, "a.yaml", Needy)
    assert found.help.startswith("a mapping is written `{key: value}`")


def test_a_mistyped_key_is_not_missing_as_well() -> None:
    assert [item[0] for item in findings(open={"m": {"tipe": "x"}})] == ["E0101"]
    codes = [item[0] for item in findings(open={"m": {"zzz": "x"}})]
    assert sorted(codes) == ["E0101", "E0102"]


@pytest.mark.parametrize(
    ("data", "route", "message"),
    [
        ({"system": 5}, ("system",), "`system`: expected text, found the number 5"),
        ({"system": None}, ("system",), "`system`: expected text, found nothing"),
        ({"with": []}, ("with",), "`with`: expected a mapping, found a list"),
        ({"open": "x"}, ("open",), "`open`: expected a mapping, found text"),
        ({"rows": {}}, ("rows",), "`rows`: expected a list, found a mapping"),
        ({"rows": [5]}, ("rows", 0), "`rows[0]`: expected a mapping, found the number 5"),
        ({"names": ["a", []]}, ("names", 1), "`names[1]`: expected text, found a list"),
        ({"pair": [1, 2]}, ("pair", 1), "`pair[1]`: expected a mapping, found the number 2"),
        ({"count": "x"}, ("count",), "`count`: expected a whole number, found text"),
        ({"flag": [1]}, ("flag",), "`flag`: expected true or false, found a list"),
        (
            {"elements": {"T": 5}},
            ("elements", "T"),
            "`elements.T`: expected text or a mapping, found the number 5",
        ),
        (
            {"either": "x"},
            ("either",),
            "`either`: expected a list or a mapping, found text",
        ),
    ],
)
def test_wrong_kinds(data: dict[str, Any], route: tuple[str | int, ...], message: str) -> None:
    (finding,) = findings(**data)
    assert finding[0] == "E0103"
    assert finding[1] == route
    assert finding[3] == message


@pytest.mark.parametrize(
    ("data", "route", "words"),
    [
        ({"system": "two words"}, ("system",), "a name is one word"),
        ({"count": 0}, ("count",), "`0` must be at least 1"),
        ({"short": "abcd"}, ("short",), "at most 3 characters"),
        ({"keyed": {"A": 1}}, ("keyed", "A"), "does not have the form"),
        ({"rows": [["a"]]}, ("rows", 0), "a row has 2 items"),
        ({"rows": [["a", "b"]]}, ("rows", 0, "init"), "whole number"),
        ({"shapes": [{"kind": "circel", "radius": 1}]}, ("shapes", 0), "`circle`, `square`"),
    ],
)
def test_invalid_values(data: dict[str, Any], route: tuple[str | int, ...], words: str) -> None:
    (finding,) = findings(**data)
    assert finding[0] in ("E0103", "E0104")
    assert finding[1] == route
    assert words in finding[3]


def test_a_wrong_key_is_shown_as_a_key() -> None:
    assert findings(keyed={"A": 1})[0][2] == "key"


@pytest.mark.parametrize("union", ["elements", "guarded", "tagged"])
def test_of_a_union_only_the_member_that_was_meant_is_reported(union: str) -> None:
    value = {"type": "t", "init": "x"}
    data = {"elements": {"T": value}} if union == "elements" else {union: value}
    (finding,) = findings(**data)
    assert finding[1][-1] == "init"
    assert set(finding[1]) <= {"elements", "T", "guarded", "tagged", "init"}


def test_members_chosen_by_a_key_leave_no_trace_in_the_route() -> None:
    (finding,) = findings(shapes=[{"kind": "circle", "radius": "x"}])
    assert finding[1] == ("shapes", 0, "radius")


def test_a_key_that_is_called_like_a_type_is_a_key() -> None:
    (finding,) = findings(elements={"str": {"type": 5}})
    assert finding[1] == ("elements", "str", "type")


def test_another_version_silences_everything_else() -> None:
    ((code, route, _, message, hint),) = findings(specc=2, sistem="x", rows=5)
    assert (code, route) == ("E0105", ("specc",))
    assert "version 2" in message
    assert hint == "write `specc: 1`"


def test_everything_wrong_is_reported_at_once() -> None:
    assert len(findings(system=5, rows=[5, 6], count=0, wiht=1)) == 5
