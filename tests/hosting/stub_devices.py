"""Devices for the tests of the host: they note what they get, and fail as their `config` says."""

from __future__ import annotations

import json
import sys
import threading
import time
from pathlib import Path
from typing import Any

from specc_runtime.hosting.devices import Array, DeviceError


class Devices:
    """`config` has `log`, a file; how calls `fail`; what `values` are reported; `floods`."""

    def open(self, config: dict[str, Any]) -> None:
        self.fails: dict[str, str] = config.get("fails", {})
        self.log = Path(config["log"])
        self.values: dict[str, Any] = config.get("values", {"a.E.d.q": 1.0})
        self.is_flooding = bool(config.get("floods"))
        print("the driver says hello", file=sys.stderr, flush=True)
        self.note("open", None)
        self.fail("open")

    def poll(self, timeout_s: float) -> Any:
        self.fail("poll")
        if not self.is_flooding:
            time.sleep(0.001)
        return [(name, self.made(value), time.monotonic()) for name, value in self.values.items()]

    def send(self, name: str, value: Any) -> None:
        if value != "safe":
            self.fail(f"send {name}")
        self.note(name, value)
        self.fail(f"sent {name}")

    def close(self) -> None:
        self.note("close", None)
        self.fail("close")

    def note(self, name: str, value: Any) -> None:
        with self.log.open("a") as file:
            file.write(json.dumps([time.monotonic(), name, value]) + "\n")

    def fail(self, where: str) -> None:
        how = self.fails.get(where, "")
        if how == "hang":
            threading.Event().wait()
        elif how == "error":
            raise DeviceError(f"{where} does not work")
        elif how:
            raise RuntimeError(how)

    def made(self, value: Any) -> Any:
        """What stands for a value that no configuration can hold."""
        if value == "array":
            return Array("<u2", (2, 3), bytes(range(12)))
        if value == "misfit":
            return Array("<u2", (5, 5), b"1234")
        if value == "objects":
            return Array("O", (1,), bytes(8))
        if value == "code":
            return threading.Thread
        if value == "lock":
            return threading.Lock()
        if value == "deep":
            return deep()
        return value


def deep() -> list[Any]:
    nested: list[Any] = []
    for _ in range(100_000):
        nested = [nested]
    return nested
