"""Hand-written subsystems, small enough to see through, for the tests of the runtime."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from specc_runtime.cycle import Executor
from specc_runtime.records import RecordDigest, StepRecord
from specc_runtime.subsystem import Subsystem, Transition
from specc_runtime.system import Connection, Scheduled, System

TICK_S = 0.002


def buffer(*names: str) -> Any:
    """A buffer like the generated ones: slots, none with a value."""
    return type("Buffer", (), {"__slots__": names})()


class Node(Subsystem):
    """Reads `value` of its sources; writes `value` = compute(self), by default its step number.

    `seen` keeps (step, {source: (value or None, fresh)}).
    """

    transitions = (Transition("run", "terminal", "always", "run"),)
    sends: ClassVar = {"run": ("value",)}
    initial_state = "run"
    axioms = ("the step number is not 7",)

    def __init__(
        self,
        name: str,
        ticks: int = 1,
        sources: Sequence[str] = (),
        compute: Callable[[Node], Any] | None = None,
        **kwargs: Any,
    ) -> None:
        self.name = name
        self.ticks = ticks
        self.period_s = ticks * kwargs.get("tick_s", TICK_S)
        self.sources = tuple(sources)
        flags = [f"{kind}{s}" for s in sources for kind in ("", "fresh_", "present_")]
        self.x = buffer(*flags)
        self.y = buffer("value")
        self.memory = buffer("count")
        self.steps = -1
        self.seen: list[tuple[int, dict[str, tuple[Any, bool]]]] = []
        self.compute = compute or (lambda node: node.steps)

    def step(self) -> int:
        self.steps += 1
        self.memory.count = self.steps
        x = self.x
        look = {s: (getattr(x, s, None), getattr(x, f"fresh_{s}")) for s in self.sources}
        assert all(getattr(x, f"present_{s}") == hasattr(x, s) for s in self.sources)
        self.seen.append((self.steps, look))
        self.y.value = self.compute(self)
        first, self.state = not self.state, "run"
        return -1 if first else 0

    def value(self, source: str) -> Any:
        return getattr(self.x, source, None)


def system(*nodes: Node, **kwargs: Any) -> System:
    """The system of these nodes, every source connected."""
    return System(
        "tiny",
        kwargs.pop("tick_s", TICK_S),
        tuple(Scheduled(node, node.ticks) for node in nodes),
        tuple(Connection(s, "value", node.name, s) for node in nodes for s in node.sources),
        tests_all_rows=True,
        **kwargs,
    )


class Run:
    """A finished run: the executor, its records and their digest."""

    def __init__(self, built: System, ticks: int, *, inline: bool = True, plant: Any = None):
        self.records: list[StepRecord] = []
        digest = RecordDigest()
        self.executor = Executor(built, plant, (self.records.append, digest), inline=inline)
        for _ in range(ticks):
            if not self.executor.advance():
                break
        self.executor.finish()
        self.executor.close()
        self.sha256 = digest.hexdigest()

    def of(self, name: str) -> list[StepRecord]:
        return [r for r in self.records if r.subsystem == name]
