"""People painted into a costmap and removed again, against every cell computed with shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import (
    ROBOT,
    SCANNER,
    constraints_of,
    crowds,
    finite,
    person,
    robot_at,
    some_circles,
)
from shapely.geometry import Point

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError, paint_costmap
from nav_adapter.exporters import CostmapPainter
from tracking import PersonTrack


def constraints_for(*tracks: PersonTrack) -> NavConstraints:
    # Without reach the unaware radius is that of the policy, 1 m.
    return NavAdapter(AwarenessPolicy(without=SCANNER), ROBOT).update(tracks, robot_at(), 0.0)


def brute_force(
    costmap: np.ndarray, origin: np.ndarray, resolution: float, constraints: NavConstraints
) -> np.ndarray:
    """Return the costs of every cell and every obstacle, with shapely's distances."""
    out = costmap.copy()
    height, width = costmap.shape
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    centers = np.stack([column + 0.5, row + 0.5], axis=-1) * resolution + origin
    squares = shapely.box(
        *(origin[:, None, None] + np.stack([column, row]) * resolution),
        *(origin[:, None, None] + np.stack([column + 1, row + 1]) * resolution),
    )
    for obstacle in constraints.obstacles:
        middle = Point(obstacle.center_odom_m)
        beyond = shapely.distance(shapely.points(centers), middle) - obstacle.radius_m
        ring = np.floor(252.0 * np.exp(-10.0 * np.maximum(beyond, 0.0))).astype(np.uint8)
        ring[beyond > 0.55] = 0
        out = np.where(out == 255, out, np.maximum(out, ring))
        out[(beyond <= 0.0) | shapely.contains(squares, middle)] = 254
    return out


@settings(max_examples=40)
@given(
    tracks=crowds(),
    origin=st.tuples(finite(-8, 4), finite(-8, 4)),
    resolution=finite(0.04, 0.9),
    height=st.integers(1, 70),
    width=st.integers(1, 70),
    seed=st.integers(0, 2**32 - 1),
)
def test_costs_agree_with_brute_force(tracks, origin, resolution, height, width, seed) -> None:
    rng = np.random.default_rng(seed)
    costmap = rng.choice(np.array([0, 1, 100, 253, 254, 255], dtype=np.uint8), (height, width))
    constraints = constraints_for(*tracks)
    expected = brute_force(costmap, np.asarray(origin), resolution, constraints)
    # On a slice of a larger map: strides and neighbours must not matter.
    frame = np.full((height + 2, 2 * width + 2), 7, dtype=np.uint8)
    view = frame[1:-1, 1:-1:2]
    view[:] = costmap
    assert paint_costmap(view, origin, resolution, constraints) is view
    # Two ways to compute a distance may round to either side of a whole cost.
    assert np.abs(view.astype(int) - expected.astype(int)).max(initial=0) <= 1
    assert np.array_equal(view >= 254, expected >= 254)
    view[:] = 7
    assert (frame == 7).all()


def test_a_coarse_grid_shows_every_person() -> None:
    costmap = np.zeros((4, 4), dtype=np.uint8)
    paint_costmap(costmap, (0.0, 0.0), 5.0, constraints_for(person(position=(12.4, 2.6))))
    costmap_far = np.zeros((4, 4), dtype=np.uint8)
    paint_costmap(costmap_far, (0.0, 0.0), 5.0, constraints_for(person(position=(10.1, 5.1))))
    assert costmap[0, 2] == 254
    assert costmap_far[1, 2] == 254


@pytest.mark.parametrize(
    ("position", "origin"),
    [((1e12, -1e12), (0.0, 0.0)), ((3.0, 0.0), (1e15, 1e15)), ((-2.0, -2.0), (0.0, 0.0))],
)
def test_people_off_the_map_change_nothing(position, origin) -> None:
    costmap = np.full((20, 20), 3, dtype=np.uint8)
    paint_costmap(costmap, origin, 0.05, constraints_for(person(position=position)))
    assert (costmap == 3).all()


def test_a_map_without_cells_and_a_map_without_people() -> None:
    empty = np.zeros((0, 5), dtype=np.uint8)
    assert paint_costmap(empty, (0, 0), 0.1, constraints_for(person())).shape == (0, 5)
    costmap = np.full((5, 5), 9, dtype=np.uint8)
    assert (paint_costmap(costmap, (0, 0), 0.1, constraints_for()) == 9).all()


COSTS = np.array([0, 1, 100, 253, 254, 255], dtype=np.uint8)


@settings(max_examples=30)
@given(
    crowds=st.lists(some_circles(), min_size=1, max_size=4),
    inscribed_radius_m=finite(0, 0.7),
    seed=st.integers(0, 2**32 - 1),
)
def test_only_the_people_of_the_last_update_are_in_the_map(crowds, inscribed_radius_m, seed):
    static = np.random.default_rng(seed).choice(COSTS, (90, 70))
    costmap = static.copy()
    painter = CostmapPainter(costmap, (-4.0, -4.5), 0.1, inscribed_radius_m=inscribed_radius_m)
    for crowd in crowds:
        before = costmap.copy()
        windows = painter.update(constraints_of(*crowd))
        expected = paint_costmap(
            static.copy(),
            (-4.0, -4.5),
            0.1,
            constraints_of(*crowd),
            inscribed_radius_m=inscribed_radius_m,
        )
        assert np.array_equal(costmap, expected)
        outside = np.ones(costmap.shape, dtype=bool)
        for window in windows:
            outside[window] = False
        assert np.array_equal(costmap[outside], before[outside])
    painter.clear()
    assert np.array_equal(costmap, static)
    assert painter.clear() == ()


def test_values_written_by_other_code_stay() -> None:
    costmap = np.zeros((60, 60), dtype=np.uint8)
    painter = CostmapPainter(costmap, (0.0, 0.0), 0.1)
    painter.update(constraints_of((3.0, 3.0, 0.0, 0.0, 1.0)))
    assert costmap[30, 30] == 254
    costmap[28:33, 30] = 77  # another layer writes here, and in a free corner
    costmap[0, 0] = 200
    painter.clear()
    expected = np.zeros_like(costmap)
    expected[28:33, 30], expected[0, 0] = 77, 200
    assert np.array_equal(costmap, expected)


def test_a_rolling_map_must_be_cleared_before_it_moves() -> None:
    costmap = np.zeros((60, 60), dtype=np.uint8)
    painter = CostmapPainter(costmap, (0.0, 0.0), 0.1)
    people = constraints_of((3.0, 3.0, 0.0, 0.0, 0.6))
    painter.update(people)
    with pytest.raises(NavError, match="must be cleared before it moves"):
        painter.move((1.0, 0.0))
    painter.clear()
    painter.move((1.0, 0.0))
    painter.update(people)
    assert np.array_equal(
        painter.costmap, paint_costmap(np.zeros_like(costmap), (1.0, 0.0), 0.1, people)
    )


@given(
    inscribed_m=finite(0.0, 0.6),
    ring_m=finite(0.0, 1.0),
    decay_per_m=st.sampled_from([1.0, 3.0, 10.0]),
)
def test_the_cost_profile_is_that_of_the_inflation_layer(inscribed_m, ring_m, decay_per_m) -> None:
    """nav2_costmap_2d/inflation_layer.hpp, computeCost, with distances from the circle's edge."""
    costmap = np.zeros((1, 300), dtype=np.uint8)
    paint_costmap(
        costmap,
        (0.0, -0.005),
        0.01,
        constraints_of((0.005, 0.0, 0.0, 0.0, 0.8)),
        ring_m=ring_m,
        decay_per_m=decay_per_m,
        inscribed_radius_m=inscribed_m,
    )
    for column, cost in enumerate(costmap[0].tolist()):
        gap_m = 0.01 * column - 0.8
        borders_m = (0.0, inscribed_m, max(ring_m, inscribed_m))
        if min(abs(gap_m - border) for border in borders_m) < 1e-5:
            continue
        if gap_m < 0.0:
            assert cost == 254
        elif gap_m < inscribed_m:
            assert cost == 253
        elif gap_m < ring_m:
            exact = 252.0 * math.exp(-decay_per_m * (gap_m - inscribed_m))
            assert cost in {math.floor(exact - 1e-3), math.floor(exact + 1e-3)}
        else:
            assert cost == 0
