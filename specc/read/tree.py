"""Data and places side by side while a text is being read: the stack of open collections."""

from dataclasses import dataclass
from typing import Any

from specc.source import Node


@dataclass(slots=True)
class Built:
    """A value and its place; `size` and `height` count nodes and levels, aliases expanded."""

    data: Any
    node: Node
    size: int = 1
    height: int = 0


@dataclass(slots=True)
class _Open:
    """A collection whose end has not been seen; in a mapping, `key` waits for its value."""

    built: Built
    anchor: str | None
    key: str | None = None
    key_node: Node | None = None
    keep: bool = True


class Tree:
    """Collections open one inside the other, and the root once it is finished."""

    def __init__(self) -> None:
        self.root: Built | None = None
        self._stack: list[_Open] = []

    @property
    def depth(self) -> int:
        """Number of open collections."""
        return len(self._stack)

    @property
    def awaits_key(self) -> bool:
        """Whether the next node is a key of a mapping."""
        if not self._stack:
            return False
        top = self._stack[-1]
        return top.key_node is None and isinstance(top.built.data, dict)

    @property
    def key_node(self) -> Node | None:
        """The key that the next node is the value of."""
        return self._stack[-1].key_node if self._stack else None

    @property
    def keys(self) -> int:
        """Number of keys of the innermost mapping, with the one that awaits its value."""
        return len(self._stack[-1].built.node.keys) + 1

    def open(self, data: dict[str, Any] | list[Any], start: int, anchor: str | None) -> None:
        """Start a collection at an offset of the text."""
        self._stack.append(_Open(Built(data, Node(start, start)), anchor))

    def close(self, end: int | None) -> tuple[Built, str | None]:
        """End the innermost collection; without an offset it ends with its last part."""
        done = self._stack.pop()
        node = done.built.node
        if end is not None:
            node.end = end
        elif node.values:
            node.end = max(part.end for part in node.values.values())
        return done.built, done.anchor

    def earlier_key(self, key: str) -> Node | None:
        """The same key earlier in the innermost mapping."""
        return self._stack[-1].built.node.keys.get(key)

    def set_key(self, key: str, node: Node, keep: bool) -> None:
        """Name the next value of the innermost mapping; it is dropped unless `keep`."""
        top = self._stack[-1]
        top.key, top.key_node, top.keep = key, node, keep

    def put(self, value: Built) -> None:
        """Add a finished value to the innermost collection, or make it the root."""
        if not self._stack:
            self.root = value
            return
        top = self._stack[-1]
        built = top.built
        built.size += value.size
        built.height = max(built.height, value.height + 1)
        if isinstance(built.data, list):
            built.node.values[len(built.data)] = value.node
            built.data.append(value.data)
            return
        if top.keep and top.key is not None and top.key_node is not None:
            built.data[top.key] = value.data
            built.node.keys[top.key] = top.key_node
            built.node.values[top.key] = value.node
        top.key = top.key_node = None
