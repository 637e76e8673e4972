"""`specc doc`: what documents have in them, and that they are the same everywhere."""

from __future__ import annotations

import dataclasses
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from specc import pipeline
from specc.model.fsm import Trace
from specc.tools.doc.departures import departures_in
from specc.tools.doc.document import DocumentText, DocumentWriter
from tests.commands import specc
from tests.compiled import SPECS
from tests.seeds import SOAK, every

ROOT = SPECS.parent
ALL = sorted(
    str(path.relative_to(ROOT))
    for folder in (SPECS, SPECS / "architectures", SPECS / "examples")
    for path in folder.glob("*.yaml")
    if "as_published" not in path.name
)
SHORT = ("specs/irp_picking.yaml", "specs/conveyor_gate.yaml", "specs/rovers.yaml")
FEW = ("specs/irp_picking.yaml", "specs/architectures/two_cells.yaml", "specs/conveyor_gate.yaml")
"""The longest documents and a short one; the others are left to `soak`."""
MODELS = ROOT / "models"
HOSTILE = r"""
specc: 1.3
system: hostile
title: '#panic("a") $x$ "q" \ ] [ <img src=x onerror=alert(1)> `r` @b ‮rtl <!-- -->'
constants:
  a: {is: "1[m]", title: '") #eval("1") $'}
agents:
  one:
    title: '*bold* _em_ </script> &amp;'
    real_receptors: {r: {title: "<b>$ #", through: 10 Hz, y: {n: {type: int, title: "]"}}}}
    control:
      title: "#import \"@preview/x:1.0.0\": y"
      rate: 10 Hz
      x: {r: same}
      memory: {n_1: {type: int, init: 0, title: "\\$ \\\" //**/ ]"}}
      functions: {count: {title: "]#[", n_1: "x.r.n if present(x.r.n) else n_1"}}
      behaviours: {run: {title: "$", functions: [count], terminal: never}}
      states: {S1: {behaviour: run, title: "= heading\n\n#pagebreak()"}}
      initial_state: S1
require:
  - {that: "always(one.c.n_1 >= 1)", because: 'it "counts" #up \'}
"""


def written(path: str) -> DocumentText:
    """The text of a document, before it is set."""
    result = pipeline.compile_spec(str(ROOT / path))
    assert result.system is not None
    return DocumentWriter(result.system, result.proofs, result.sources, str(ROOT / path)).write()


def numbers_in(part: Any, seen: set[int]) -> Iterator[tuple[str, int]]:
    """All numbers of a model: every `Trace` in it."""
    if isinstance(part, Trace):
        for kind in ("eq", "table", "fig"):
            yield from ((kind, number) for number in getattr(part, kind))
    elif isinstance(part, tuple):
        for each in part:
            yield from numbers_in(each, seen)
    elif dataclasses.is_dataclass(part) and type(part).__module__.startswith("specc.model"):
        is_new = id(part) not in seen
        seen.add(id(part))
        for field in dataclasses.fields(part) if is_new else ():
            yield from numbers_in(getattr(part, field.name), seen)


@pytest.mark.parametrize("path", every(3, SHORT))
def test_every_number_is_shown_once(path: str) -> None:
    result = pipeline.compile_spec(str(ROOT / path))
    wanted = set(numbers_in(result.system, set()))
    shown = re.findall(
        r'#number_\("[\w-]+", "(\w+)"\)\[#"\(?(\d+)([a-z]*)\)?"\]', written(path).text
    )
    by_number: dict[tuple[str, int], list[str]] = {}
    for kind, number, letter in shown:
        by_number.setdefault((kind, int(number)), []).append(letter)
    assert by_number.keys() == wanted
    for number, letters in by_number.items():
        alphabet = [chr(ord("a") + n) for n in range(len(letters))]
        assert letters in ([""], alphabet), number
    if path == SHORT[0]:
        of = {kind: {n for each, n in wanted if each == kind} for kind in ("eq", "table", "fig")}
        assert of["eq"] >= set(range(4, 89)) - {32}
        assert of["table"] >= set(range(3, 13))
        assert of["fig"] >= {6, *range(8, 14), *range(16, 19), *range(20, 25)}


def test_captions_have_the_numbers_of_a_machine(tmp_path: Path) -> None:
    spec = tmp_path / "a.yaml"
    spec.write_text(
        "specc: 1.3\nsystem: a\nagents:\n  b:\n    control:\n      rate: 10 Hz\n      fig: 1\n"
        "      table: 2\n      memory: {n: {type: int, init: 0}}\n      functions: {f: {n: n}}\n"
        "      states: {S0: {functions: [f], terminal: {when: True}, table: 3, fig: 4}}\n"
        "      initial_state: S0\n      transitions: [[S0, terminal, always, S0]]\n"
    )

    def shown(before: str) -> list[str]:
        text = re.sub(r'#number_\("[\w-]+", "\w+"\)\[#"(\d)"\]', r"\1", written(str(spec)).text)
        return re.findall(rf'#"(Table|Fig\.)"~(\d)\. {before}', text)

    assert shown("Inner structure of") == [("Fig.", "1")]
    assert shown("State transition table of") == [("Table", "2")]
    assert shown("States and behaviours of") == [("Table", "3")]
    assert shown("State machine of") == [("Fig.", "4")]
    spec.write_text(
        spec.read_text()
        .replace("terminal: {when: True}", "terminal: never")
        .partition("      transitions")[0]
    )
    assert "#par_[It has one state" in written(str(spec)).text
    numbers = re.findall(r'"\)\[#"(\d)"\]', written(str(spec)).text)
    assert {"1", "2", "3", "4"} <= set(numbers)


class Checked(HTMLParser):
    """Tags that are balanced, and what refers to what."""

    VOID = frozenset(("meta", "img", "br", "link", "hr"))

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: Counter[str] = Counter()
        self.links: set[str] = set()
        self.tags: Counter[str] = Counter()
        self.outside: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids[value or ""] += 1
            if name == "href" and value:
                self.links.add(value.removeprefix("#"))
            if name in ("href", "src") and value and not value.startswith(("#", "data:")):
                self.outside.append(value)
            assert not name.startswith("on")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def check(self) -> None:
        assert not self.open
        assert not [id for id, count in self.ids.items() if count > 1 or not id or " " in id]
        assert self.links <= self.ids.keys()
        assert not self.outside
        assert self.tags["script"] == 0


def test_names_of_strangers_are_text(tmp_path: Path) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_text(HOSTILE, "utf-8")
    done = specc("doc", path, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "out/hostile.html").read_text("utf-8")
    page = Checked(text)
    page.check()
    assert page.tags["h1"] == 1
    # All pictures are those of the document, and what could be a command is a text.
    assert page.tags["img"] == text.count('src="data:image/svg+xml;base64,')
    for title in ("onerror=alert(1)&gt;", "#panic(", "#import", "@preview", "\\u{202e}rtl", "]#["):
        assert title in text.replace("&quot;", '"')
    assert "\u202e" not in text
    assert (tmp_path / "out/hostile.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.long
def test_what_cannot_be_read_or_written(tmp_path: Path) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_text(HOSTILE, "utf-8")
    done = specc("doc", path, "--departures", tmp_path / "none.md")
    assert done.returncode == 2 and "none.md cannot be read" in done.stderr
    path.write_text("specc: [", "utf-8")
    assert specc("doc", path).returncode == 1
    path.write_text(HOSTILE, "utf-8")
    (tmp_path / "file").write_text("", "utf-8")
    done = specc("doc", path, "--out", tmp_path / "file/in")
    assert done.returncode == 2 and "cannot be written" in done.stderr
    path.write_text(HOSTILE.replace("else n_1", "else 1[m]"), "utf-8")
    assert specc("doc", path, "--out", tmp_path / "out").returncode == 1
    assert "The specification has errors" in (tmp_path / "out/hostile.html").read_text("utf-8")


def test_a_file_is_no_folder_for_documents(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    done = specc("doc", "specs/conveyor_gate.yaml", "--out", tmp_path / "file")
    assert done.returncode == 2 and "file is no folder; name another one" in done.stderr


def test_departures_and_the_equations_that_they_are_about() -> None:
    text = (ROOT / "docs/errata.md").read_text("utf-8")
    found = departures_in(text)
    by_where = {each.where: each for each in found}
    assert len(found) > 40
    assert by_where["27, 30, 31"].equations == (27, 30, 31)
    assert by_where["69, 4.8"].equations == (69,)
    assert by_where["4.8, internal structure; 69"].equations == (69,)
    assert by_where["Table 6"].equations == by_where["4.4"].equations == ()
    assert "**" not in by_where["10"].wrong


# What takes more than a few seconds.


@pytest.mark.parametrize(
    "path",
    [pytest.param(each, marks=pytest.mark.long if each in FEW else SOAK) for each in ALL],
)
def test_documents_of_all_specifications(path: str, tmp_path: Path) -> None:
    if ("panda" in path or "cubes" in path) and not MODELS.exists():
        pytest.skip("the robot models are an own step: make models")
    done = specc("doc", path, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    name = Path(path).stem
    (html,) = tmp_path.glob("*.html")
    (pdf,) = tmp_path.glob("*.pdf")
    assert name in html.name or name in ("rovers",)
    page = Checked(html.read_text("utf-8"))
    page.check()
    result = pipeline.compile_spec(str(ROOT / path))
    numbers = set(numbers_in(result.system, set()))
    assert {f"{kind}-{number}" for kind, number in numbers} <= page.ids.keys()
    assert pdf.read_bytes().startswith(b"%PDF")


@pytest.mark.long
def test_the_same_bytes_in_two_environments(tmp_path: Path) -> None:
    """Other time zone, language, hashes and home, and no font of the system."""
    nothing = tmp_path / "fonts.conf"
    nothing.write_text("<fontconfig></fontconfig>", "utf-8")
    other = {
        "TZ": "Asia/Tokyo",
        "LC_ALL": "C",
        "PYTHONHASHSEED": "7",
        "HOME": str(tmp_path),
        "FONTCONFIG_FILE": str(nothing),
        "SOURCE_DATE_EPOCH": "1000000000",
    }
    usual = {"TZ": "Europe/Warsaw", "LC_ALL": "C.UTF-8", "PYTHONHASHSEED": "1"}
    found = []
    for number, added in enumerate((usual, other)):
        out = tmp_path / str(number)
        command = [sys.executable, "-m", "specc", "doc", str(ROOT / "specs/conveyor_gate.yaml")]
        environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT}/runtime", **added}
        subprocess.run([*command, "--out", str(out)], check=True, env=environment, cwd=tmp_path)
        found.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert len(found[0]) == 2
    assert found[0] == found[1]


FORMULAS = {
    4: "𝑓𝑒irp,m,1𝜎(𝑒𝑥𝑐irp,m𝜄)≜𝒫︀(𝑒𝑥𝑐irp,m[𝑇˜𝐸𝐵𝑑])",
    5: "𝑓𝑒irp,m,1𝜏(𝑒𝑒irp,m𝜄,𝑒𝑥𝑐irp,m𝜄,𝑒𝑥𝐸irp,m𝜄)≜(𝑇𝐸𝐵𝑐=𝜀𝑝,𝜀𝑟𝑇𝐸𝐵𝑔)∨(𝑇𝐸𝐵𝑑≠𝜀𝑝,𝜀𝑟𝑇𝐸𝐵𝑔)",
    7: "𝑓𝑒irp,m,2𝜎(𝑒𝑥𝑐irp,m𝜄)≜𝒫︀(𝑒𝑥𝑐irp,m[𝑏˜])∧(∀𝑣∈𝑏𝑣∈{𝔲,𝔠,𝔤})",
    10: "𝑓𝑒irp,m,0𝜎(𝑒𝑥𝑐irp,m𝜄)≜¬𝒫︀(𝑒𝑥𝑐irp,m[𝑇˜𝐸𝐵𝑑])∧(¬𝒫︀(𝑒𝑥𝑐irp,m[𝑏˜])∨(∃𝑣∈𝑏𝑣=𝔰))",
    14: (
        "{𝑒𝑦𝐸irp,m𝜄+1[𝑐˜𝑑]≔𝑓𝑒,𝐸irp,m,0(𝑒𝑒irp,m𝜄,𝑒𝑥𝐸irp,m𝜄)≜ℳ︀ℛ︀𝑐𝑑(𝑚𝑑−𝑚𝑚,𝑅𝑝,𝑐𝑤)𝑒"
        "𝑒irp,m𝜄+1[𝑅˜𝑝]≔𝑓𝑒,𝑒irp,m,0,1(𝑒𝑒irp,m𝜄,𝑒𝑥𝐸irp,m𝜄)≜ℳ︀ℛ︀state(𝑚𝑑−𝑚𝑚,𝑅𝑝,𝑐𝑤"
        ")"
    ),
    17: (
        "{𝑒𝑦𝐸irp,m𝜄+1[𝑐˜𝑑]≔𝑓𝑒,𝐸irp,m,1(𝑒𝑒irp,m𝜄,𝑒𝑥𝑐irp,m𝜄,𝑒𝑥𝐸irp,m𝜄)≜ℳ︀ℛ︀𝑐𝑑(𝑚𝑖−"
        "𝑚𝑚,𝑅𝑝,𝑐𝑤)𝑒𝑒irp,m𝜄+1[𝑅˜𝑝]≔𝑓𝑒,𝑒irp,m,1,3(𝑒𝑒irp,m𝜄,𝑒𝑥𝑐irp,m𝜄,𝑒𝑥𝐸irp,m𝜄)≜ℳ"
        "︀ℛ︀state(𝑚𝑖−𝑚𝑚,𝑅𝑝,𝑐𝑤)"
    ),
    26: "𝑟˙𝐸𝑑≜𝒫︀ℱ︀(𝐹𝐸𝑑,𝑉𝐸𝑑,𝐷𝐸𝑑,𝐼𝐸𝑑,𝑏,𝑟˙𝐸𝑝,𝐹𝐸𝑐,Δ𝜄)",
    53: "𝑓𝑐irp,2𝜏(𝑐𝑐irp𝜄)≜|𝑂𝐵𝑔|>0",
    67: "𝑂𝐵𝑏≜arg max𝑜∈𝑂𝐵𝑔𝑜.confidence",
    76: "𝑐𝑦𝑒irp,m𝜄+1[𝑏˜]≔𝑓𝑐,𝑒,mirp,6,1()≜[𝔲,𝔲,𝔤,𝔲,𝔲,𝔲]",
}
"""The letters of equations of the manipulator and the control subsystem, in order of MathML."""


@pytest.mark.long
def test_equations_of_the_flagship(tmp_path: Path) -> None:
    errata = ROOT / "docs/errata.md"
    path = ROOT / "specs/irp_picking.yaml"
    assert specc("doc", path, "--out", tmp_path, "--departures", errata).returncode == 0
    text = (tmp_path / "irp_picking.html").read_text("utf-8")
    departures = departures_in(errata.read_text("utf-8"))
    for number, letters in FORMULAS.items():
        end = text.index(f'id="eq-{number}"')
        start = text.rindex('<div class="formula">', 0, end)
        about = text[text.rindex('<div class="about">', 0, end) : start]
        found = unescape("".join(re.findall(r">([^<]*)<", text[start + 20 : end])))
        assert found == letters, number
        assert ("†" in about) == any(number in each.equations for each in departures)
    assert "mprescripts" in text
    for formula in re.findall(r"<mmultiscripts>.*?</mmultiscripts>", text):
        # Nothing stands behind a base that something stands before.
        assert "<mprescripts></mprescripts>" not in formula or re.search(
            r"<mrow></mrow><mrow></mrow><mprescripts></mprescripts>", formula
        )


def test_requirements_name_values_where_they_are() -> None:
    text = written("specs/examples/tray_cell.yaml").text
    start = text.rindex('[#"Requirements and proofs"]')
    formulas = text[start : text.index("#table_", start)]
    for place in ("cell.c.x.desk.order", "cell.c.memory.tries"):
        assert f'#u("{place}"' in formulas
    assert '"desk"/**/#sym.comma/**/"panel"' in formulas
    assert "diamond.stroked" in formulas and "square.stroked" in formulas
