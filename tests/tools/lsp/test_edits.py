"""What an editor says of an edited text is what a fresh check says of it."""

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from specc.pipeline import check_spec
from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from tests.house.tree import ROOT
from tests.seeds import Seeds, blocks
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


def check(folder: Path, root: Path, changed: Path, text: str, seed: int, steps: int) -> None:
    """All findings of each text are those of a check of the same texts, with their places."""
    project = Project((str(folder),))
    for now in history(text, random.Random(seed), steps):
        project.put(str(changed), now)
        analysis = project.analyse(str(root))
        fresh = check_spec(str(root), texts={str(changed): now})
        assert analysis.result.diagnostics == fresh.diagnostics, now
        # The editor shows all that comments and settings leave, where the text has it.
        shown = {
            (n.diagnostic, n.range) for found in features.notes(project).values() for n in found
        }
        for found in analysis.diagnostics:
            assert (found, project.present_range(fresh.sources, found.primary)) in shown, now


@pytest.mark.long
@pytest.mark.parametrize("seeds", blocks([0], long=1, each=1))
def test_small_edits_of_the_flagship(seeds: Seeds) -> None:
    for seed in seeds:
        steps = 6 if seeds.are_fresh else 2
        check(FLAGSHIP.parent, FLAGSHIP, FLAGSHIP, FLAGSHIP.read_text(), seed, steps)


@pytest.mark.parametrize("seeds", blocks([0], long=1, each=1))
def test_small_edits_of_a_system_and_of_a_description_that_it_uses(
    seeds: Seeds, tmp_path: Path
) -> None:
    system, library = map(Path, write(tmp_path))
    for seed in seeds:
        steps = 12 if seeds.are_fresh else 6
        check(tmp_path, system, system, SYSTEM, seed, steps)
        check(tmp_path, system, library, LIBRARY, seed, steps)


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
    found = [c.label for c in features.completions(project, root, text.index("|"))]
    assert {*found[:2]} == {"flat", "square"}
