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
from tests.seeds import FIRST
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


@pytest.mark.long
@pytest.mark.parametrize("seed", range(FIRST, FIRST + 4))
def test_small_edits_of_the_flagship(seed: int) -> None:
    check(FLAGSHIP.parent, FLAGSHIP, FLAGSHIP, FLAGSHIP.read_text(), seed, 12)


@pytest.mark.parametrize(
    ("seed", "steps"),
    [(0, 1), *(pytest.param(n, 12, marks=pytest.mark.long) for n in range(FIRST, FIRST + 4))],
)
def test_small_edits_of_a_system_and_of_a_description_that_it_uses(
    seed: int, steps: int, tmp_path: Path
) -> None:
    system, library = map(Path, write(tmp_path))
    check(tmp_path, system, system, SYSTEM, seed, steps)
    check(tmp_path, system, library, LIBRARY, seed, steps)


def test_a_line_that_is_typed_where_another_one_is_wrong(tmp_path: Path) -> None:
    """The line cannot be read, so it is blank in each of the texts that tell what else is wrong."""
    system, _ = map(Path, write(tmp_path))
    wrong = SYSTEM.replace("x.E.q_m, limit)", "x.E.q_n, limit)  # specc: ignore W0611")
    line, at = '      q_o: {type: Joints, init: "[0', wrong.index("        let:\n")
    texts = [f"{wrong[:at]}    {line[:size]}\n{wrong[at:]}" for size in (12, 20, 30, len(line))]
    compare(tmp_path, system, system, SYSTEM, texts)
