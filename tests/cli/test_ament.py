"""`specc build --ament`: a package of ROS 2 with all that it needs, the same on all machines."""

from __future__ import annotations

import os
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch
from xml.etree import ElementTree

import pytest
from specc_runtime.loading import load_system

from specc.cli import main
from specc.output import MARKER
from tests.docs.examples import data
from tests.ros2.conftest import HERE as ROS2
from tests.ros2.launching import launched

ARM = (ROS2 / "arm.yaml").read_text(encoding="utf-8")
SHIFTED = (
    ("agents:\n", "operators:\n  shift: {signature: "
     '"(t: file, q: vector[3, rad]) -> vector[3, rad]", python: "maths.shifting:shift"}\n'
     "files: {table: ../data/table.bin}\nagents:\n"),
    ("move: {y.E.q_d: x.c.q_d", 'move: {y.E.q_d: "shift(table, x.c.q_d)"'),
    ("system: arm", "system: arm_1"),
    ("node: irp", "node: /cell/irp, use_sim_time: true"),
    ("  bind:\n", "  publish: [irp.m.y.c.q_c]\n  bind:\n"),
)  # fmt: skip
BESIDE = {
    "specs/maths/__init__.py": "",
    "specs/maths/shifting.py": "import os\nfrom .tables import read\nimport gone, numpy\n"
    "def shift(t, q):\n    return q + read(t)\n",
    "specs/maths/tables.py": "from units import scale\ndef read(t):\n    return scale\n",
    "specs/maths/other.py": "",
    "specs/units.py": "scale = 0\n",
    "specs/os.py": "",
    "specs/gone.txt": "",
    "data/table.bin": "\x00",
    "pyproject.toml": "",
}
"""What lies in a project, not all of which belongs to the package."""


def project(folder: Path, *pairs: tuple[str, str]) -> Path:
    """The specification of the arm in a project, with pairs of texts replaced."""
    text = ARM
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    for name, content in BESIDE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    path = folder / "specs/arm.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def files(folder: Path) -> dict[str, bytes]:
    every = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in every}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    modules = dict(sys.modules)
    with patch.object(sys, "path", [*sys.path]):
        yield tmp_path
    for name in sys.modules.keys() - modules.keys():
        if name.split(".")[0] in {"maths", "units", "gone"}:
            del sys.modules[name]


def test_a_package_has_all_that_it_needs_and_nothing_of_this_machine(here: Path) -> None:
    for side in ("one", "two/deeper"):
        path = project(here / side, *SHIFTED)
        assert main(["build", str(path), "--ament", f"src/{side}"]) == 0
        assert main(["build", str(path), "--ament", f"src/{side}", "--check"]) == 0
    assert main(["build", str(path), "--out", "out"]) == 0
    found = files(here / "src/one")
    assert found == files(here / "src/two/deeper")
    assert not [name for name, content in found.items() if str(here).encode() in content]
    generated = files(here / "out/arm_1")
    assert found == found | {
        f"arm_1_agents/{name}": text for name, text in generated.items() if name != MARKER
    }
    own = {
        "arm_1_agents/files/data/table.bin",
        "arm_1_agents/files/specs/maths/__init__.py",
        "arm_1_agents/files/specs/maths/shifting.py",
        "arm_1_agents/files/specs/maths/tables.py",
        "arm_1_agents/files/specs/units.py",
    }
    assert {name for name in found if "/files/" in name} == own
    assert {name for name in found if not name.startswith("arm_1_agents/")} == {
        MARKER,
        "launch/arm_1.launch.py",
        "package.xml",
        "resource/arm_1",
        "setup.cfg",
        "setup.py",
    }

    described = ElementTree.fromstring(found["package.xml"])
    assert (described.get("format"), described.findtext("name")) == ("3", "arm_1")
    assert described.findtext("export/build_type") == "ament_python"
    depends = {each.text for each in described.findall("exec_depend")}
    messages = {"geometry_msgs", "rosgraph_msgs", "sensor_msgs", "std_msgs"}
    assert depends == {"launch", "launch_ros", "rclpy", *messages}

    given: dict[str, Any] = {}
    with patch("setuptools.setup", given.update):
        runpy.run_path("src/one/setup.py")
    assert {f"arm_1_agents/{name}" for name in given["package_data"]["arm_1_agents"]} == own
    assert given["entry_points"] == {"console_scripts": ["arm_1 = arm_1_agents.main:main"]}
    named = [file for _, group in given["data_files"] for file in group]
    assert not set(named) - found.keys()


def test_the_agent_is_loaded_from_its_package_alone(here: Path) -> None:
    path = project(here / "project", *SHIFTED)
    path.with_name("gone.py").touch()
    assert main(["build", str(path), "--ament", "arm"]) == 0
    os.rename("project", "elsewhere")
    assert (here / "arm/arm_1_agents/files/specs/gone.py").exists()
    with patch("specc_runtime.main.run", return_value=7) as run:
        assert runpy.run_path("arm/arm_1_agents/main.py")["main"].__doc__
        sys.argv[1:], before = ["--cycles", "2", "--ros-args", "-r", "__ns:=/left"], sys.argv[1:]
        try:
            assert runpy.run_path("arm/arm_1_agents/main.py")["main"]() == 7
        finally:
            sys.argv[1:] = before
    (options,) = run.call_args.args
    assert (options.cycles, options.endless) == (2, True)
    assert options.ros_args == ("-r", "__ns:=/left")
    system = load_system(options.directory, options.base)
    assert (system.name, len(system.subsystems)) == ("arm_1", 3)


def test_a_launch_file_passes_names_on(here: Path) -> None:
    path = project(here / "project", *SHIFTED)
    assert main(["build", str(path), "--ament", "arm"]) == 0
    file, prefix = here / "arm/launch/arm_1.launch.py", Path("/ros")
    program, own = "/ros/lib/arm_1/arm_1", ["--ros-args", "-r", "__node:=irp", "-r"]
    assert launched(file, prefix) == [[program, *own, "__ns:=/cell"]]
    given = {"namespace": "left", "remappings": "a:=/b '/c d:=e'", "options": "--cycles 1"}
    rules = ["--ros-args", "-r", "a:=/b", "-r", "/c d:=e"]
    command = [program, "--cycles", "1", *rules, *own, "__ns:=/left"]
    assert launched(file, prefix, **given) == [command]


def test_live_constants_are_parameters(here: Path) -> None:
    speed = 'v: {is: "0.2[m/s]", range: [0, 1], live: true, title: speed}'
    tries = "n: {is: 3, range: [1, 5], live: true}"
    path = project(here, ("agents:\n", f"constants:\n  {speed}\n  {tries}\nagents:\n"))
    assert main(["build", str(path), "--ament", "arm"]) == 0
    text = (here / "arm/config/arm.yaml").read_text()
    assert data(text) == {"/**": {"ros__parameters": {"v": 0.2, "n": 3}}}
    assert "    # speed, 0.0 to 1.0 m/s\n    v: 0.2\n    # n, 1 to 5\n" in text
    (command,) = launched(here / "arm/launch/arm.launch.py", Path("/ros"), parameters="mine.yaml")
    assert command[-2:] == ["--params-file", "mine.yaml"]
    assert b"share/arm/config" in files(here / "arm")["setup.py"]


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        (("system: arm", "system: Arm"), "`Arm` cannot be the name of a package of ROS 2"),
        (("system: arm", "system: a__b"), "`a__b` cannot be the name of a package of ROS 2"),
        (("system: arm", "system: x_"), "`x_` cannot be the name of a package of ROS 2"),
        ((ARM[ARM.index("plant:") :], ""), "only a plant behind ROS 2 can be a package of ROS 2"),
    ],
    ids=["capital", "two underscores", "underscore at the end", "no plant"],
)
def test_what_cannot_be_a_package_is_refused(
    here: Path, pair: tuple[str, str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = project(here, pair)
    assert main(["build", str(path), "--ament", "arm"]) == 1
    shown = capsys.readouterr().err
    assert f"error[E0095]: {said}" in shown
    assert "specs/arm.yaml:" in shown and "help: " in shown
    assert not (here / "arm").exists()


@pytest.mark.long
def test_files_of_others_stay(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = project(here)
    build = ["build", str(path), "--ament", "arm"]
    assert main([*build, "--check"]) == 1
    assert main(build) == 0
    path.write_text(path.read_text().replace("wait: 5 s", "wait: 6 s"))
    assert main([*build, "--check"]) == 1
    assert "arm/arm_agents/system.py:1:1" in capsys.readouterr().err
    (here / "arm/launch/two.launch.py").write_text("mine")
    before = files(here / "arm")
    assert main(build) == 2
    shown = capsys.readouterr().err
    assert "error[E0091]: specc did not write this file" in shown
    assert "arm/launch/two.launch.py:1:1" in shown
    assert files(here / "arm") == before
    (here / "arm/launch/two.launch.py").unlink()
    assert main(build) == 0
    assert main([*build, "--check"]) == 0

    assert main(["build", str(path), "--out", "."]) == 2
    assert "specc wrote what is here as a package of ROS 2" in capsys.readouterr().err
    assert main(["build", str(path), "--ament", "specs"]) == 2
    assert "specc did not write what is here" in capsys.readouterr().err
    assert main(["build", str(ROS2 / "gripper.yaml"), *build[1:]]) == 2
    assert "name one specification" in capsys.readouterr().err


def test_a_module_does_not_come_from_outside_of_the_project(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = project(here / "project", *SHIFTED)
    (here / "secret.py").touch()
    path.with_name("units.py").unlink()
    path.with_name("units.py").symlink_to(here / "secret.py")
    assert main(["build", str(path), "--ament", "arm"]) == 1
    assert "error[E0021]: a symbolic link leads out of the project" in capsys.readouterr().err
