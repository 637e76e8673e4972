"""Texts of strangers are shown as texts, and what is no message of a run does no harm."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from socket import socketpair
from typing import Any
from xml.etree import ElementTree

import pytest

from tests.house.tree import ROOT
from tests.page.fake import FakeRun, fake_run

pytestmark = pytest.mark.long  # many pictures and reasons: seconds each

SCRIPT = '<img src=x onerror="alert(1)">'
CONTROLS = "\x1b[31mred\u202e\u0007"
LONG = "long " * 100_000
SVG = "{http://www.w3.org/2000/svg}"


def spec(folder: Path, title: str) -> str:
    """The gate with a title in many places."""
    text = (ROOT / "specs" / "conveyor_gate.yaml").read_text(encoding="utf-8")
    quoted = "".join(c if c.isalpha() or c == " " else rf"\U{ord(c):08x}" for c in title)
    for own in ("title: Conveyor with a gate", "title: Belt drive", "title: Belt\n"):
        assert own in text
        end = "\n" if own.endswith("\n") else ""
        text = text.replace(own, f'title: "{quoted}"{end}', 1)
    file = folder / "gate.yaml"
    file.write_text(text, encoding="utf-8")
    return str(file)


@pytest.mark.parametrize("title", [SCRIPT, "]]>&<script>alert(1)</script>", "\u202e\U0001f916 ünï"])
def test_titles_are_texts(title: str, tmp_path: Path) -> None:
    with fake_run(spec(tmp_path, title)) as run, run.visit() as visitor:
        hello = visitor.next("hello")
        assert hello["title"] == title
        assert title in [machine["title"] for machine in hello["machines"]]
        for url in [hello["structure"], *(machine["svg"] for machine in hello["machines"])]:
            answer = run.get(url)
            assert answer.getheader("Content-Type") == "image/svg+xml"
            picture = ElementTree.fromstring(answer.read().decode())
            tags = {node.tag.removeprefix(SVG) for node in picture.iter()}
            assert tags <= {
                "svg",
                "g",
                "path",
                "polygon",
                "text",
                "tspan",
                "polyline",
                "ellipse",
                "title",
                "a",
            }
            names = {name for node in picture.iter() for name in node.attrib}
            assert not any(name.startswith("on") or "href" in name for name in names)


def test_texts_of_half_a_megabyte_are_cut(tmp_path: Path) -> None:
    with fake_run(spec(tmp_path, LONG)) as run, run.visit() as visitor:
        hello = visitor.next("hello")
        assert hello["title"].startswith("long long ") and len(hello["title"]) < 20_000
        text = f"it broke {LONG}"
        run.send("marks", marks=[{"time_s": 1.0, "kind": "fault", "text": text}])
        while not (marks := visitor.next("marks"))["marks"]:
            pass
        assert len(marks["marks"][0]["text"]) <= 1000


NO_MESSAGES: list[bytes] = [
    b"\n",
    b"{\n",
    b"null\n",
    b"[]\n",
    b"\xff\xfe\n",
    b'{"kind": 1}\n',
    b'{"kind": "nothing"}\n',
    b"[" * 100_000 + b"\n",
    b'{"kind": "state"}\n',
    b'{"kind": "state", "time_s": NaN, "steps": {}}\n',
    b'{"kind": "state", "time_s": 1, "steps": []}\n',
    b'{"kind": "state", "time_s": "1", "steps": {}}\n',
    b'{"kind": "state", "time_s": 1, "steps": {"gate.c": 1}}\n',
    b'{"kind": "state", "time_s": 1, "steps": {"gate.c": {"step": 1}}}\n',
    b'{"kind": "spans"}\n',
    b'{"kind": "spans", "changes": [1]}\n',
    b'{"kind": "spans", "changes": [["a"]]}\n',
    b'{"kind": "marks", "marks": [1]}\n',
    b'{"kind": "marks", "marks": [{"kind": "fault"}]}\n',
    b'{"kind": "picture", "camera": "a", "jpeg": "?", "time_s": 1}\n',
    b'{"kind": "picture", "camera": "a", "jpeg": ""}\n',
    b'{"kind": "begin", "set": 1}\n',
]


@pytest.fixture(scope="module")
def run() -> Any:
    with fake_run("specs/conveyor_gate.yaml") as started:
        yield started


def test_what_is_no_message_of_a_run_is_told_and_left_out(run: FakeRun) -> None:
    run.state(1.0)
    with run.visit() as visitor:
        visitor.next("hello")
        for line in NO_MESSAGES:
            run.send_bytes(line)
            assert "not understood" in visitor.next("refused")["text"], line
        assert visitor.ask("look")["time_s"] == 1.0


def test_values_of_other_types_are_not_known(run: FakeRun) -> None:
    """A step whose data are of other types than the specification has."""
    step = {
        "stamp": 3, "time": 0.15, "before": "closed", "state": CONTROLS, "cause": "", "row": -1,
        "transition": "", "conditions": {}, "fresh": {"belt.v": "yes"},
        "x": {"eye": {"parcel": 12}, "belt": {"v": None}, "barrier": []},
        "y": {"barrier": {"a_d": "up"}, "belt": 1}, "memory": [],
    }  # fmt: skip
    others = {**step, "before": SCRIPT}, {"state": SCRIPT}, {**step, "x": 1, "y": None}
    for number, each in enumerate((step, *others)):
        steps = {
            "gate.c": {"step": each, "memory": 3, "entered_s": None, "since_s": None, "row": 1}
        }
        run.state(2.0 + number, {**steps, "nothing.c": steps["gate.c"]}, plant={"gap": [None]})
        with run.visit() as visitor:
            while visitor.next("now")["time_s"] != 2.0 + number:
                pass
            found = visitor.ask("look")
            assert found["states"]["gate.c"]["state"] == each["state"]
            if isinstance(each.get("x"), dict):
                assert "is recorded is no bool" in found["values"]["gate.c.x.eye.parcel"]
            visitor.send("why", id=1, machine="gate.c", time_s=None)
            assert visitor.next("why", "refused")
            series = visitor.ask("series", name="gate.c.x.eye.parcel", window_s=5)
            assert all(value is None for line in series["lines"] for value in line)


def test_numbers_that_are_none_are_null(run: FakeRun) -> None:
    requirement = {"verdict": "open", "margin": None, "time_s": None}
    run.state(9.0, requirements=[requirement], factor=None, poses=[[None] * 7])
    with run.visit() as visitor:
        while (now := visitor.next("now"))["time_s"] != 9.0:
            pass
        assert now["requirements"] == [requirement]
        assert (now["factor"], now["poses"]) == (None, [[None] * 7])


def test_a_specification_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "gate.yaml"
    file.write_text("specc: 1\nsystem: [", encoding="utf-8")
    own, other = socketpair()
    with own, other:
        done = subprocess.run(
            [sys.executable, "-m", "specc.tools.page.live", str(other.fileno()), str(file)],
            cwd=ROOT, capture_output=True, text=True, pass_fds=[other.fileno()], check=False,
        )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("specc: ") and "Traceback" not in done.stderr
