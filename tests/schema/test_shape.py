"""Findings about shapes, on small mappings that cover what the schema is written in."""

from pathlib import Path
from typing import Annotated, Any, Literal

import pytest

from specc.limits import MAX_FAULTS
from specc.pipeline import compile_spec
from specc.schema.desugar import desugar
from specc.schema.files import SpecFile
from specc.schema.keys import (
    OTHERS,
    FieldName,
    ListForm,
    Name,
    PythonPath,
    RateText,
    ReadableName,
    SpecModel,
    Text,
    TraceNumbers,
    key,
)
from specc.schema.shape import shape


class Element(SpecModel, short="type"):
    type: str
    init: int | None = None


class Written(SpecModel):
    type: str
    init: int | None = None


class Row(SpecModel, row="type init"):
    type: str
    init: int | None = None


class Open(SpecModel):
    eq: TraceNumbers = key(())
    others: dict[str, Written] = key({}, alias=OTHERS)


class File(SpecModel):
    specc: Literal[1] = 1
    system: ReadableName = "demo"
    arguments: dict[str, int] = key({}, alias="with")
    elements: dict[str, Element] = key({})
    rows: list[Row] = key([])
    names: list[str] | None = None
    open: Open | None = None
    keyed: dict[Name, int] = key({})
    fields: dict[FieldName, str] = key({})
    count: int = 1
    flag: bool = False
    shape: Literal["", "circle", "square"] = ""
    reason: Annotated[str, Text(filled=True)] = "none"
    python: PythonPath | None = None
    rate: RateText | None = None
    few: Annotated[list[int], ListForm(max_length=2)] = key([])


def findings(**data: Any) -> list[tuple[str, tuple[str | int, ...], str, str, str]]:
    made, found = shape(File, desugar(data, "a.yaml", File)[0], "a.yaml")
    assert (made is None) == bool(found)
    assert all(item.primary.file == "a.yaml" for item in found)
    return [
        (item.code, item.primary.route, item.primary.part, item.message, item.help)
        for item in found
    ]


def made(**data: Any) -> File:
    file, found = shape(File, desugar(data, "a.yaml", File)[0], "a.yaml")
    assert not found
    assert file is not None
    return file


def test_unknown_keys_come_with_the_nearest_known_ones() -> None:
    assert findings(sistem="x") == [
        ("E0101", ("sistem",), "key", "unknown key `sistem`", "did you mean `system`?")
    ]
    ((_, route, _, message, hint),) = findings(elements={"T": {"type": "t", "q": 1}})
    assert route == ("elements", "T", "q")
    assert message == "unknown key `q` in `elements.T`"
    assert hint == "known keys: `type`, `init`"


def test_a_key_is_known_by_its_spelling() -> None:
    ((_, _, _, _, hint),) = findings(wiht={})
    assert hint == "did you mean `with`?"
    assert findings(arguments={})[0][0] == "E0101"
    assert findings(**{"with": {"a": "x"}})[0][1] == ("with", "a")
    assert made(**{"with": {"a": 1}}).arguments == {"a": 1}


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
    assert findings(names="a")[0][-1] == "write `[a]`"
    assert findings(open={"eq": "a"})[0][-1] == "write a number or a list of numbers, e.g. `[4, 5]`"
    assert findings(names="a, b")[0][-1].startswith("a list is written `[a, b]`")
    assert findings(flag=[])[0][-1] == "write `true` or `false`, without quotes"
    assert findings(system=5)[0][-1] == 'a value in quotes is text: `"5"`'


def test_a_list_of_numbers_is_told_of_where_one_belongs() -> None:
    ((_, _, _, message, hint),) = findings(elements={"eq": None})
    assert message == "`elements.eq`: expected a mapping, found nothing"
    assert hint == "write what belongs here, or delete the key"
    ((_, _, _, _, hint),) = findings(elements={"eq": [4]})
    assert hint == "write `{type: ...}`"


def test_a_file_that_is_no_mapping_is_told_what_one_is() -> None:
    made, (found,) = shape(SpecFile, "<xml>", "a.yaml")
    assert made is None
    assert found.help.startswith("a mapping is written `{key: value}`")


def test_a_mistyped_key_is_not_missing_as_well() -> None:
    assert [item[0] for item in findings(open={"m": {"tipe": "x"}})] == ["E0101"]
    codes = [item[0] for item in findings(open={"m": {"zzz": "x", "init": 1}})]
    assert sorted(codes) == ["E0101", "E0102"]


def test_a_mapping_in_the_place_of_rows_is_told_how_rows_are_written() -> None:
    ((code, *_, help),) = findings(rows={"a": "int"})
    assert code == "E0103"
    assert help == "write a list of rows, each on a line of its own: `- [type, init]`"


def test_a_mapping_of_another_kind_is_told_once_with_the_form_that_is_meant() -> None:
    ((code, _, _, words, help),) = findings(open={"m": {"go -> end": "done", "b": "x"}})
    assert code == "E0101"
    assert words == "unknown key `go -> end` in `open.m`, which lacks all that it needs"
    assert help == "write `{type: ...}`"


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
        ({"count": "x"}, ("count",), "`count`: expected a whole number, found text"),
        ({"count": 1.5}, ("count",), "`count`: expected a whole number, found the number 1.5"),
        ({"count": "9" * 5000}, ("count",), "`count`: expected a whole number, found text"),
        ({"flag": [1]}, ("flag",), "`flag`: expected true or false, found a list"),
        ({"flag": 2}, ("flag",), "`flag`: expected true or false, found the number 2"),
        ({"open": {"eq": True}}, ("open", "eq"), "`open.eq`: expected a list, found true"),
        (
            {"elements": {"T": []}},
            ("elements", "T"),
            "`elements.T`: expected a mapping, found a list",
        ),
        (
            {"elements": {"T": 5}},
            ("elements", "T"),
            "`elements.T`: expected text, found the number 5",
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
        ({"system": "two words"}, ("system",), "`two words` is not a valid name"),
        ({"system": "if"}, ("system",), "`if` is a word of the expression language"),
        ({"count": float("inf")}, ("count",), "`inf` must be a finite number"),
        ({"few": [1, 2, 3]}, ("few",), "`few`: a list must have at most 2 items"),
        ({"reason": ""}, ("reason",), "`reason`: the text is empty"),
        ({"python": "a b"}, ("python",), "does not have the form `package.module:name`"),
        ({"python": "a:b\n"}, ("python",), "does not have the form `package.module:name`"),
        ({"python": "a.if:b"}, ("python",), "contains a keyword of Python"),
        ({"keyed": {"A b": 1}}, ("keyed", "A b"), "`A b` is not a valid name"),
        ({"fields": {"__a": "x"}}, ("fields", "__a"), "begins with two underscores"),
        ({"rows": [["a"]]}, ("rows", 0), "`rows[0]`: a row has 2 items, this one has 1"),
        ({"rows": [["a", "b"]]}, ("rows", 0, "init"), "whole number"),
        ({"shape": "circel"}, ("shape",), "is not one of `circle`, `square`"),
        ({"shape": []}, ("shape",), "a list is not one of"),
    ],
)
def test_invalid_values(data: dict[str, Any], route: tuple[str | int, ...], words: str) -> None:
    (finding,) = findings(**data)
    assert finding[0] in ("E0103", "E0104")
    assert finding[1] == route
    assert words in finding[3]


def test_what_is_close_is_proposed() -> None:
    assert findings(shape="circel")[0][-1] == "did you mean `circle`?"
    assert findings(shape="x")[0][-1] == "write one of them"
    assert findings(keyed={"A b": 1})[0][-1].endswith("e.g. `A_b`")


def test_a_wrong_key_is_shown_as_a_key() -> None:
    ((_, _, part, message, _),) = findings(keyed={"A b": 1})
    assert part == "key"
    assert message.startswith("`A b`")


def test_a_short_form_stands_for_its_mapping() -> None:
    assert made(elements={"T": "t"}).elements["T"].type == "t"
    assert made(rows=[["t", 2]]).rows[0].init == 2
    assert made(open={"eq": 4, "m": {"type": "t"}}).open.eq == (4,)  # type: ignore[union-attr]  # it is there


class Port(SpecModel, short="is"):
    interface: str | None = key(None, alias="is")
    elements: dict[str, Element] = key({}, alias=OTHERS)


def test_a_key_with_a_short_form_is_reported_at_its_own_place() -> None:
    for data, route in (({"is": 5}, ("is",)), (5, ())):
        _, (finding,) = shape(Port, desugar(data, "a.yaml", Port)[0], "a.yaml")
        assert finding.primary.route == route
        assert finding.message.endswith("expected text, found the number 5")


def test_what_means_the_same_is_taken() -> None:
    file = made(count="14.0", flag="Yes", rate=5, few=[True, 2.0])
    assert (file.count, file.flag, file.rate, file.few) == (14, True, "5", [1, 2])


def test_a_key_that_is_called_like_a_type_is_a_key() -> None:
    (finding,) = findings(elements={"str": {"type": 5}})
    assert finding[1] == ("elements", "str", "type")


def test_another_version_silences_everything_else() -> None:
    ((code, route, _, message, hint),) = findings(specc=2, sistem="x", rows=5)
    assert (code, route) == ("E0105", ("specc",))
    assert "version 2" in message
    assert hint == "write `specc: 1`"


def test_everything_wrong_is_reported_at_once() -> None:
    assert len(findings(system=5, rows=[5, 6], count=[], wiht=1)) == 5


@pytest.mark.parametrize("fault", ["{from: 1}", "!tag 1"])
def test_of_very_many_faults_the_first_are_told(fault: str, tmp_path: Path) -> None:
    rows = ", ".join([fault] * 2 * MAX_FAULTS)
    spec = tmp_path / "spec.yaml"
    spec.write_text(f"specc: 1\nsystem: s\nagents: {{a: {{control: {{transitions: [{rows}]}}}}}}\n")
    found = compile_spec(str(spec)).diagnostics
    assert len(found) == MAX_FAULTS + 1
    assert found[-1].code == "E0017"
