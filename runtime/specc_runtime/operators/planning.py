"""Ways over a map of places and passages, or over open ground, round the obstacles that were met.

Points are in any one frame, (3,), metres, and ways lie in its plane of x and y. A way is a tuple of
points, empty where none leads to the goal. An obstacle is a point that ways keep a clearance from.
On a map, a point stands for the place nearest to it; passages join two places each, both ways, by
their numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations, pairwise

import networkx
import numpy as np

from specc_runtime.operators.arrays import Array

UNREACHED_M = 1e9  # stands for the length of a way that does not exist

Passages = Iterable[tuple[int, int]]
Cell = tuple[int, int]  # column and row in a grid


def route(
    places: Sequence[Array],
    passages: Passages,
    obstacles: Sequence[Array],
    clearance_m: float,
    start: Array,
    goal: Array,
) -> tuple[Array, ...]:
    """The shortest way on a map from start to goal, over passages that keep the clearance."""
    open_map = _open_map(places, passages, obstacles, clearance_m)
    first, last = _nearest(places, start), _nearest(places, goal)
    if not networkx.has_path(open_map, first, last):
        return ()
    return tuple(places[number] for number in networkx.dijkstra_path(open_map, first, last))


def visiting_order(
    places: Sequence[Array],
    passages: Passages,
    obstacles: Sequence[Array],
    clearance_m: float,
    start: Array,
    sites: Sequence[Array],
) -> tuple[Array, ...]:
    """The sites in an order that makes a short tour from start: the nearest one always comes next.

    This is the greedy travelling salesman of networkx over the lengths of routes. Sites that cannot
    be reached come last, in the order given.
    """
    open_map = _open_map(places, passages, obstacles, clearance_m)
    ends = [_nearest(places, point) for point in (start, *sites)]
    gaps = networkx.Graph()
    gaps.add_nodes_from(range(len(ends)))
    for a, b in combinations(gaps, 2):
        ways = networkx.single_source_dijkstra_path_length(open_map, ends[a])
        gaps.add_edge(a, b, weight=ways.get(ends[b], UNREACHED_M))
    order = networkx.approximation.greedy_tsp(gaps, source=0)[1:-1] if sites else []
    reached = [number for number in order if gaps[0][number]["weight"] < UNREACHED_M]
    return tuple(sites[number - 1] for number in (*reached, *sorted({*order} - {*reached})))


def way_round(
    obstacles: Sequence[Array],
    clearance_m: float,
    low: Array,
    high: Array,
    cell_m: float,
    start: Array,
    goal: Array,
) -> tuple[Array, ...]:
    """A short way round obstacles, over a grid of cells of cell_m between the corners low and high.

    It goes from the free cell nearest to start to the one nearest to goal (A*, eight neighbours);
    points between which the straight way is free are left out.
    """
    grid = _free_grid(obstacles, clearance_m, low, high, cell_m)
    if not grid:
        return ()
    centres = {cell: low + cell_m * np.array([*cell, 0.0]) for cell in grid}
    first, last = (min(grid, key=lambda cell: _gap(centres[cell], end)) for end in (start, goal))
    if not networkx.has_path(grid, first, last):
        return ()
    cells = networkx.astar_path(
        grid,
        first,
        last,
        heuristic=lambda a, b: _gap(centres[a], centres[b]),
        weight=lambda a, b, _: _gap(centres[a], centres[b]),
    )
    return _straightened([centres[cell] for cell in cells], obstacles, clearance_m)


def _open_map(
    places: Sequence[Array], passages: Passages, obstacles: Sequence[Array], clearance_m: float
) -> networkx.Graph:
    """The map as a graph whose weights are lengths, m, without what obstacles close."""
    graph = networkx.Graph()
    graph.add_nodes_from(range(len(places)))
    for a, b in passages:
        if _is_clear(places[a], places[b], obstacles, clearance_m):
            graph.add_edge(a, b, weight=_gap(places[a], places[b]))
    return graph


def _free_grid(
    obstacles: Sequence[Array], clearance_m: float, low: Array, high: Array, cell_m: float
) -> networkx.Graph:
    """The cells that keep clearance_m from obstacles, and the steps to neighbours that keep it."""
    columns, rows = (int(n) + 1 for n in np.floor((high - low)[:2] / cell_m + 1e-9))
    grid = networkx.grid_2d_graph(columns, rows)
    for i, j in networkx.grid_2d_graph(columns - 1, rows - 1):
        grid.add_edges_from((((i, j), (i + 1, j + 1)), ((i + 1, j), (i, j + 1))))
    x, y = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    near, beside = (np.zeros((columns, rows), bool) for _ in range(2))
    for obstacle in obstacles:
        gaps = np.hypot(low[0] + cell_m * x - obstacle[0], low[1] + cell_m * y - obstacle[1])
        near |= gaps < clearance_m
        beside |= gaps < clearance_m + cell_m  # from where a step may come closer than it ends
    grid.remove_nodes_from((int(i), int(j)) for i, j in np.argwhere(near))
    at = {cell: low + cell_m * np.array([*cell, 0.0]) for cell in grid if beside[cell]}
    steps = [(a, b) for a, b in grid.edges(at) if a in at and b in at]
    grid.remove_edges_from(
        (a, b) for a, b in steps if not _is_clear(at[a], at[b], obstacles, clearance_m)
    )
    return grid


def _straightened(
    way: list[Array], obstacles: Sequence[Array], clearance_m: float
) -> tuple[Array, ...]:
    """The way without points that the one before need not pass to see the one after."""
    corners = way[:1]
    for here, following in pairwise(way[1:]):
        if not _is_clear(corners[-1], following, obstacles, clearance_m):
            corners.append(here)
    return (*corners, *way[1:][-1:])


def _is_clear(a: Array, b: Array, obstacles: Sequence[Array], clearance_m: float) -> bool:
    """Whether the straight way from a to b keeps clearance_m from all obstacles."""
    if not obstacles:
        return True
    along = (b - a)[:2]
    from_a = np.array(obstacles)[:, :2] - a[:2]
    part = np.clip(from_a @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    gaps = np.linalg.norm(from_a - part[:, None] * along, axis=1)
    return bool(np.all(gaps >= clearance_m))


def _nearest(places: Sequence[Array], point: Array) -> int:
    """The number of the place nearest to a point, the first of several."""
    return min(range(len(places)), key=lambda number: _gap(places[number], point))


def _gap(a: Array, b: Array) -> float:
    """Distance in the plane, m."""
    return float(np.hypot(*(b - a)[:2]))
