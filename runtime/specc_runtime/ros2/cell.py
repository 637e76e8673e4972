"""A simulation that others in ROS command: a node is behind some elements, it behind the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from specc_runtime.plant import Plant
from specc_runtime.ros2.plant import Listener, Ros2Plant

_NOT_KEPT = ("saved", "restore")


class SimulatedCell:
    """Asks for each element whoever is behind it; time passes in the simulation, then at the node.

    The scene, disturbances and pictures are those of the simulation. Its state is not kept: the
    others in ROS do not go back with it. A last will is for the devices behind the node.
    """

    def __init__(self, simulation: Plant, node: Ros2Plant, of_node: frozenset[str]) -> None:
        """`of_node` has the names of the elements behind the node."""
        self._simulation, self._node, self._of_node = simulation, node, of_node
        self.join, self.changed = node.join, node.changed
        self.clock_of_run, self.waits_for = node.clock_of_run, node.waits_for
        self.step_observers, self.other_commanders = node.step_observers, node.other_commanders
        self.definitions, self.ros_ns = node.definitions, node.ros_ns
        self.inherit, self.leave = node.inherit, node.leave

    def __getattr__(self, name: str) -> Any:
        """What the simulation has besides."""
        if name in _NOT_KEPT or name.startswith("_"):
            raise AttributeError("a cell that others in ROS command goes on as the clock does")
        return getattr(self._simulation, name)

    @property
    def listener(self) -> Listener | None:
        """Who listens at the node."""
        return self._node.listener

    @listener.setter
    def listener(self, listener: Listener) -> None:
        self._node.listener = listener

    def behind(self, name: str) -> Plant:
        """Who is behind an element."""
        return self._node if name in self._of_node else self._simulation

    def reset(self, seed: int) -> None:
        """See `Plant`."""
        self._simulation.reset(seed)

    def sample(self, name: str) -> Any:
        """See `Plant`."""
        return self.behind(name).sample(name)

    def actuate(self, name: str, value: Any) -> None:
        """See `Plant`."""
        self.behind(name).actuate(name, value)

    def advance(self, duration_s: float) -> None:
        """See `Plant`."""
        self._simulation.advance(duration_s)
        self._node.advance(duration_s)

    def bequeath(self, device: str, will: Mapping[str, Sequence[tuple[str, Any]]]) -> None:
        """See `Guarded`."""
        own = {name: choices for name, choices in will.items() if name in self._of_node}
        if own:
            self._node.bequeath(device, own)

    def close(self) -> None:
        """Close both, whatever one of them says."""
        try:
            self._node.close()
        finally:
            self._simulation.close()


def simulated_cell(
    simulation: Plant, node: Callable[[], Ros2Plant], of_node: frozenset[str]
) -> SimulatedCell:
    """The simulation with a node beside it; it is closed where `node` raises."""
    try:
        return SimulatedCell(simulation, node(), of_node)
    except BaseException:
        simulation.close()
        raise
