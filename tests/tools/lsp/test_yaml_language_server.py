"""The schema in the hands of yaml-language-server, the real one from npm."""

import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from specc.schema.files import json_schema
from tests.tools.lsp.client import Client

pytestmark = pytest.mark.long
TEXT = """\
# yaml-language-server: $schema=schema.json
specc: 1
subsystem:
  rate: 10 Hz
  memory:
    d: {type: "real[m]", init: 0}
  states:
    S0: idle
  transitions:
    - {from: S0, cause: terminal, when: always, to: S0}
"""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The command of a yaml-language-server that was installed for this run."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        pytest.skip("node and npm are not installed")
    prefix = tmp_path_factory.mktemp("npm")
    install = [npm, "install", "--no-audit", "--no-fund", "--prefix", str(prefix)]
    try:
        done = subprocess.run(
            [*install, "yaml-language-server@1"], capture_output=True, timeout=180
        )
    except subprocess.TimeoutExpired:
        pytest.skip("the registry of npm does not answer")
    if done.returncode:
        pytest.skip(f"npm cannot install yaml-language-server: {done.stderr[-200:]!r}")
    script = prefix / "node_modules/yaml-language-server/bin/yaml-language-server"
    return [node, str(script), "--stdio"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("workspace")
    (folder / "schema.json").write_text(json.dumps(json_schema()))
    return folder


@pytest.fixture
def client(server: list[str], folder: Path) -> Iterator[Client]:
    settings = {"yaml": {"validate": True, "completion": True, "hover": True}}
    with Client(server, folder, settings) as client:
        yield client


def wait_for(client: Client, uri: str, *words: str) -> None:
    """Wait until a diagnostic has all words; the server may publish some before it has the schema.

    Raises:
        queue.Empty: none ever comes.
    """
    while not any(
        all(word in found["message"] for word in words) for found in client.diagnostics(uri)
    ):
        pass


def test_says_what_is_wrong(client: Client, folder: Path) -> None:
    uri = client.open(folder / "missing.yaml", TEXT.replace('type: "real[m]", ', ""))
    wait_for(client, uri, "type")
    client.change(uri, TEXT.replace("rate:", "rats:"))
    wait_for(client, uri, "rats")
    client.change(uri, TEXT.replace("cause: terminal", "cause: [terminal]"))
    wait_for(client, uri, "string")
    client.change(uri, TEXT)
    assert client.diagnostics(uri) == []


def test_completes_keys_and_members(client: Client, folder: Path) -> None:
    def labels(text: str, name: str) -> set[str]:
        before, after = text.split("|")
        uri = client.open(folder / name, before + after)
        line = before.count("\n")
        found = client.ask("completion", uri, line, len(before.rpartition("\n")[2]))
        return {item["label"] for item in found["items"]}

    keys = labels(TEXT.replace("  rate:", "  |\n  rate:"), "keys.yaml")
    assert {"title", "let", "conditions", "behaviours", "assume"} <= keys
    inside = TEXT.replace("S0: idle", "S0:\n      behaviour: idle\n      |")
    assert labels(inside, "inside.yaml") >= {"title", "eq", "table"}
    causes = labels(TEXT.replace("cause: terminal", "cause: |"), "causes.yaml")
    assert causes == {"terminal", "error"}
    row = labels(TEXT.partition("    - {from")[0] + "    - from: S0\n      |\n", "row.yaml")
    assert {"cause", "when", "title", "eq"} <= row
    kinds = labels(TEXT.replace("  states:", "  conditions:\n    |\n  states:"), "kinds.yaml")
    assert {"initial", "terminal", "error"} <= kinds
    behaviour = TEXT.replace("  states:", "  behaviours:\n    idle:\n      |\n  states:")
    assert {"functions", "terminal", "error"} <= labels(behaviour, "behaviour.yaml")
    image = "plant:\n  model: a.xml\n  bind:\n    a.R.k.I: {image: |}\n"
    assert {"rgb", "depth"} <= labels(TEXT + image, "image.yaml")
    opaque = "types:\n  T:\n    |\n"
    assert {"type", "fields", "frames", "opaque", "python"} <= labels(TEXT + opaque, "types.yaml")
    agent = "agents:\n  a:\n    |\n"
    assert {"control", "virtual_effectors", "real_receptors"} <= labels(TEXT + agent, "agent.yaml")
    top = labels(TEXT + "|\n", "top.yaml")
    assert {"system", "agents", "frames", "operators", "plant", "task"} <= top


def test_explains_a_key(client: Client, folder: Path) -> None:
    uri = client.open(folder / "hover.yaml", TEXT)
    hover = client.ask("hover", uri, 3, 3)
    assert "Periods per second" in json.dumps(hover["contents"])
    lines = TEXT.split("\n")
    for word, meaning in (
        ("cause", "Which condition ended it"),
        ("memory", "Values kept"),
        ("init", "first period"),
        ("states", "States, each with its behaviour"),
    ):
        number = next(n for n, line in enumerate(lines) if word in line)
        hover = client.ask("hover", uri, number, lines[number].index(word) + 1)
        assert meaning in json.dumps(hover["contents"]), word
