"""Which actuators belong together: as the user says, else by names and by the kinematic tree."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from specc.diagnostics.nearest import suggestion
from specc.refusal import Refused
from specc.tools.starting.facts import Actuator, ModelFacts

GroupKind = Literal["arm", "leg", "gripper", "hand", "base", "head", "torso", "joints"]
_WORDS: tuple[tuple[GroupKind, str], ...] = (
    ("base", "wheel|mobile|diff_ring|steer"),
    ("gripper", "grip|finger|jaw|claw"),
    ("hand", "thumb|palm"),
    ("leg", "leg|hip|knee|ankle|foot|calf|thigh|toe"),
    ("head", "head|neck"),
    ("torso", "torso|waist|lift|abdomen"),
    ("arm", "arm|shoulder|elbow|wrist"),
)
_MOST_FINGERS = 4
"""Joints of what is called a gripper; more are a hand."""


class NoGroup(Refused):
    """What `--group` says cannot be; the message says why and what to say."""

    def __init__(self, why: str) -> None:
        super().__init__(f"--group: {why}")


@dataclass(frozen=True, slots=True)
class ActuatorGroup:
    """Actuators of one virtual effector; `why` is the reason of a guess, empty if it is none."""

    kind: GroupKind
    wish: str
    actuators: tuple[Actuator, ...]
    why: str = ""


def grouped(
    facts: ModelFacts,
    wanted: Mapping[str, str],
    taken: Iterable[str] = (),
    *,
    guess: bool = True,
) -> list[ActuatorGroup]:
    """Groups of actuators but those that are `taken`: named ones, then guessed ones.

    `wanted` are the names of groups -> texts of `--group`.

    Raises:
        NoGroup: a group names what there is not, or what another one has.
    """
    left = {a.name: a for a in facts.actuators if a.name not in set(taken)}
    groups = []
    for name, text in wanted.items():
        own = [found for item in _items(text, _known(facts)) for found in _named(item, facts, left)]
        groups.append(ActuatorGroup("joints", name, tuple(dict.fromkeys(own))))
        for actuator in own:
            left.pop(actuator.name, None)
    return groups + (_guessed(facts, list(left.values())) if guess else [])


def _known(facts: ModelFacts) -> set[str]:
    return {a.name for a in facts.actuators} | {j.name for j in facts.joints}


def _items(text: str, known: set[str]) -> Iterator[str]:
    """The parts between commas, but for names that have some themselves."""
    parts, begin = text.split(","), 0
    most = 1 + max((name.count(",") for name in known), default=0)
    while begin < len(parts):
        ends = range(min(len(parts), begin + most), begin, -1)
        wholes = ((",".join(parts[begin:end]).strip(), end) for end in ends)
        item, begin = next((w for w in wholes if w[0] in known), (parts[begin].strip(), begin + 1))
        yield item


def _named(item: str, facts: ModelFacts, left: Mapping[str, Actuator]) -> list[Actuator]:
    """What an item of `--group` names: an actuator or joint, or all `FIRST..LAST` of the model."""
    ends = _ends(item, _known(facts))
    found = _between(*ends, facts) if ends else [facts.actuators[p] for p in _places(item, facts)]
    for actuator in found:
        if actuator.name not in left:
            raise NoGroup(f"{actuator.name} is in another group, or driven already")
    return found


def _ends(item: str, known: set[str]) -> tuple[str, str] | None:
    """The names of `FIRST..LAST`; None for a name, which may have dots itself."""
    if item in known or ".." not in item:
        return None
    dots = (match.start() for match in re.finditer(r"(?=\.\.)", item))
    found = [(item[:dot].strip(), item[dot + 2 :].strip()) for dot in dots]
    return next((ends for ends in found if known.issuperset(ends)), found[0])


def _between(first: str, last: str, facts: ModelFacts) -> list[Actuator]:
    """The actuators of all joints from one to another, or all actuators from one to another."""
    order = list(facts.actuators)
    places = [*_places(first, facts), *_places(last, facts)]
    names = [joint.name for joint in facts.joints]
    if first in names and last in names:
        low, high = sorted((names.index(first), names.index(last)))
        found = [a for a in order if all(low <= joint <= high for joint, _ in a.joints)]
        if not found:
            wider = "; name the actuators themselves, which move other joints, too"
            raise NoGroup(f"no actuator moves only joints from {first} to {last}{wider}")
        return found
    return order[min(places) : max(places) + 1]


def _places(name: str, facts: ModelFacts) -> list[int]:
    joints = {index for index, joint in enumerate(facts.joints) if joint.name == name}
    places = [i for i, a in enumerate(facts.actuators) if a.name == name] or [
        i for i, a in enumerate(facts.actuators) if joints & {joint for joint, _ in a.joints}
    ]
    if not places:
        if name in facts.refused:
            raise NoGroup(f"{name} cannot be held: {facts.refused[name]}")
        if joints:
            raise NoGroup(f"no actuator moves joint {name}")
        known = [a.name for a in facts.actuators] + [j.name for j in facts.joints if j.name]
        close = suggestion(name, known) if len(known) < 60 else ""
        raise NoGroup(f"no actuator, and no joint with one, is called {name}; {close}".rstrip("; "))
    return places


# Guesses. A body with a driven joint hangs from the nearest one above it: these form trees. A tree
# is cut where it branches. Short branches at the end of a chain are fingers.


def _guessed(facts: ModelFacts, actuators: list[Actuator]) -> list[ActuatorGroup]:
    wheels = [a for a in actuators if any(facts.joints[j].wheel for j, _ in a.joints)]
    rest = [a for a in actuators if a not in wheels]
    why = "hinges that turn without end"
    found = [ActuatorGroup("base", "base", tuple(wheels), why)] if wheels else []
    tree = _Tree(facts, _bodies(rest, facts))
    chains = _merged(list(tree.chains()), [_bodies([a], facts) for a in rest])
    for chain in chains:
        if own := tuple(a for a in rest if max(_bodies([a], facts)) in chain):
            found.append(_called(own, chain, facts, tree))
    return _told_apart(_joined(found, facts))


def _bodies(actuators: Iterable[Actuator], facts: ModelFacts) -> set[int]:
    """Those with the joints that some actuators move."""
    return {facts.joints[joint].body for each in actuators for joint, _ in each.joints}


class _Tree:
    """Bodies with driven joints; each hangs from the nearest above it."""

    def __init__(self, facts: ModelFacts, bodies: set[int]) -> None:
        self.parent = {body: _above(body, bodies, facts.parents) for body in bodies}
        self.children: dict[int, list[int]] = {}
        for body in sorted(bodies):
            self.children.setdefault(self.parent[body], []).append(body)

    def chains(self, of: int = 0) -> Iterator[set[int]]:
        """Sets of bodies that belong together."""
        for first in self.children.get(of, ()):
            chain, last = {first}, first
            while len(self.children.get(last, ())) == 1:
                (last,) = self.children[last]
                chain.add(last)
            branches = [self._below(child) for child in self.children.get(last, ())]
            yield chain
            if branches and all(len(branch) <= _MOST_FINGERS + 1 for branch in branches):
                yield set().union(*branches)
            elif branches:
                yield from self.chains(last)

    def _below(self, body: int) -> set[int]:
        return {body}.union(*map(self._below, self.children.get(body, ())))


def _above(body: int, bodies: set[int], parents: Sequence[int]) -> int:
    """The nearest of some bodies above a body; 0, the world, if there is none."""
    above = parents[body]
    while above and above not in bodies:
        above = parents[above]
    return above


def _merged(chains: list[set[int]], coupled: Iterable[set[int]]) -> list[set[int]]:
    """Chains that one actuator moves together are one."""
    for bodies in coupled:
        touched = [chain for chain in chains if chain & bodies]
        if len(touched) > 1:
            whole = set().union(*touched)
            chains = [whole if c is touched[0] else c for c in chains if c not in touched[1:]]
    return chains


def _called(
    own: tuple[Actuator, ...], chain: set[int], facts: ModelFacts, tree: _Tree
) -> ActuatorGroup:
    joints = [facts.joints[j] for j in dict.fromkeys(j for a in own for j, _ in a.joints)]
    text = " ".join(f"{j.name} {j.body_name}" for j in joints).lower()
    counts = {kind: len(re.findall(words, text)) for kind, words in _WORDS}
    named = max(counts, key=lambda kind: counts[kind])
    if counts[named]:
        kind: GroupKind = "hand" if named == "gripper" and len(own) > _MOST_FINGERS else named
        return ActuatorGroup(kind, kind, own, "by the names in the model")
    slides = all(j.kind == "slide" for j in joints)
    tops = [body for body in chain if tree.parent.get(body) not in chain]
    if slides and 2 <= len(joints) <= _MOST_FINGERS and len(tops) > 1:
        return ActuatorGroup("gripper", "gripper", own, "slides beside each other")
    if len(tops) > 1:
        kind = "gripper" if len(joints) <= _MOST_FINGERS else "hand"
        return ActuatorGroup(kind, kind, own, "branches at the end of a chain")
    if len(joints) >= 3 and all(j.kind == "hinge" for j in joints):
        kind = "leg" if _floats(own, facts) else "arm"
        return ActuatorGroup(kind, kind, own, "a chain of hinges")
    return ActuatorGroup("joints", "joints", own, "neighbours in the tree of bodies")


def _floats(own: tuple[Actuator, ...], facts: ModelFacts) -> bool:
    """Whether a free joint carries what the actuators move."""
    body = facts.joints[own[0].joints[0][0]].body
    free = {joint.body for joint in facts.joints if joint.kind == "free"}
    return not free.isdisjoint((body, _above(body, free, facts.parents)))


def _joined(groups: list[ActuatorGroup], facts: ModelFacts) -> list[ActuatorGroup]:
    """Groups of one kind that are not worth several effectors: single joints, parts of a base."""
    kept: list[ActuatorGroup] = []
    for group in groups:
        small = group.kind in ("joints", "base", "gripper", "head", "torso")
        same = next((g for g in kept if g.kind == group.kind), None) if small else None
        one_tree = same is not None and (
            group.kind in ("joints", "base") or _base(same, facts) == _base(group, facts)
        )
        if same is not None and one_tree:
            both = (*same.actuators, *group.actuators)
            kept[kept.index(same)] = replace(same, actuators=both)
        else:
            kept.append(group)
    return kept


def _base(group: ActuatorGroup, facts: ModelFacts) -> int:
    """The body, above all that the group moves, that hangs from the world or another group."""
    return facts.parents[min(_bodies(group.actuators, facts))]


def _told_apart(groups: list[ActuatorGroup]) -> list[ActuatorGroup]:
    """Groups of one kind get what tells their names apart: left_arm and right_arm, leg_1, leg_2."""
    counts = Counter(group.wish for group in groups)
    found = []
    for group in groups:
        wish = group.wish
        if counts[wish] > 1:
            common = [_common(g) for g in groups if g.wish == wish]
            wish = _marked(group, set.intersection(*common), common)
        found.append(replace(group, wish=wish))
    return found


def _marked(group: ActuatorGroup, of_all: set[str], groups: list[set[str]]) -> str:
    """The name of a group with the words of all its names that not all groups have."""
    own = _common(group) - of_all - {group.wish}
    if not own or groups.count(_common(group)) > 1:
        return group.wish
    ordered = [part for part in dict.fromkeys(_parts(group.actuators[0].name)) if part in own]
    words = [part for part in ordered if not part.isdigit()][:2]
    return "_".join((*words, group.wish) if words else (group.wish, *ordered[:1]))


def _common(group: ActuatorGroup) -> set[str]:
    return set.intersection(*(set(_parts(a.name)) for a in group.actuators))


def _parts(name: str) -> list[str]:
    return re.findall(r"[a-z]+|\d+", name.lower())
