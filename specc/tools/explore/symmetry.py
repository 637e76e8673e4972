"""Symmetry reduction: agents that are copies of one another are explored in one order.

Two agents are copies if exchanging them leaves the abstraction unchanged. Their machines must be
equal, and every other machine must be equal to itself with the two names exchanged. Elements
outside the abstraction may differ, such as the speed of a rover on which no condition depends. The
agent whose cycles the task counts is no copy of others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from specc.proof import InputName
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.cone import Cone, Renaming

CopyLinks = tuple[tuple[InputName, ...], ...]
"""For each copy the elements between a machine and the copy, in one order."""
Permutation = tuple[int, ...]
"""The index of the machine that each machine stands for."""


@dataclass(frozen=True)
class Copies:
    """Copies of an agent, by the indices of their machines, and how the other machines see them."""

    machines: tuple[tuple[int, ...], ...]
    inputs: Mapping[int, CopyLinks]
    outputs: Mapping[int, CopyLinks]

    @cached_property
    def copy_of(self) -> dict[int, int]:
        """The number of the copy that each machine belongs to."""
        return {i: number for number, copy in enumerate(self.machines) for i in copy}

    @cached_property
    def outside_machines(self) -> tuple[int, ...]:
        """The machines outside that receive elements of copies, or send elements to them."""
        return tuple(sorted(self.inputs.keys() | self.outputs.keys()))

    def exchanges(self, machines: Sequence[object]) -> Iterator[Permutation]:
        """The exchanges of the first copy and each other one, as permutations of all machines."""
        first, *others = self.machines
        for other in others:
            turn = list(range(len(machines)))
            for one, two in zip(first, other, strict=True):
                turn[one], turn[two] = two, one
            yield tuple(turn)

    def renamed(self, links: CopyLinks, order: Sequence[int]) -> dict[InputName, InputName]:
        """The names with copy `order[n]` in place `n`."""
        pairs = (zip(links[q], links[p], strict=True) for p, q in enumerate(order))
        return {old: new for pair in pairs for old, new in pair}

    def real_name(
        self, frame: Permutation, index: int, key: InputName, *, is_sent: bool
    ) -> InputName:
        """The real name of an element of a copy, where `frame` maps machines to real ones."""
        links = (self.outputs if is_sent else self.inputs).get(index, ())
        for number, names in enumerate(links):
            if key in names:
                stands_for = self.copy_of[frame[self.machines[number][0]]]
                return links[stands_for][names.index(key)]
        return key


MAX_COMPARED = 100_000
"""The most parts of expressions that are compared to find copies; the rest counts as no copy."""


def copies_in(names: tuple[str, ...], abstraction: Abstraction) -> list[Copies]:
    """The copies among the machines of a slice, which are the same at any precision."""
    if names not in abstraction.copies_by_slice:
        abstraction.copies_by_slice[names] = Symmetry(names, abstraction).copies()
    return abstraction.copies_by_slice[names]


class Symmetry:
    """Finds the copies among the machines of a slice."""

    def __init__(self, names: Sequence[str], abstraction: Abstraction) -> None:
        self._abstraction = abstraction
        self._budget = MAX_COMPARED
        self._index = {name: index for index, name in enumerate(names)}
        self._agents: dict[str, dict[str, str]] = {}
        for name, machine in abstraction.machines.items():
            self._agents.setdefault(machine.subsystem.agent, {})[machine.subsystem.name] = name
        self._agent = {
            name: machine.subsystem.agent for name, machine in abstraction.machines.items()
        }
        self._readers = {
            sent: (name, key)
            for name, machine in abstraction.machines.items()
            for key in machine.subsystem.inputs
            if (sent := abstraction.sender_of(name, key)) is not None
        }
        self._neighbours: dict[str, set[str]] = {}
        for (sender, _), (reader, _) in self._readers.items():
            self._neighbours.setdefault(self._agent[sender], set()).add(reader)
            self._neighbours.setdefault(self._agent[reader], set()).add(sender)

    def copies(self) -> list[Copies]:
        """All copies, by kind of agent."""
        alike: dict[tuple[object, ...], list[str]] = {}
        task = self._abstraction.facts.system.task
        cycle_of = task.subsystem if task else ""
        for agent in dict.fromkeys(self._agent[name] for name in self._index):
            roles = {r: n for r, n in self._agents[agent].items() if n in self._index}
            kind = tuple(
                (role, self._cone(roles[role]), roles[role] == cycle_of) for role in sorted(roles)
            )
            alike.setdefault(kind, []).append(agent)
        found = []
        for agents in alike.values():
            first, *others = agents
            same = [first, *(a for a in others if self._are_exchangeable(first, a, agents))]
            if len(same) > 1:
                found.append(self._copies_of(same))
        return found

    def _copies_of(self, agents: Sequence[str]) -> Copies:
        roles = sorted(r for r, name in self._agents[agents[0]].items() if name in self._index)
        machines = tuple(tuple(self._index[self._agents[a][r]] for r in roles) for a in agents)
        inputs, outputs = dict[int, CopyLinks](), dict[int, CopyLinks]()
        for name, index in self._index.items():
            if self._agent[name] in agents:
                continue
            renamings = [self._renamings(name, agents[0], other) for other in agents[1:]]
            assert None not in renamings  # they are exchangeable
            if any(names and any(names) for names in renamings):
                for side, links in enumerate((inputs, outputs)):
                    maps = [both[side] for both in renamings if both]
                    own = [key for key in maps[0] if self._is_linked_to(name, key, agents[0], side)]
                    links[index] = (tuple(own), *(tuple(map(g.__getitem__, own)) for g in maps))
        return Copies(machines, inputs, outputs)

    def _is_linked_to(self, name: str, key: InputName, agent: str, side: int) -> bool:
        end = self._readers.get((name, key)) if side else self._abstraction.sender_of(name, key)
        return end is not None and self._agent[end[0]] == agent

    def _are_exchangeable(self, one: str, other: str, agents: Sequence[str]) -> bool:
        """Whether exchanging two agents with corresponding machines changes nothing."""
        for role, name in self._agents[one].items():
            like = self._agents[other].get(role)
            if like is None or not self._have_equal_links(name, like, one, other):
                return False
        near = self._neighbours.get(one, set()) | self._neighbours.get(other, set())
        for name in self._index:  # in this order, since the budget goes to the first ones
            if name not in near or self._agent[name] in (one, other):
                continue
            names = self._renamings(name, one, other)
            if names is None or (self._agent[name] in agents and any(names)):
                return False
            if any(names) and not self._is_same_machine(self._cone(name), *names):
                return False
        return True

    def _is_same_machine(self, cone: Cone, *names: Renaming) -> bool:
        """Whether a machine is the same with other names, as far as parts are left to compare."""
        self._budget -= cone.size
        return self._budget >= 0 and cone.normal_form == cone.renamed(*names)

    def _have_equal_links(self, name: str, like: str, one: str, other: str) -> bool:
        """Whether machine `name` of agent `one` receives from the counterparts of the senders of
        machine `like` of agent `other`.
        """
        for key in self._abstraction.machines[name].subsystem.inputs:
            sent = self._abstraction.sender_of(name, key)
            alike = self._abstraction.sender_of(like, key)
            if sent is None or alike is None:
                if sent is not alike:
                    return False
            elif self._agent[sent[0]] == one:
                if alike != (self._counterpart(sent[0], one, other), sent[1]):
                    return False
            elif self._agent[sent[0]] == other or alike[0] != sent[0]:
                return False
        return True

    def _counterpart(self, name: str, one: str, other: str) -> str:
        """The name of the corresponding machine, for a machine of one of two agents."""
        agent = self._agent[name]
        if agent not in (one, other):
            return name
        return self._agents[other if agent == one else one][
            self._abstraction.machines[name].subsystem.name
        ]

    def _renamings(self, name: str, one: str, other: str) -> tuple[Renaming, Renaming] | None:
        """The names of inputs and outputs after two agents are exchanged; None if none changes.

        Elements that have nothing to do with the two agents are left out.
        """
        abstraction, subsystem = self._abstraction, self._abstraction.machines[name].subsystem
        senders = {abstraction.sender_of(name, key): key for key in subsystem.inputs}
        inputs, outputs = dict[InputName, InputName](), dict[InputName, InputName]()
        for sent, key in senders.items():
            if sent is not None and self._agent[sent[0]] in (one, other):
                like = senders.get((self._counterpart(sent[0], one, other), sent[1]))
                if like is None:
                    return None
                inputs[key] = like
        for key in subsystem.outputs:
            read = self._readers.get((name, key))
            if read is not None and self._agent[read[0]] in (one, other):
                sender = abstraction.sender_of(self._counterpart(read[0], one, other), read[1])
                if sender is None or sender[0] != name:
                    return None
                outputs[key] = sender[1]
        return inputs, outputs

    def _cone(self, name: str) -> Cone:
        return self._abstraction.cone(name)


def group_equal_slices(
    slices: Sequence[tuple[str, ...]], abstraction: Abstraction
) -> list[tuple[tuple[str, ...], list[dict[str, str]]]]:
    """Slices, each with equal slices that it stands for, as renamings of its machines."""
    names = tuple(abstraction.machines)
    every = Symmetry(names, abstraction).copies() if len(slices) > 1 else []
    found: dict[object, list[tuple[tuple[str, ...], list[str]]]] = {}
    for each in slices:
        roles, order = list[object](), list[str]()
        for copies in every:
            parts = [
                (tuple(role for role, _ in used), [names[i] for _, i in used])
                for copy in copies.machines
                if (used := [(role, i) for role, i in enumerate(copy) if names[i] in each])
            ]
            parts.sort(key=lambda part: part[0])
            roles.append(tuple(part[0] for part in parts))
            order += [name for part in parts for name in part[1]]
        others = tuple(name for name in each if name not in order)
        found.setdefault((tuple(roles), others), []).append((each, [*order, *others]))
    return [
        (first, [dict(zip(order, other, strict=True)) for _, other in more])
        for (first, order), *more in found.values()
    ]


def composed(frame: Permutation, permutation: Permutation) -> Permutation:
    """A frame (machine -> real machine) after copies were put in order by `permutation`."""
    return tuple(frame[was] for was in permutation) if permutation else frame
