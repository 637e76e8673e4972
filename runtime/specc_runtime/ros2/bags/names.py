"""TopicNames of topics as ROS resolves them: the namespace, the node and what is remapped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from specc_runtime.options import UsageError


class TopicNames:
    """The whole names of the topics of a node, which is `name` or `/namespace/name`."""

    def __init__(self, node: str, ros_args: Sequence[str] = ()) -> None:
        """`ros_args` are those behind `--ros-args`; raises UsageError for what is no remapping."""
        namespace, _, name = node.rpartition("/")
        rules = list(_rules(ros_args))
        for old, new in rules:
            namespace = new if old == "__ns" else namespace
            name = new if old in ("__node", "__name") else name
        self._namespace = f"/{namespace.strip('/')}".rstrip("/")
        self._node = f"{self._namespace}/{name}"
        self._replaced = {self._whole(old): self._whole(new) for old, new in rules}

    def full(self, topic: str) -> str:
        """The whole name: `/joint_states` of `joint_states`, `/left/irp/state` of `~/state`."""
        whole = self._whole(topic)
        return self._replaced.get(whole, whole)

    def of_element(self, name: str) -> str:
        """Where an element `irp.E.m.q` is that has no topic: `/irp/irp/E/m/q`."""
        return self.full(f"~/{name.replace('.', '/')}")

    def _whole(self, topic: str) -> str:
        if topic.startswith("/"):
            return topic
        if topic.startswith("~"):
            return f"{self._node}/{topic[1:].lstrip('/')}"
        return f"{self._namespace}/{topic}"


def _rules(ros_args: Sequence[str]) -> Iterator[tuple[str, str]]:
    for option, text in pairwise(ros_args):
        if option not in ("-r", "--remap"):
            continue
        old, is_rule, new = text.partition(":=")
        if not (old and is_rule and new):
            raise UsageError(f"--ros-args {option} {text}: this is not OLD:=NEW")
        yield old, new
