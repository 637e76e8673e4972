"""What an editor keeps of earlier analyses changes no finding: all are those of a fresh one."""

import gc
import random
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from specc.tools.lsp import answers
from specc.tools.lsp.project import Project
from tests.house.tree import ROOT
from tests.seeds import FIRST, Seeds, blocks
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, write

FLAGSHIP = ROOT / "specs/irp_picking.yaml"
WORD = re.compile(r"[A-Za-z_]\w*|\d+(?:\.\d+)?|==|!=|<=?|>=?")


def edited(text: str, rng: random.Random) -> str:
    """A text with one small change, which may be a fault."""
    lines = text.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    match rng.randrange(6):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, lines[rng.randrange(len(lines))])
        case 2:
            lines.insert(at, "# a comment\n")
        case 3:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
        case _:
            words = WORD.findall(text)
            found = list(WORD.finditer(lines[at]))
            if found:
                start, end = rng.choice(found).span()
                lines[at] = lines[at][:start] + rng.choice(words) + lines[at][end:]
    return "".join(lines)


def history(text: str, rng: random.Random, steps: int) -> Iterator[str]:
    """Texts one after the other; now and then somebody goes back to an earlier one."""
    texts = [text]
    for _ in range(steps):
        before = rng.choice(texts) if rng.random() < 0.3 else texts[-1]
        if len(texts) - texts.index(before) > 4:
            before = text
        texts.append(edited(before, rng))
        yield texts[-1]


def told(project: Project, root: str) -> list[str]:
    """All that is found, with its places in the texts."""
    project.analyse(root)
    return [
        repr((path, found)) for path, notes in answers.notes(project).items() for found in notes
    ]


def check(folder: Path, root: Path, changed: Path, text: str, seed: int, steps: int) -> None:
    compare(folder, root, changed, text, history(text, random.Random(seed), steps))


def compare(folder: Path, root: Path, changed: Path, text: str, texts: Iterable[str]) -> None:
    """Findings of texts, one after the other, are those of fresh analyses."""
    project = Project((str(folder),))
    project.put(str(changed), text)
    project.analyse(str(root))
    for now in texts:
        fresh = Project((str(folder),))
        # What a fresh analysis says of a text with errors goes by what was known before them.
        fresh._understood |= project._understood
        gc.collect()  # contexts of z3, whose size Python does not know
        for each in (project, fresh):
            each.put(str(changed), now)
        assert told(project, str(root)) == told(fresh, str(root)), now


@pytest.mark.long
def test_a_few_small_edits_of_the_flagship() -> None:
    check(FLAGSHIP.parent, FLAGSHIP, FLAGSHIP, FLAGSHIP.read_text(), seed=0, steps=2)


@pytest.mark.parametrize("seeds", blocks((), long=1, each=1)[1:])
def test_small_edits_of_the_flagship(seeds: Seeds) -> None:
    for seed in seeds:
        check(FLAGSHIP.parent, FLAGSHIP, FLAGSHIP, FLAGSHIP.read_text(), seed, 6)


@pytest.mark.parametrize("seeds", blocks([0], long=1, each=1))
def test_small_edits_of_a_system_and_of_a_description_that_it_uses(
    seeds: Seeds, tmp_path: Path
) -> None:
    system, library = map(Path, write(tmp_path))
    for seed in seeds:
        steps = 6 if seeds.are_fresh else 1
        check(tmp_path, system, system, SYSTEM, seed, steps)
        check(tmp_path, system, library, LIBRARY, seed, steps)


VALUED = """\
specc: 1.2
system: valued
use: [shared.yaml]
constants:
  low: 1
  high: low
  spare: high + 1
agents:
  a:
    virtual_effectors:
      own:
        rate: 10 Hz
        y: {c: {n: int}}
        memory: {n: {type: int, init: low}}
        conditions: {initial: {above: "n >\\nlow", below: "n <=\\thigh"}}
        functions: {count: {n: n + 1, y.c.n: n}}
        behaviours: {work: {functions: [count], terminal: always}}
        states: {S0: work}
        initial_state: S0
        transitions: [[S0, terminal, above, S0], [S0, terminal, below, S0]]
      described: {use: described.yaml, with: {bound: spare}}
    control:
      rate: 10 Hz
      x: {own: {n: {type: int, init: 0}}, described: {n: {type: int, init: 0}}}
      conditions: {terminal: {reached: x.own.n >= shared and x.described.n < spare}}
      behaviours: {wait: {terminal: reached}, end: {terminal: never}}
      states: {S0: wait, S1: end}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
require:
  - {that: always(a.own.n >= low), because: it is tried}
"""
BESIDE = {
    "shared.yaml": "specc: 1.2\nconstants:\n  shared: 3\n  twice: 2 * shared\n",
    "described.yaml": """\
specc: 1.2
use: [shared.yaml]
parameters: {bound: int}
constants:
  inner: twice
subsystem:
  rate: 10 Hz
  y: {c: {n: int}}
  memory: {n: {type: int, init: 0}}
  conditions: {initial: {above: "n >\\ninner", below: "n <= max(bound, 6)"}}
  functions: {count: {n: n + 1, y.c.n: n}}
  behaviours: {work: {functions: [count], terminal: always}}
  states: {S0: work}
  initial_state: S0
  transitions: [[S0, terminal, above, S0], [S0, terminal, below, S0]]
""",
}
NUMBERS = ("0", "1", "2", "3", "6")
OTHERS = ('"0 +\\nlow"', "high + 1", "2 * shared", "twice", "0.5", '"1[m]"', "1 +")


def test_other_values_of_constants(tmp_path: Path) -> None:
    """In the file that is edited, in one that it uses, and in a description."""
    texts = {"valued.yaml": VALUED, **BESIDE}
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8")
    rng, project, said = random.Random(FIRST), Project((str(tmp_path),)), set[int]()
    for _ in range(40):
        name = rng.choice([*texts])
        lines = texts[name].split("\n")
        values = [n for n, line in enumerate(lines) if re.fullmatch("  [a-z]+: [^{]+", line)]
        at = rng.choice([n for n in values if not lines[n].startswith("  rate")])
        lines[at] = (
            f"{lines[at].partition(':')[0]}: {rng.choice(rng.choice((NUMBERS, NUMBERS, OTHERS)))}"
        )
        texts[name] = "\n".join(lines)
        fresh = Project((str(tmp_path),))
        fresh._understood |= project._understood
        for each in (project, fresh):
            for file, text in texts.items():
                each.put(str(tmp_path / file), text)
        found = told(project, str(tmp_path / "valued.yaml"))
        assert found == told(fresh, str(tmp_path / "valued.yaml")), texts
        said.add(len(found))
    assert len(said) > 3, said


KINDS = """\
specc: 1.2
system: kinds
types: {{Colour: "enum[red, green]", Shape: "enum[flat, square]"}}
constants: {{mode: {mode}}}
agents:
  a:
    control:
      rate: 10 Hz
      memory: {{n: {{type: int, init: 0}}}}
      conditions:
        terminal:
          asked: {asked}
          other: n > 5
      functions: {{count: {{n: n + 1}}}}
      behaviours: {{work: {{functions: [count], terminal: asked}}}}
      states: {{S0: work}}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""


def test_what_is_proposed_after_a_constant_has_another_type(tmp_path: Path) -> None:
    root, project = str(tmp_path / "kinds.yaml"), Project((str(tmp_path),))
    for mode in ("{type: Colour, is: red}", "{type: Shape, is: flat}"):
        project.put(root, KINDS.format(mode=mode, asked="n > 3"))
        project.analyse(root)
    text = KINDS.format(mode=mode, asked='"mode == |')
    project.put(root, text.replace("|", ""))
    project.analyse(root)
    found = [c.label for c in answers.completions(project, root, text.index("|"))]
    assert {*found[:2]} == {"flat", "square"}


def test_a_line_that_is_typed_where_another_one_is_wrong(tmp_path: Path) -> None:
    """The line cannot be read, so it is blank in each of the texts that tell what else is wrong."""
    system, _ = map(Path, write(tmp_path))
    wrong = SYSTEM.replace("x.E.q_m, limit)", "x.E.q_n, limit)  # specc: ignore W0611")
    line, at = '      q_o: {type: Joints, init: "[0', wrong.index("        let:\n")
    texts = [f"{wrong[:at]}    {line[:size]}\n{wrong[at:]}" for size in (12, 20, 30, len(line))]
    compare(tmp_path, system, system, SYSTEM, texts)
