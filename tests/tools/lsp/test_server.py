"""The language server as an editor meets it: a process, spoken to over its pipes."""

import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import RenameError
from tests.house.tree import ROOT
from tests.seeds import SOAK
from tests.tools.lsp.client import Client, ServerError
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, place

SERVER = [sys.executable, "-m", "specc", "lsp", "--stdio"]
FLAGSHIP = ROOT / "specs/irp_picking.yaml"
POSITIONS = ("hover", "definition", "references", "completion", "prepareRename", "rename")
MORE: dict[str, dict[str, Any]] = {
    "references": {"context": {"includeDeclaration": True}},
    "rename": {"newName": "quite_new"},
}


def position(text: str, marked: str) -> tuple[int, int]:
    """Line and UTF-16 column of the `|` in `marked`."""
    offset = place(text, marked)
    start = text.rfind("\n", 0, offset) + 1
    return text.count("\n", 0, offset), len(text[start:offset].encode("utf-16-le")) // 2


def codes(found: list[dict[str, Any]]) -> set[str]:
    return {item["code"] for item in found if item["severity"] == 1}


def stretch(text: str, found: dict[str, Any]) -> str:
    """The text of a range, which lies in one line."""
    start, end = found["start"], found["end"]
    line = text.splitlines()[start["line"]].encode("utf-16-le")
    return line[2 * start["character"] : 2 * end["character"]].decode("utf-16-le")


def test_says_what_it_can_do(client: Client) -> None:
    able = client.capabilities
    assert able["textDocumentSync"]["change"] == 1
    assert able["renameProvider"] == {"prepareProvider": True}
    for provider in ("hover", "definition", "references", "completion"):
        assert able[f"{provider}Provider"]


def test_diagnostics_follow_the_text(client: Client, folder: Path) -> None:
    uri = client.open(folder / "arm.yaml")
    assert codes(client.diagnostics(uri)) == set()
    wrong = SYSTEM.replace("near(q_p, x.E.q_m, limit)", "near(q_p, x.E.q_m, limti)")
    client.change(uri, wrong)
    (found,) = [d for d in client.diagnostics(uri) if d["severity"] == 1]
    assert found["code"] == "E0201"
    assert found["source"] == "specc"
    assert "did you mean" in found["message"]
    assert stretch(wrong, found["range"]) == "limti"
    # Not even YAML, and more than one line of it.
    client.change(uri, wrong.replace("frames: {", "frames: ["))
    assert codes(client.diagnostics(uri)) == {"E0009", "E0201"}
    client.change(uri, SYSTEM)
    assert codes(client.diagnostics(uri)) == set()


def test_values_that_show_a_refutation_are_in_the_message(client: Client, folder: Path) -> None:
    case = ROOT / "tests/cases/machines/E0602-thresholds.yaml"
    uri = client.open(folder / "case.yaml", case.read_text("utf-8"))
    (found,) = [d for d in client.diagnostics(uri) if d["code"] == "E0602"]
    assert "\nfor example: `x.c.d` = 1.5\n" in found["message"]


def test_columns_are_utf_16(client: Client, folder: Path) -> None:
    text = SYSTEM.replace('"end-effector 🦾"}', '"🦾🦾", H: 1}')
    uri = client.open(folder / "arm.yaml", text)
    (found,) = [d for d in client.diagnostics(uri) if d["severity"] == 1]
    assert found["code"] == "E0103"
    assert stretch(text, found["range"]) == "1"
    line, column = position(SYSTEM, "|}\ntypes:")
    client.change(uri, SYSTEM.replace('🦾"}\ntypes', '🦾", H: "pose"}\ntypes'))
    client.diagnostics(uri)
    hover = client.ask("hover", uri, line, column + 2)
    assert "frame" in hover["contents"]["value"]


def test_unsaved_texts_of_other_files_count(client: Client, folder: Path) -> None:
    system = client.open(folder / "arm.yaml")
    assert codes(client.diagnostics(system)) == set()
    library = client.open(folder / "lib/fingers.yaml")
    assert codes(client.diagnostics(library)) == set()
    client.diagnostics(system)
    client.change(library, LIBRARY.replace('{tolerance: "real[m]"}', '{width: "real[m]"}'))
    assert codes(client.diagnostics(system)) == {"E0201", "E0211"}
    client.notify("textDocument/didClose", {"textDocument": {"uri": library}})
    assert codes(client.diagnostics(system)) == set()


def test_a_file_is_checked_as_part_of_the_system_that_uses_it(client: Client, folder: Path) -> None:
    wrong = LIBRARY.replace("y.E.d_d: d_p", 'y.E.d_d: "1[N]"')
    library = client.open(folder / "lib/fingers.yaml", wrong)
    assert codes(client.diagnostics(library)) == {"E0310"}


def test_answers(client: Client, folder: Path) -> None:
    uri = client.open(folder / "arm.yaml")
    client.diagnostics(uri)
    at = position(SYSTEM, "X_c: |T_c, grip")
    hover = client.ask("hover", uri, *at)
    assert "eq. 24" in hover["contents"]["value"]
    assert stretch(SYSTEM, hover["range"]) == "T_c"
    (definition,) = client.ask("definition", uri, *at)
    assert definition["uri"] == uri
    assert definition["range"]["start"]["line"] == position(SYSTEM, "|T_c: {is")[0]
    references = client.ask("references", uri, *at, context={"includeDeclaration": True})
    assert len(references) == SYSTEM.count("T_c")
    assert stretch(SYSTEM, client.ask("prepareRename", uri, *at)) == "T_c"
    edit = client.ask("rename", uri, *at, newName="X_BE")
    assert len(edit["changes"][uri]) == SYSTEM.count("T_c")
    with pytest.raises(ServerError, match="taken"):
        client.ask("rename", uri, *at, newName="q_p")
    completion = client.ask("completion", uri, *position(SYSTEM, "move: {y.E.q_d: x.c.|q_d"))
    assert {item["label"] for item in completion["items"]} == {"q_d", "mode"}


def test_completes_in_a_line_that_is_not_finished(client: Client, folder: Path) -> None:
    uri = client.open(folder / "arm.yaml")
    client.diagnostics(uri)
    text = SYSTEM.replace('terminal: {reached: "near_goal and', 'terminal: {reached: "x.E.')
    client.change(uri, text)
    completion = client.ask("completion", uri, *position(text, 'reached: "x.E.|'))
    (item,) = completion["items"]
    assert item["label"] == "q_m"
    assert item["detail"] == "element vector[2, rad]"


def test_other_files_are_left_alone(client: Client, folder: Path) -> None:
    uri = client.open(folder / "compose.yaml", "services: {web: {image: [}\n")
    assert client.diagnostics(uri) == []


def test_survives_requests_about_broken_and_unknown_files(client: Client, folder: Path) -> None:
    rng = random.Random(11)
    uri = client.open(folder / "arm.yaml")
    unknown = (folder / "nothing.yaml").as_uri()
    for _ in range(6):
        start = rng.randrange(len(SYSTEM))
        text = SYSTEM[:start] + rng.choice(["", '"', "{", "]", "\t", "\0", "🦾"])
        text += SYSTEM[start + rng.randrange(200) :]
        client.change(uri, text)
        for method in POSITIONS:
            for where in (uri, unknown):
                line = rng.randrange(90)
                try:
                    client.ask(method, where, line, rng.randrange(60), **MORE.get(method, {}))
                except ServerError as error:
                    assert method in ("rename", "prepareRename"), error
    client.change(uri, SYSTEM)
    assert codes(client.diagnostics(uri)) == set()


@pytest.mark.long
@pytest.mark.parametrize(
    ("seed", "texts"),
    [
        (7, 4),
        pytest.param(7, 8, marks=pytest.mark.long),
        *(pytest.param(n, 20, marks=pytest.mark.long) for n in range(8, 11)),
        *(pytest.param(n, 20, marks=SOAK) for n in range(11, 14)),
    ],
)
def test_broken_texts_of_the_flagship_raise_nothing(seed: int, texts: int) -> None:
    rng = random.Random(seed)
    whole = FLAGSHIP.read_text()
    path = str(FLAGSHIP)
    project = Project()
    for number in range(texts):
        start = rng.randrange(len(whole))
        end = min(len(whole), start + rng.randrange(1, 40))
        inserted = "".join(rng.choices(" \n:{}[]\"'x.#-", k=rng.randrange(6)))
        text = whole if number == 0 else whole[:start] + inserted + whole[end:]
        project.put(path, text)
        for root in project.find_roots(path):
            project.analyse(root)
        features.notes(project)
        for offset in (start, rng.randrange(len(text))):
            features.hover(project, path, offset)
            features.definition(project, path, offset)
            features.references(project, path, offset)
            features.completions(project, path, offset)
            try:
                features.rename_at(project, path, offset, "quite_new")
            except RenameError:
                continue


@pytest.mark.long
def test_ends_with_its_client(folder: Path) -> None:
    ended = subprocess.run(SERVER, input=b"", capture_output=True, cwd=folder, timeout=60)
    assert ended.returncode == 0


@pytest.mark.long
def test_says_how_to_install_what_is_missing() -> None:
    program = (
        "import sys; sys.modules['pygls'] = None\n"
        "from specc.cli import main; sys.exit(main(['lsp']))"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True
    )
    assert ended.returncode == 2
    assert "[editor]" in ended.stderr
    assert "Traceback" not in ended.stderr
