"""Costs of sampled trajectories, and predicted circles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from circle_scenes import Circle, constraints_of, some_circles
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import finite, rotation

from nav_adapter import NavError
from nav_adapter.exporters import people_cost, predicted_circles


def gaps_m(circle: Circle, positions: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    x, y, vx, vy, radius = circle
    centers = np.stack([x + vx * times_s, y + vy * times_s], axis=1)
    return np.linalg.norm(positions - centers, axis=-1) - radius


@given(
    circles=some_circles(),
    samples=st.integers(0, 5),
    steps=st.integers(0, 6),
    first_s=finite(0, 1),
    robot_radius_m=finite(0, 1),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_cost_is_the_formula_summed_over_people(
    circles: list[Circle],
    samples: int,
    steps: int,
    first_s: float,
    robot_radius_m: float,
    seed: int,
) -> None:
    positions = np.random.default_rng(seed).uniform(-6, 6, (samples, steps, 2))
    times_s = first_s + 0.2 * np.arange(steps)
    expected = np.zeros((samples, steps))
    for circle in circles:
        gap = gaps_m(circle, positions, times_s) - robot_radius_m
        for index, g in np.ndenumerate(gap):
            expected[index] += 3.0 * math.exp(-g / 0.5) if g > 0.0 else 50.0 * (1.0 - g)
    cost = people_cost(
        constraints_of(*circles),
        positions,
        0.2,
        robot_radius_m=robot_radius_m,
        first_s=first_s,
        inside_cost=50.0,
        near_cost=3.0,
        decay_m=0.5,
    )
    np.testing.assert_allclose(cost, expected, atol=1e-9)


@given(circles=some_circles(1, 3), direction_rad=finite(-math.pi, math.pi))
def test_cost_rises_towards_a_person_and_most_inside(
    circles: list[Circle], direction_rad: float
) -> None:
    constraints = constraints_of(circles[0])
    x, y, _, _, radius = circles[0]
    distance_m = np.linspace(0.0, radius + 3.0, 50)
    ray = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    cost = people_cost(constraints, ([x, y] + distance_m[:, None] * ray)[:, None], 0.1)[:, 0]
    assert (np.diff(cost) < 0.0).all()
    assert cost[distance_m < radius - 1e-9].min() >= 1000.0
    assert cost[distance_m > radius + 1e-9].max() < 1.0


def test_people_count_at_their_predicted_positions() -> None:
    constraints = constraints_of((0.0, 5.0, 0.0, -1.0, 0.5))
    waiting = np.zeros((1, 101, 2))
    cost = people_cost(constraints, waiting, 0.1)[0]
    times_s = 0.1 * np.arange(101)
    np.testing.assert_array_equal(cost >= 1000.0, np.abs(times_s - 5.0) < 0.5 + 1e-9)


@given(circles=some_circles(), seed=st.integers(0, 2**32 - 1))
def test_the_cost_depends_neither_on_the_frame_nor_on_the_order(
    circles: list[Circle], seed: int
) -> None:
    positions = np.random.default_rng(seed).uniform(-6, 6, (4, 5, 2))
    R, shift = rotation(-1.1), np.array([2.0, 7.0])
    turned = [(*(R @ c[:2] + shift), *(R @ c[2:4]), c[4]) for c in map(np.array, circles)]
    np.testing.assert_allclose(
        people_cost(constraints_of(*circles), positions, 0.1),
        people_cost(constraints_of(*turned[::-1]), positions @ R.T + shift, 0.1),
        rtol=1e-6,
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"positions_odom_m": np.zeros((3, 2))}, r"positions_odom_m must have shape \(K, T, 2\)"),
        ({"positions_odom_m": np.full((1, 1, 2), math.nan)}, "positions_odom_m must be finite"),
        ({"dt_s": 0.0}, "dt_s must lie in"),
        ({"decay_m": 0.0}, "decay_m must lie in"),
        ({"inside_cost": 1.0}, "inside_cost must lie in"),
        ({"robot_radius_m": -1.0}, "robot_radius_m must lie in"),
    ],
)
def test_invalid_arguments_of_the_cost_are_refused(
    changes: dict[str, object], message: str
) -> None:
    arguments = {"positions_odom_m": np.zeros((1, 1, 2)), "dt_s": 0.1} | changes
    with pytest.raises(NavError, match=message):
        people_cost(constraints_of((2, 0, 0, 0, 0.5)), **arguments)  # type: ignore[arg-type]


@given(circles=some_circles(), growth_mps=finite(0, 1), steps=st.integers(0, 5))
def test_predicted_circles_move_and_grow(
    circles: list[Circle], growth_mps: float, steps: int
) -> None:
    times_s = 0.3 * np.arange(steps)
    rows = predicted_circles(constraints_of(*circles), times_s, growth_mps=growth_mps)
    assert rows.shape == (len(circles), steps, 5)
    for circle, over_time in zip(circles, rows, strict=True):
        x, y, vx, vy, radius = circle
        for t_s, row in zip(times_s, over_time, strict=True):
            np.testing.assert_allclose(
                row, [x + vx * t_s, y + vy * t_s, vx, vy, radius + growth_mps * t_s]
            )


@given(circles=some_circles(0, 6), slots=st.integers(1, 5))
def test_slots_hold_the_nearest_people_and_then_empty_circles(
    circles: list[Circle], slots: int
) -> None:
    times_s = np.array([0.0, 0.5, 1.0])
    robot = np.array([1.0, -2.0])
    constraints = constraints_of(*circles)
    everybody = predicted_circles(constraints, times_s)
    rows = predicted_circles(constraints, times_s, slots=slots, robot_position_odom_m=robot)
    assert rows.shape == (slots, 3, 5)
    here = np.broadcast_to(robot, (3, 2))

    def least_gap_m(row: np.ndarray) -> float:
        return float((np.linalg.norm(row[:, :2] - here, axis=1) - row[:, 4]).min())

    gaps = [least_gap_m(row) for row in rows]
    assert gaps == sorted(gaps)
    nearest = sorted(least_gap_m(row) for row in everybody)[:slots]
    assert gaps[: len(nearest)] == nearest
    for empty in rows[len(nearest) :]:
        assert (empty[:, 4] == 0.0).all()
        assert least_gap_m(empty) > 50.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"times_s": [0.0, -0.1]}, "times_s must not be negative, got -0.1 s"),
        ({"times_s": 0.5}, r"times_s must have shape \(T,\)"),
        ({"growth_mps": -0.1}, "growth_mps must lie in"),
        ({"slots": 0, "robot_position_odom_m": (0, 0)}, "slots must be a whole number"),
        ({"slots": 2}, "slots needs robot_position_odom_m"),
    ],
)
def test_invalid_arguments_of_the_horizon_are_refused(
    changes: dict[str, object], message: str
) -> None:
    arguments = {"times_s": [0.0]} | changes
    with pytest.raises(NavError, match=message):
        predicted_circles(constraints_of((2, 0, 0, 0, 0.5)), **arguments)  # type: ignore[arg-type]
