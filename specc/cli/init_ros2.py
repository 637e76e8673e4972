"""`specc init --ros2`: a specification from the graph of ROS 2, which the runtime looks at."""

from __future__ import annotations

import os
from argparse import Namespace
from importlib import import_module
from pathlib import Path

from specc.cli import streams
from specc.cli.new_files import placing, refuse_taken
from specc.cli.streams import Refused
from specc.pipeline import check_spec
from specc.source import real_path
from specc.tools.importers.writing import PEERS, SpecNames
from specc.tools.starting.document import left_out
from specc.tools.starting.graph import LISTENED, RosGraph, graph_from
from specc.tools.starting.proposal import Devices, proposal

_WAIT_S = 2.0
_MOST_TOPICS = 200


def write(options: Namespace) -> list[Path]:
    """Write a specification for what there is on the graph. Raises Refused, OSError."""
    wish = Path(options.ros2)
    is_file = wish.suffix in (".yaml", ".yml")
    system = SpecNames(PEERS).new(wish.stem if is_file else options.ros2)
    spec = Path(options.directory) / (wish if is_file else f"{system}.yaml")
    agent = options.agent or system
    if (legal := SpecNames(PEERS).new(agent)) != agent:
        raise Refused(f"nothing can be called {agent!r}; {legal} would do")
    refuse_taken({spec: ""})
    wait_s = options.wait or _WAIT_S
    python = _from_anywhere(options.python or "")
    devices = Devices(_graph(python, wait_s))
    for line in left_out({name: why for why, names in devices.left_out.items() for name in names}):
        streams.say(f"specc: left out: {line}")
    if not devices.every:
        raise Refused(_nothing(devices, wait_s))
    text = proposal(devices, system, agent, f"specc init --ros2 {wish.name}", python=python)
    errors = [
        d
        for d in check_spec(str(spec), texts={real_path(str(spec)): text}).diagnostics
        if d.severity == "error"
    ]
    if errors:
        raise Refused(
            "nothing was written: the specification would have errors, "
            f"{errors[0].code}: {errors[0].message}"
        )
    with placing() as new:
        new.put({spec: text})
    return [spec]


def _from_anywhere(python: str) -> str:
    """A program that is named by its place, as runs find it that are started elsewhere."""
    return os.path.abspath(python) if os.sep in python else python


def _graph(python: str, wait_s: float) -> RosGraph:
    looking = import_module("specc_runtime.ros2.looking")
    try:
        return graph_from(looking.graph_of(python or "python3", wait_s, LISTENED, _MOST_TOPICS))
    except looking.ERRORS as error:
        raise Refused(f"{error}; nothing was written") from None


def _nothing(devices: Devices, wait_s: float) -> str:
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    return (
        f"in {wait_s:g} s nothing was seen that goes with a device, of {len(devices.graph.topics)} "
        f"topics on the graph of ROS_DOMAIN_ID={domain}: start the robot, or look longer with "
        "--wait; nothing was written"
    )
