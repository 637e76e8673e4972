"""What a transition graph falls into. The only door to networkx, which is imported when asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Component:
    """States that lead to one another, in the order of the file.

    `entered` and `left` say whether edges come from, and go to, other components.
    """

    states: tuple[str, ...]
    entered: bool
    left: bool


def components(states: Sequence[str], edges: Iterable[tuple[str, str]]) -> tuple[Component, ...]:
    """The strongly connected components of a graph, each before those that it leads to.

    Edges from or to other states are left out.
    """
    import networkx

    order = {name: index for index, name in enumerate(states)}
    graph = networkx.DiGraph()
    graph.add_nodes_from(states)
    graph.add_edges_from((a, b) for a, b in edges if a in order and b in order)
    condensed = networkx.condensation(graph)
    return tuple(
        Component(
            tuple(sorted(condensed.nodes[node]["members"], key=order.__getitem__)),
            condensed.in_degree(node) > 0,
            condensed.out_degree(node) > 0,
        )
        for node in networkx.topological_sort(condensed)
    )


def all_lead_to(goal: str, edges: Iterable[tuple[str, str]], states: frozenset[str]) -> bool:
    """Whether `goal` can be reached from each of the states."""
    sources: dict[str, list[str]] = {}
    for source, target in edges:
        sources.setdefault(target, []).append(source)
    found, open_ = {goal}, [goal]
    while open_:
        for source in sources.get(open_.pop(), ()):
            if source not in found:
                found.add(source)
                open_.append(source)
    return states <= found
