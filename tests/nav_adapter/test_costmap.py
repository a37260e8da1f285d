"""People painted into a costmap, against every cell computed with shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, crowds, finite, person, robot_at
from shapely.geometry import Point

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError, paint_costmap
from tracking import PersonTrack


def constraints_for(*tracks: PersonTrack) -> NavConstraints:
    # Without reach the unaware radius is that of the policy, 1 m.
    return NavAdapter(AwarenessPolicy(reach=None), ROBOT).update(tracks, robot_at(), 0.0)


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


@settings(max_examples=60)
@given(
    tracks=crowds(),
    origin=st.tuples(finite(-8, 4), finite(-8, 4)),
    resolution=finite(0.04, 0.9),
    height=st.integers(1, 70),
    width=st.integers(1, 70),
    seed=st.integers(0, 2**32 - 1),
)
def test_costs_agree_with_brute_force(
    tracks: tuple[PersonTrack, ...],
    origin: tuple[float, float],
    resolution: float,
    height: int,
    width: int,
    seed: int,
) -> None:
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


def test_rows_are_y_and_columns_are_x() -> None:
    costmap = np.zeros((40, 100), dtype=np.uint8)
    # The radius is 1.04 m.
    paint_costmap(
        costmap, (-1.0, -2.0), 0.1, constraints_for(person(position=(6.05, 0.55), sigma_m=0.02))
    )
    rows, columns = np.nonzero(costmap == 254)
    assert (rows.mean(), columns.mean()) == (25.0, 70.0)
    assert costmap[25, 70 + 10] == 254
    assert costmap[25, 70 + 11] == math.floor(252 * math.exp(-10 * 0.06))
    assert costmap[25, 70 + 16] == 0


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
def test_people_off_the_map_change_nothing(
    position: tuple[float, float], origin: tuple[float, float]
) -> None:
    costmap = np.full((20, 20), 3, dtype=np.uint8)
    paint_costmap(costmap, origin, 0.05, constraints_for(person(position=position)))
    assert (costmap == 3).all()


def test_a_map_without_cells_and_a_map_without_people() -> None:
    empty = np.zeros((0, 5), dtype=np.uint8)
    assert paint_costmap(empty, (0, 0), 0.1, constraints_for(person())).shape == (0, 5)
    costmap = np.full((5, 5), 9, dtype=np.uint8)
    assert (paint_costmap(costmap, (0, 0), 0.1, constraints_for()) == 9).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"costmap": np.zeros((5, 5))}, "uint8 array of shape .H, W., got float64"),
        ({"costmap": np.zeros((5, 5, 1), dtype=np.uint8)}, r"got uint8 of shape \(5, 5, 1\)"),
        ({"costmap": [[0]]}, "got list"),
        ({"resolution_m": 0.0}, "resolution_m must lie in"),
        ({"resolution_m": math.nan}, "resolution_m must be finite"),
        ({"origin_odom_m": (0.0, math.inf)}, "origin_odom_m must be finite"),
        ({"origin_odom_m": (0.0, 0.0, 0.0)}, r"origin_odom_m must have shape \(2,\)"),
        ({"ring_m": -0.1}, "ring_m must lie in"),
        ({"decay_per_m": 0.0}, "decay_per_m must lie in"),
    ],
)
def test_invalid_input_is_refused(changes: dict[str, object], message: str) -> None:
    costmap = np.zeros((50, 50), dtype=np.uint8)
    arguments = {"costmap": costmap, "origin_odom_m": (0.0, 0.0), "resolution_m": 0.1}
    constraints = constraints_for(person(position=(2.0, 2.0)))
    with pytest.raises(NavError, match=message):
        paint_costmap(constraints=constraints, **(arguments | changes))
    assert not costmap.any()


def test_a_read_only_costmap_is_refused() -> None:
    costmap = np.zeros((5, 5), dtype=np.uint8)
    costmap.setflags(write=False)
    with pytest.raises(NavError, match="writable"):
        paint_costmap(costmap, (0, 0), 0.1, constraints_for(person()))
