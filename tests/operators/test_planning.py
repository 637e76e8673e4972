"""Laws of planning: ways keep their clearance, are as short as they can be, and end where asked."""

from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np
import pytest
from specc_runtime.operators.arrays import Array
from specc_runtime.operators.planning import route, visiting_order, way_round

from tests.seeds import short

CORNERS = tuple(np.array([x, y, 0.0]) for x, y in ((0, 0), (4, 0), (4, 3), (0, 3), (9, 9)))
RING = ((0, 1), (1, 2), (2, 3), (3, 0))
LOW, HIGH = np.array([0.0, 0.0, 0.0]), np.array([6.0, 4.0, 0.0])


def length(way: tuple[Array, ...]) -> float:
    return float(sum(np.linalg.norm(b - a) for a, b in pairwise(way)))


def test_a_route_is_the_shortest_and_begins_and_ends_at_the_nearest_places() -> None:
    way = route(CORNERS, RING, (), 0.3, CORNERS[0] + 0.4, CORNERS[2] + 0.4)
    assert length(way) == 7.0
    assert (way[0] == CORNERS[0]).all() and (way[-1] == CORNERS[2]).all()


def test_a_route_goes_round_what_blocks_a_passage() -> None:
    direct = route(CORNERS, RING, (), 0.3, CORNERS[0], CORNERS[1])
    beside = route(CORNERS, RING, (np.array([2.0, 0.31, 0.0]),), 0.3, CORNERS[0], CORNERS[1])
    blocked = route(CORNERS, RING, (np.array([2.0, 0.29, 0.5]),), 0.3, CORNERS[0], CORNERS[1])
    assert [length(way) for way in (direct, beside, blocked)] == [4.0, 4.0, 10.0]


def test_there_is_no_route_to_a_place_that_is_cut_off() -> None:
    assert route(CORNERS, RING, (), 0.3, CORNERS[0], CORNERS[4]) == ()


def test_a_route_to_where_one_is_has_that_place_alone() -> None:
    assert len(route(CORNERS, RING, (), 0.3, CORNERS[3], CORNERS[3])) == 1


def test_the_nearest_site_is_always_visited_next_and_those_cut_off_come_last() -> None:
    sites = (CORNERS[4], CORNERS[2], CORNERS[3])
    order = visiting_order(CORNERS, RING, (), 0.3, CORNERS[0], sites)
    assert [site.tolist() for site in order] == [CORNERS[n].tolist() for n in (3, 2, 4)]


def test_sites_that_are_cut_off_keep_their_order() -> None:
    places = tuple(np.array([x, y, 0.0]) for x, y in ((0, 0), (50, 50), (90, 90), (50, 51), (1, 0)))
    order = visiting_order(places, ((0, 4), (1, 3)), (), 0.3, places[0], places[1:])
    assert [site.tolist() for site in order] == [places[n].tolist() for n in (4, 1, 2, 3)]


@pytest.mark.parametrize("sites", [(), (CORNERS[1],), (CORNERS[1], CORNERS[1])])
def test_few_sites_are_ordered_too(sites: tuple[Array, ...]) -> None:
    assert visiting_order(CORNERS, RING, (), 0.3, CORNERS[0], sites) == sites


def test_the_order_does_not_depend_on_that_of_the_sites() -> None:
    orders = [
        [site.tolist() for site in visiting_order(CORNERS, RING, (), 0.3, CORNERS[0], given)]
        for given in permutations(CORNERS[1:4])
    ]
    assert all(order == orders[0] for order in orders)


def test_over_open_ground_the_way_is_straight() -> None:
    way = way_round((), 0.3, LOW, HIGH, 0.1, np.array([1.0, 1.0, 0.0]), np.array([5.0, 3.0, 0.0]))
    assert len(way) == 2
    assert length(way) == pytest.approx(np.hypot(4, 2))


@pytest.mark.parametrize("seed", short((*range(10), 47), 0))
def test_a_way_round_keeps_its_clearance_and_is_hardly_longer_than_the_grid_makes_it(
    seed: int,
) -> None:
    random = np.random.default_rng(seed)
    obstacles = tuple(np.array([*random.uniform((1, 0.5), (5, 3.5)), 0.0]) for _ in range(8))
    start, goal = np.array([0.2, 2.0, 0.0]), np.array([5.8, 2.0, 0.0])
    way = way_round(obstacles, 0.4, LOW, HIGH, 0.1, start, goal)
    along = [a + t * (b - a) for a, b in pairwise(way) for t in np.linspace(0, 1, 50)]
    assert min(np.linalg.norm(p - o) for p in along for o in obstacles) >= 0.4 - 1e-9
    assert length(way) >= np.linalg.norm(goal - start) - 0.1
    finer = way_round(obstacles, 0.4, LOW, HIGH, 0.05, start, goal)
    assert length(way) < 1.1 * length(finer) + 0.1


def test_a_wall_across_the_ground_leaves_no_way() -> None:
    wall = tuple(np.array([3.0, y, 0.0]) for y in np.arange(0.0, 4.1, 0.1))
    assert way_round(wall, 0.3, LOW, HIGH, 0.1, LOW, HIGH) == ()
    assert way_round(wall[:-12], 0.3, LOW, HIGH, 0.1, LOW, HIGH) != ()
    assert way_round(wall, 9.0, LOW, HIGH, 0.1, LOW, HIGH) == ()


def test_a_start_too_close_to_an_obstacle_is_left_by_the_nearest_free_cell() -> None:
    start = np.array([2.0, 2.0, 0.0])
    way = way_round((start,), 0.4, LOW, HIGH, 0.1, start, HIGH)
    assert np.linalg.norm(way[0] - start) == pytest.approx(0.4, abs=0.1)
