"""TopicNames of topics as ROS resolves them: the namespace, the node and what is remapped."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence

from specc_runtime.options import UsageError

_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_TOPIC = rf"(?:~/|/)?{_NAME}(?:/{_NAME})*"
_RULE = re.compile(
    rf"(?:(?P<node>{_NAME}):)?(?P<kind>ros(?:topic|service)://)?(?P<old>{_TOPIC}):="
    rf"(?P<new>{_TOPIC}|/)"
)
_VALUED = (
    *("-p", "--param", "--params-file", "-e", "--enclave"),
    *("--log-level", "--log-config-file", "--log-file-name"),
)


class TopicNames:
    """The whole names of the topics of a node, which is `name` or `/namespace/name`."""

    def __init__(self, node: str, ros_args: Sequence[str] = ()) -> None:
        """`ros_args` are those behind `--ros-args`; raises UsageError for what is no remapping."""
        namespace, _, name = node.rpartition("/")
        rules = list(_rules(ros_args))
        # The first rule wins. One for a node is for that of the name that it has by then.
        name = _first(rules, ("__node", "__name"), name) or name
        namespace = _first(rules, ("__ns",), name) or namespace
        self._namespace = f"/{namespace.strip('/')}".rstrip("/")
        self._node = f"{self._namespace}/{name}"
        self._replaced: dict[str, str] = {}
        for node, old, new in rules:
            if node in ("", name):
                self._replaced.setdefault(self._whole(old), self._whole(new))

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


def _first(rules: Iterable[tuple[str, str, str]], what: Collection[str], name: str) -> str:
    """What the first rule for a node of that name gives; empty if there is none."""
    found = (new for node, old, new in rules if old in what and node in ("", name))
    return next(found, "")


def _rules(ros_args: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """The node that a rule is for, or an empty text for all; what it replaces, and by what."""
    parts = iter(ros_args)
    for option in parts:
        if option in _VALUED:
            next(parts, "")
        elif option in ("-r", "--remap"):
            text = next(parts, "")
            found = _RULE.fullmatch(text)
            if found is None or (found["old"] == "__ns" and not found["new"].startswith("/")):
                raise UsageError(f"--ros-args {option} {text}: this is not OLD:=NEW")
            if found["kind"] != "rosservice://":
                yield found["node"] or "", found["old"], found["new"]
        elif not option.startswith("--"):
            raise UsageError(f"--ros-args {option}: this is no option, such as -r OLD:=NEW")
