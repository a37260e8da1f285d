"""People painted into a persistent costmap and removed again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from circle_scenes import Circle, constraints_of, some_circles
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import finite

from nav_adapter import NavError, paint_costmap
from nav_adapter.exporters import CostmapPainter

COSTS = np.array([0, 1, 100, 253, 254, 255], dtype=np.uint8)


@settings(max_examples=60)
@given(
    crowds=st.lists(some_circles(), min_size=1, max_size=4),
    inscribed_radius_m=finite(0, 0.7),
    seed=st.integers(0, 2**32 - 1),
)
def test_only_the_people_of_the_last_update_are_in_the_map(
    crowds: list[list[Circle]], inscribed_radius_m: float, seed: int
) -> None:
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
def test_the_cost_profile_is_that_of_the_inflation_layer(
    inscribed_m: float, ring_m: float, decay_per_m: float
) -> None:
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


@settings(max_examples=30)
@given(circles=some_circles(2, 6, reach_m=40.0))
def test_a_shared_window_has_the_same_costs(circles: list[Circle]) -> None:
    """People far apart are painted one by one, people close by together."""
    together = np.zeros((400, 400), dtype=np.uint8)
    paint_costmap(together, (-40.0, -40.0), 0.2, constraints_of(*circles))
    one_by_one = np.zeros_like(together)
    for circle in circles:
        paint_costmap(one_by_one, (-40.0, -40.0), 0.2, constraints_of(circle))
    # Coordinates relative to another corner round differently.
    assert np.abs(together.astype(int) - one_by_one).max() <= 1
    assert np.array_equal(together == 254, one_by_one == 254)


@pytest.mark.parametrize("decay_per_m", [1e-300, 1e-9, 1e9, 1e300])
def test_extreme_decays_work(decay_per_m: float) -> None:
    costmap = np.zeros((60, 60), dtype=np.uint8)
    paint_costmap(
        costmap, (0, 0), 0.1, constraints_of((3.0, 3.0, 0, 0, 1.0)), decay_per_m=decay_per_m
    )
    assert costmap[30, 30] == 254
    assert costmap[0, 0] == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"costmap": np.zeros((5, 5))}, "uint8 array of shape"),
        ({"inscribed_radius_m": -0.1}, "inscribed_radius_m must lie in"),
        ({"resolution_m": 0.0}, "resolution_m must lie in"),
    ],
)
def test_a_painter_with_invalid_arguments_is_refused(
    changes: dict[str, object], message: str
) -> None:
    arguments = {
        "costmap": np.zeros((5, 5), dtype=np.uint8),
        "origin_odom_m": (0, 0),
        "resolution_m": 0.1,
    } | changes
    with pytest.raises(NavError, match=message):
        CostmapPainter(**arguments)  # type: ignore[arg-type]
