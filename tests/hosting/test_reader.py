"""What the device host makes of what devices measure."""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any
from unittest.mock import Mock

import pytest
from specc_runtime.hosting.reader import Reader


@pytest.mark.parametrize(
    "at", [float("nan"), 10**400, "soon", None, [1]], ids=["nan", "huge", "text", "none", "list"]
)
def test_a_time_that_is_none_is_the_fault_of_its_element(at: Any) -> None:
    told: SimpleQueue[tuple[str, str]] = SimpleQueue()
    devices = Mock(poll=lambda _: [("d", 1.0, at)])
    reader = Reader(devices, ["d"], Mock(), lambda name, why: told.put((name, why)))
    name, why = told.get(timeout=10)
    reader.close(10)
    assert name == "d"
    assert "which is no time in s" in why
    assert len(why) < 200
