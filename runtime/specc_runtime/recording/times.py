"""Time stamps in messages of Foxglove."""

from typing import Any

from specc_runtime.forms import object_schema

TIME = object_schema({"sec": {"type": "integer"}, "nsec": {"type": "integer"}})


def stamped(time_s: float) -> dict[str, Any]:
    """The time stamp of a message."""
    seconds, rest = divmod(round(time_s * 1e9), 1_000_000_000)
    return {"timestamp": {"sec": seconds, "nsec": rest}}
