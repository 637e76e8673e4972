"""Every third-party package comes in through its own door and nowhere else."""

import sys
from functools import cache

from tests.house.tree import Module, modules

COMPILER = modules(".", "specc")
RUNTIME = modules("runtime", "specc_runtime")

# Package -> the modules, with what is inside them, that may import it.
DOORS = {
    "OpenGL": {"specc_runtime.plants.mujoco.gl"},
    "_ruamel_yaml": {"specc.read"},
    "argcomplete": {"specc.cli.arguments"},
    "cv2": {
        "specc_runtime.operators.vision.opencv",
        "specc_runtime.recording.pictures",
        "specc_runtime.video",
    },
    "distributed": {"specc.tools.sweep.cluster"},
    "fontTools": {"specc.tools.doc.web"},
    "jinja2": {"specc.emit"},
    "lsprotocol": {"specc.tools.lsp"},
    "lz4": {"specc_runtime.recording.unpacking"},
    "matplotlib": {"specc.tools.canvas"},
    "mcap": {
        "specc_runtime.recording.container",
        "specc_runtime.recording.reading",
        "specc_runtime.recording.unpacking",
    },
    "mujoco": {"specc_runtime.operators.arms", "specc_runtime.plants.mujoco"},
    "networkx": {"specc.analysis.graph", "specc_runtime.operators.planning"},
    "numpy": {"specc_runtime"},
    "orjson": {"specc_runtime.recording.text"},
    "pinocchio": {"specc_runtime.operators.dynamics"},
    "pydantic": {"specc.schema"},
    "pygls": {
        "specc.tools.lsp.server",
        "specc.tools.lsp.session",
    },
    "pygraphviz": {"specc.tools.graph.drawing"},
    "rcl_interfaces": {"specc_runtime.ros2.host"},
    "rclpy": {"specc_runtime.ros2.host"},
    "rich": {"specc_runtime.progress"},
    "rosbags": {"specc_runtime.ros2.bags"},
    "ruamel": {"specc.read"},
    "ruckig": {"specc_runtime.operators.trajectories"},
    "tf2_ros": {"specc_runtime.ros2.host"},
    "typst": {"specc.tools.doc.typesetting"},
    "websockets": {"specc.tools.page.clients", "specc.tools.page.server"},
    "zstandard": {"specc_runtime.recording.container", "specc_runtime.recording.unpacking"},
    "z3": {"specc.proof.solver"},
}


def passes(module: Module, package: str) -> bool:
    """Whether `module` is a door of `package` or lies behind one."""
    return any(
        module.name == door or module.name.startswith(f"{door}.")
        for door in DOORS.get(package, set())
    )


@cache
def imported() -> dict[Module, set[str]]:
    """Module -> packages that it imports."""
    return {
        module: {name.split(".")[0] for name in module.imports()}
        for module in (*COMPILER, *RUNTIME)
    }


def test_third_party_packages_come_in_through_their_doors() -> None:
    ours = {*sys.stdlib_module_names, "specc", "specc_runtime"}
    around = {
        (module.name, package)
        for module, packages in imported().items()
        for package in packages - ours
        if not passes(module, package)
    }
    assert around == set()


def test_doors_are_used() -> None:
    for package, doors in DOORS.items():
        for door in doors:
            assert any(
                package in packages
                for module, packages in imported().items()
                if module.name == door or module.name.startswith(f"{door}.")
            ), door
