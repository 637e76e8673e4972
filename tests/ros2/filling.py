"""In the Python of a ROS: messages with some fields set, as plain data, one JSON text a line.

Each line of the input has the type of an action or a message, its part, and the fields.
"""

from __future__ import annotations

import json
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

RUNTIME = Path(__file__).parents[2] / "runtime" / "specc_runtime"
spec = spec_from_file_location(
    "specc_runtime", RUNTIME / "__init__.py", submodule_search_locations=[str(RUNTIME)]
)
assert spec is not None and spec.loader is not None
sys.modules["specc_runtime"] = module_from_spec(spec)
spec.loader.exec_module(sys.modules["specc_runtime"])


def main() -> None:
    from specc_runtime.ros2.host.plain import fill, interface, plain

    for line in sys.stdin:
        type_, part, fields = json.loads(line)
        cls = getattr(interface(type_, "action"), part.capitalize()) if part else interface(type_)
        print(json.dumps(plain(fill(cls(), fields))))


main()
