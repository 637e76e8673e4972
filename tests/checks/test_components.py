"""The components of graphs, against those that networkx finds."""

from __future__ import annotations

import networkx
from hypothesis import given
from hypothesis import strategies as st

from specc.analysis.graph import components, last_components
from specc.reachable import strong_components

NODES = range(9)
EDGES = st.sets(st.tuples(st.sampled_from(NODES), st.sampled_from(NODES)), max_size=24)


def graph_of(edges: set[tuple[int, int]]) -> networkx.DiGraph:
    graph = networkx.DiGraph(list(edges))
    graph.add_nodes_from(NODES)
    return graph


@given(EDGES)
def test_components_are_those_of_networkx(edges: set[tuple[int, int]]) -> None:
    graph = graph_of(edges)
    found = components([str(node) for node in NODES], ((str(a), str(b)) for a, b in edges))
    parts = [frozenset(map(int, part.states)) for part in found]
    assert set(parts) == set(map(frozenset, networkx.strongly_connected_components(graph)))
    assert sum(map(len, parts)) == len(NODES)
    for index, (part, members) in enumerate(zip(found, parts, strict=True)):
        assert list(part.states) == sorted(part.states)
        assert part.left == any(a in members and b not in members for a, b in edges)
        assert part.entered == any(a not in members and b in members for a, b in edges)
        later = frozenset().union(*parts[index:])
        assert all(b in later for a, b in edges if a in members)
    last = last_components([[b for a, b in sorted(edges) if a == node] for node in NODES])
    assert last == sorted(map(frozenset, networkx.attracting_components(graph)), key=min)


def test_long_ways_are_no_deep_recursion() -> None:
    count = 20_000
    ring = {node: [(node + 1) % count] for node in range(count)}
    assert list(map(len, strong_components(ring))) == [count]
    line = {node: [node + 1] if node + 1 < count else [] for node in reversed(range(count))}
    assert strong_components(line) == [[node] for node in range(count)]
