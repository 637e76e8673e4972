"""The node and the topics behind which devices are."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis.plant import BoundElement, bound_elements
from specc.analysis.ros2 import (
    MessageTypeMismatch,
    frames_of,
    named_frames,
    part_of,
    published_value,
    short,
)
from specc.lower.module import buffer_names
from specc.lower.names import Imports, call, given, literal
from specc.model.binding import Published, Ros2
from specc.model.system import System
from specc.model.types import Real

_TF = "tf2_msgs/TFMessage"


def ros2_arguments(system: System, imports: Imports) -> Iterator[str]:
    """Arguments of the node and its topics; none if there is no plant behind ROS 2."""
    if system.plant is None or system.plant.ros2 is None:
        return
    ros2 = system.plant.ros2
    imports.own("Ros2")
    yield literal(ros2.node)
    options = {"wait_s": float(ros2.wait_s), "use_sim_time": ros2.use_sim_time}
    yield from given({"python": ros2.python, **options})
    topics = [_topic(bound, ros2, imports) for bound in bound_elements(system)]
    yield f"topics=({''.join(f'{topic}, ' for topic in topics if topic)})"
    published = [_published(each, system, ros2, imports) for each in system.plant.published]
    if system.plant.published:
        yield f"published=({''.join(f'{each}, ' for each in published if each)})"


def _published(each: Published, system: System, ros2: Ros2, imports: Imports) -> str:
    """The call for what others can watch; empty for a name that stands for nothing."""
    found = published_value(each, system)
    if isinstance(found, MessageTypeMismatch):
        return ""
    subsystem, known = found.subsystem, dict(ros2.frames)
    output = buffer_names(subsystem.outputs)[found.peer, found.element] if found.peer else ""
    frames = [(at, known.get(f, f)) for at, f in frames_of(found.part, found.type) if at and f]
    told = given({"path": found.part.path, "commanded": True, "frames": tuple(frames)})
    first = (found.name, found.topic, found.message, found.part.shape)
    topic = call(imports.own("Ros2Topic"), (*map(literal, first), *told))
    own = literal(subsystem.qualified_name), literal(output)
    return call(imports.own("Ros2Published"), (*own, topic))


def _topic(bound: BoundElement, ros2: Ros2, imports: Imports) -> str:
    """The call that makes a topic; empty for a binding that has none."""
    binding, type_ = bound.binding, bound.element.type
    part = part_of(binding, type_, commanded=bound.is_commanded)
    where = binding.topic or binding.action or ("/tf" if binding.tf else "")
    if not where or isinstance(part, MessageTypeMismatch):
        return ""
    frames = named_frames(part, type_, ros2)
    told = {
        "path": part.path,
        "commanded": bound.is_commanded,
        "joints": binding.joints,
        "frames": () if binding.tf else frames,
        "between": tuple(name for _, name in frames) if binding.tf else (),
        "qos": binding.qos,
        "part": binding.part,
        "is_number": part.shape == "joints" and isinstance(type_, Real),
    }
    first = (
        f"{binding.device}.{binding.element}",
        where,
        short(binding.message) or _TF,
        part.shape,
    )
    return call(imports.own("Ros2Topic"), (*map(literal, first), *given(told)))
