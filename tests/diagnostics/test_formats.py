"""Reports as data: JSON, SARIF, annotations, JUnit."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import jsonschema
import pytest

from specc.diagnostics import Diagnostic, Edit, Fix, Related, formats
from specc.diagnostics.code import all_codes
from specc.diagnostics.report import Report, report, resolve
from specc.limits import MAX_LETTERS
from specc.read import read_text
from specc.source import Place, Sources

TEXT = "agents:\n  irp:\n    rat: 500 Hz\n    rate: 5\n  other: 1\n"


def render(form: str, found: Report) -> str:
    return formats.RENDERERS[form](found)


@pytest.fixture
def found() -> Report:
    name = "specs/a b.yaml"
    key = Place(name, ("agents", "irp", "rat"), "key")
    value = Place(name, ("agents", "irp", "rate"))
    diagnostics = [
        Diagnostic(
            "E0101",
            "unknown key, 100%\nof it: <b> \x1b",
            key,
            "l",
            (Related(value, "r"),),
            "h",
            Fix("write `rate`", (Edit(key, "rate"),)),
            example="e <f>",
        ),
        Diagnostic("W0001", "a warning", Place(name, ("agents", "irp"))),
        Diagnostic("E9999", "a code without an entry", Place("none.yaml")),
    ]
    sources = Sources([read_text(name, TEXT).source])
    return report(resolve(diagnostics, sources), [name, "clean.yaml"])


def test_json_has_every_part_of_a_finding(found: Report) -> None:
    data = json.loads(render("json", found))
    assert data["version"] == 1
    assert data["summary"] == {
        "files": ["specs/a b.yaml", "clean.yaml"],
        "errors": 2,
        "warnings": 1,
        "open_points": 0,
        "ignored": 0,
        "not_shown": 0,
    }
    codes = [item["code"] for item in data["diagnostics"]]
    assert codes == ["E9999", "E0101", "W0001"]
    finding = data["diagnostics"][1]
    assert finding == {
        "code": "E0101",
        "severity": "error",
        "message": "unknown key, 100%\nof it: <b> \x1b",
        "label": "l",
        "example": "e <f>",
        "help": "h",
        "route": ["agents", "irp", "rat"],
        "location": {
            "file": "specs/a b.yaml",
            "line": 3,
            "column": 5,
            "end_line": 3,
            "end_column": 8,
        },
        "related": [
            {
                "message": "r",
                "location": {
                    "file": "specs/a b.yaml",
                    "line": 4,
                    "column": 11,
                    "end_line": 4,
                    "end_column": 12,
                },
            }
        ],
        "fix": {
            "title": "write `rate`",
            "edits": [{"location": finding["location"], "text": "rate"}],
        },
    }


def test_sarif_follows_the_published_schema(found: Report) -> None:
    schema = json.loads((Path(__file__).parent / "sarif-2.1.0.json").read_text())
    jsonschema.validate(json.loads(render("sarif", found)), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"version": "2.1.0", "runs": [{"results": []}]}, schema)


def test_sarif_has_what_the_standard_requires(found: Report) -> None:
    log = json.loads(render("sarif", found))
    assert log["version"] == "2.1.0"
    (run,) = log["runs"]
    driver = run["tool"]["driver"]
    assert driver["name"] == "specc"
    rules = driver["rules"]
    assert [rule["id"] for rule in rules] == ["E0101", "E9999", "W0001"]
    assert rules[0]["shortDescription"]["text"] == all_codes()["E0101"].title
    for result in run["results"]:
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
        assert result["level"] in ("error", "warning")
        assert result["message"]["text"]
        for place in [*result["locations"], *result["relatedLocations"]]:
            physical = place["physicalLocation"]
            assert " " not in physical["artifactLocation"]["uri"]
            region = physical["region"]
            start = region["startLine"], region["startColumn"]
            assert (1, 1) <= start <= (region["endLine"], region["endColumn"])
    related = run["results"][1]["relatedLocations"][0]
    assert related["message"]["text"] == "r"
    assert run["results"][1]["message"]["text"].endswith("\nfor example: e <f>\nh")
    assert run["results"][1]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == (
        "specs/a%20b.yaml"
    )


def test_annotations_are_one_line_each_with_escapes(found: Report) -> None:
    lines = render("github", found).splitlines()
    assert len(lines) == 3
    assert lines[2].startswith("::warning file=specs/a b.yaml,line=3,endLine=4,title=specc W0001::")
    assert lines[1] == (
        "::error file=specs/a b.yaml,line=3,endLine=3,col=5,endColumn=8,title=specc E0101"
        "::unknown key, 100%25%0Aof it: <b> \\x1b%0Aspecs/a b.yaml:4: r"
        "%0Afor example: e <f>%0Ah"
    )


def test_annotations_escape_names_of_files() -> None:
    finding = Diagnostic("E0001", "m", Place("a,b:c.yaml"))
    line = render("github", report(resolve([finding], Sources()), []))
    assert "file=a%2Cb%3Ac.yaml," in line


def test_junit_counts_files_and_is_xml_whatever_a_message_says(found: Report) -> None:
    root = ElementTree.fromstring(render("junit", found))
    assert (root.get("tests"), root.get("failures")) == ("3", "2")
    (suite,) = root
    cases = {case.get("name"): case for case in suite}
    assert list(cases) == ["specs/a b.yaml", "clean.yaml", "none.yaml"]
    failing = cases["specs/a b.yaml"]
    failure, output = failing.find("failure"), failing.find("system-out")
    assert failure is not None and output is not None
    assert failure.get("type") == "E0101"
    assert "specs/a b.yaml:3:5: E0101: unknown key, 100%" in (failure.text or "")
    assert "  for example: e <f>\n  h" in (failure.text or "")
    assert "W0001" in (output.text or "")
    assert len(cases["clean.yaml"]) == 0


@pytest.mark.parametrize("form", ["json", "sarif", "github", "junit"])
def test_a_clean_report_is_valid_too(form: str) -> None:
    text = render(form, report([], ["a.yaml"]))
    if form in ("json", "sarif"):
        assert json.loads(text)
    elif form == "junit":
        assert ElementTree.fromstring(text).get("failures") == "0"
    else:
        assert text == ""


def test_long_messages_are_counted_once_there_is_enough_to_read() -> None:
    long = [Diagnostic("W0001", f"{i} {'x' * 9_000}", Place("none.yaml")) for i in range(50)]
    bad = Diagnostic("E0101", "the only error", Place("none.yaml"))
    found = report(resolve([*long, bad], Sources()), ["none.yaml"])
    assert bad in [item.diagnostic for item in found.shown]
    assert len(found.shown) == 23 and found.not_shown == 28
    assert len(render("json", found)) < 2 * MAX_LETTERS
    (one,) = report(resolve([replace(bad, message="x" * 10**6)], Sources()), []).shown
    assert len(one.diagnostic.message) == 10**6
