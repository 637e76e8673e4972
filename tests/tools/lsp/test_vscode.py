"""The extension for VS Code is well formed and starts the command that exists."""

import json
import re
import shutil
import subprocess

import pytest

from specc import __version__
from tests.house.tree import ROOT

FOLDER = ROOT / "editors/vscode"
PACKAGE = json.loads((FOLDER / "package.json").read_text())
SCRIPT = (FOLDER / "extension.js").read_text()


def test_package_names_what_there_is() -> None:
    assert PACKAGE["version"] == __version__
    assert (FOLDER / PACKAGE["main"]).is_file()
    assert PACKAGE["activationEvents"] == ["onLanguage:yaml"]
    imported = set(re.findall(r'require\("([\w-]+)[/"]', SCRIPT)) - {"vscode"}
    assert imported == set(PACKAGE["dependencies"])


def test_settings_and_commands_are_those_of_the_script() -> None:
    contributes = PACKAGE["contributes"]
    commands = {command["command"] for command in contributes["commands"]}
    assert set(re.findall(r'registerCommand\("([\w.]+)"', SCRIPT)) == commands
    assert "specc.command" in contributes["configuration"]["properties"]
    assert 'getConfiguration("specc").get("command")' in SCRIPT
    assert 'args: ["lsp"]' in SCRIPT


def test_the_readme_names_the_package_that_is_made() -> None:
    readme = (FOLDER / "README.md").read_text()
    assert f"{PACKAGE['name']}-{PACKAGE['version']}.vsix" in readme
    assert "vsce package" in PACKAGE["scripts"]["package"]
    assert "npm run package" in readme


def test_script_parses() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    checked = subprocess.run([node, "--check", str(FOLDER / "extension.js")], capture_output=True)
    assert checked.returncode == 0, checked.stderr
