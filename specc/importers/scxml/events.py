"""Events of a chart as members of one enum: the interpreter takes one at a time from its queue."""

from __future__ import annotations

from collections.abc import Iterable

from specc.importers.names import Names

_ANY = "*"
_DEEPEST = 16
"""Parts of an event that another one may name a beginning of."""


class Events:
    """The events that a chart names; each stands for those that no longer name covers."""

    def __init__(self, descriptors: Iterable[str]) -> None:
        names = Names()
        plain = dict.fromkeys(_plain(d) for d in descriptors)
        self._any = _ANY in plain
        self._members = {event: names.of(event) for event in plain if event != _ANY}
        self._other = names.new("any_other") if self._any else ""
        self._covered: dict[str, set[str]] = {}
        for event, name in self._members.items():
            parts = event.split(".")[:_DEEPEST]
            for count in range(1, len(parts) + 1):
                self._covered.setdefault(".".join(parts[:count]), set()).add(name)
            self._covered.setdefault(event, set()).add(name)

    @property
    def members(self) -> tuple[str, ...]:
        """The members of the enum, in the order of the document."""
        return (*self._members.values(), *((self._other,) if self._any else ()))

    @property
    def changed(self) -> dict[str, str]:
        """Events whose name could not be kept."""
        return {event: name for event, name in self._members.items() if event != name}

    def matching(self, descriptors: Iterable[str]) -> frozenset[str]:
        """Members that a transition reacts to: `a` also matches `a.b` (3.12.1 of SCXML)."""
        found: set[str] = set()
        for descriptor in map(_plain, descriptors):
            if descriptor == _ANY:
                return frozenset(self.members)
            found |= self._covered.get(descriptor, set())
        return frozenset(found)

    def let(self, members: frozenset[str]) -> tuple[str, str]:
        """Name and expression of the test that one of some events came."""
        if members == frozenset(self.members):
            return "on_any_event", "fresh(x.outside.event)"
        ordered = [name for name in self.members if name in members]
        test = f"fresh(x.outside.event) and x.outside.event in {{{', '.join(ordered)}}}"
        return f"on_{'_or_'.join(ordered)}", test


def _plain(descriptor: str) -> str:
    return descriptor.removesuffix(".*").rstrip(".") or _ANY
