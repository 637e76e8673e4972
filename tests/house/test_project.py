"""What the project says of itself agrees with what it has."""

import re
import subprocess
import sys
import tomllib
import zipfile
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.house.tree import ROOT, modules, tracked_files
from tests.seeds import short

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CODE = re.compile(r"^```.*?^```|`[^`\n]+`", re.MULTILINE | re.DOTALL)
TARGET = re.compile(r"^([a-z][\w-]*):", re.MULTILINE)
MAKE = re.compile(r"(?:^|`|\$ )\s*make ([a-z][\w-]*)", re.MULTILINE)


@pytest.mark.parametrize("document", ["README.md", "CONTRIBUTING.md"])
def test_documented_make_targets_exist(document: str) -> None:
    code = "\n".join(CODE.findall((ROOT / document).read_text(encoding="utf-8")))
    named = set(MAKE.findall(code))
    assert {"demo", "test"} <= named
    assert named <= set(TARGET.findall((ROOT / "Makefile").read_text(encoding="utf-8")))


EXTRAS = PROJECT["optional-dependencies"]
NAMES = {
    "OpenGL": "PyOpenGL",
    "fontTools": "fonttools",
    "_ruamel_yaml": "ruamel.yaml.clib",
    "cv2": "opencv-python-headless",
    "lsprotocol": "pygls",  # comes with it, in the versions that fit
    "pinocchio": "pin",
    "ruamel": "ruamel.yaml",
    "z3": "z3-solver",
}
"""Distributions whose modules have other names."""


def distributions(root: str, package: str) -> set[str]:
    """What the modules of a package need that is neither Python's nor the project's."""
    names = {name.split(".")[0] for module in modules(root, package) for name in module.imports()}
    foreign = names - sys.stdlib_module_names - {"specc", "specc_runtime"}
    return {NAMES.get(name, name) for name in foreign}


def declared(*requirements: list[str]) -> set[str]:
    return {Requirement(text).name for text in chain(*requirements)} - {"specc"}


def test_the_compiler_needs_no_extra_but_for_what_extras_are_for() -> None:
    imported = distributions(".", "specc") | {"ruff"}  # a program, not a module
    extras = (EXTRAS[name] for name in ("proof", "editor", "graph", "doc", "sweep", "ui"))
    fonts = {"ziamath"}  # no module of it is imported
    assert imported | fonts == declared(PROJECT["dependencies"], *extras)


def test_the_runtime_needs_nothing_of_the_compiler() -> None:
    theirs = {
        "rcl_interfaces",
        "rclpy",
        "tf2_ros",
    }  # of the user's ROS, in whose Python it is imported
    assert distributions("runtime", "specc_runtime") - theirs == declared(
        EXTRAS["run"], EXTRAS["vision"], EXTRAS["record"], EXTRAS["bags"]
    )


def test_lock_pins_what_the_project_requires() -> None:
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pins = {
        canonicalize_name(pin.name): next(iter(pin.specifier)).version
        for pin in (Requirement(line) for line in lines if line and not line.startswith("#"))
    }
    everything = map(Requirement, (*PROJECT["dependencies"], *chain(*EXTRAS.values())))
    unmet = [
        str(wanted)
        for wanted in everything
        if wanted.name != PROJECT["name"]
        and not wanted.specifier.contains(pins.get(canonicalize_name(wanted.name), "0"))
    ]
    assert unmet == []


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the contents of the project's wheel."""
    out = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(out)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = out.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(out / "site")
    return out / "site"


@pytest.mark.long
def test_wheel_finds_its_own_templates_and_specs(installed: Path) -> None:
    program = (
        "from specc.resources import specs_dir, templates_dir\n"
        "import specc_runtime\n"
        "from specc.pipeline import check_spec\n"
        "from specc.resources import library_parts, on_disk\n"
        "assert not any(check_spec(name).diagnostics for name in library_parts())\n"
        "print(templates_dir(), specs_dir(), specc_runtime.__file__, sep='\\n')\n"
        "print(on_disk('specc:pose_tracker'))"
    )
    printed = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=installed,
        env={"PYTHONPATH": str(installed)},
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    templates, specs, runtime, part = map(Path, printed.splitlines())
    assert all(path.is_relative_to(installed) for path in (templates, specs, runtime, part))
    assert part.is_file()
    assert any(path.is_file() for path in templates.rglob("*"))


@pytest.mark.parametrize("folder", short(["specs", "templates"], 1))
def test_wheel_carries_every_file_of(folder: str, installed: Path) -> None:
    source, target = ROOT / folder, installed / "specc/_data" / folder
    tracked = {path.relative_to(source) for path in tracked_files() if source in path.parents}
    assert tracked
    assert tracked == {path.relative_to(target) for path in target.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("tool", "files"),
    [("page", {"index.html", "app.js"}), ("report", {"report.html", "report.js"})],
)
def test_wheel_carries_the_files_of_the_page(tool: str, files: set[str], installed: Path) -> None:
    source, target = (root / "specc/tools" / tool / "static" for root in (ROOT, installed))
    tracked = {path.relative_to(source) for path in tracked_files() if source in path.parents}
    assert set(map(Path, files)) <= tracked
    assert tracked == {path.relative_to(target) for path in target.rglob("*") if path.is_file()}


def test_version_is_the_same_everywhere() -> None:
    from specc import __version__

    assert PROJECT["version"] == __version__


def test_every_decision_has_a_number_of_its_own() -> None:
    decisions = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    assert [path.name[:4] for path in decisions] == [f"{n + 1:04}" for n in range(len(decisions))]
    for path in decisions:
        assert path.read_text(encoding="utf-8").startswith(f"# {path.name[:4]} ")
