"""Half-planes and cones in velocity space."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from nav_scenes import Circle, constraints_of, finite, rotation, some_circles

from nav_adapter.exporters import half_planes, velocity_obstacles

ROBOT_RADIUS_M = 0.45
VELOCITIES = st.tuples(finite(-2, 2), finite(-2, 2))


def least_gap_m(circle: Circle, velocity: np.ndarray, horizon_s: float) -> float:
    """Return the smallest gap to a robot that starts at the origin, at constant velocities."""
    x, y, vx, vy, radius = circle
    dvx, dvy = vx - velocity[0], vy - velocity[1]
    square = dvx * dvx + dvy * dvy
    nearest_s = -(x * dvx + y * dvy) / square if square > 0.0 else 0.0
    t_s = min(max(nearest_s, 0.0), horizon_s)
    return math.hypot(x + t_s * dvx, y + t_s * dvy) - radius - ROBOT_RADIUS_M


@given(circles=some_circles(1, 1), velocity=VELOCITIES, tried=VELOCITIES, horizon_s=finite(0.5, 8))
def test_an_allowed_velocity_touches_nobody_within_the_horizon(
    circles: list[Circle],
    velocity: tuple[float, float],
    tried: tuple[float, float],
    horizon_s: float,
) -> None:
    assume(least_gap_m(circles[0], np.zeros(2), 0.0) > 0.01)
    ((nx, ny, bound),) = half_planes(
        constraints_of(*circles), (0, 0), velocity, ROBOT_RADIUS_M, horizon_s=horizon_s
    )
    normal = np.array([nx, ny])
    assert np.hypot(nx, ny) == pytest.approx(1.0)
    # The tried velocity itself if it is allowed, else the nearest allowed one.
    allowed = np.array(tried) + max(bound - normal @ tried, 0.0) * normal
    assert least_gap_m(circles[0], allowed, horizon_s) >= -1e-6


@given(circles=some_circles(1, 1), velocity=VELOCITIES, horizon_s=finite(0.5, 8))
def test_the_half_plane_touches_the_velocity_obstacle(
    circles: list[Circle], velocity: tuple[float, float], horizon_s: float
) -> None:
    """The boundary point nearest to the velocity just touches the person."""
    gap_m = least_gap_m(circles[0], np.array(velocity), horizon_s)
    assume(least_gap_m(circles[0], np.zeros(2), 0.0) > 0.01)
    ((nx, ny, bound),) = half_planes(
        constraints_of(*circles), (0, 0), velocity, ROBOT_RADIUS_M, horizon_s=horizon_s
    )
    excess_mps = nx * velocity[0] + ny * velocity[1] - bound
    assert (excess_mps >= 0.0) == (gap_m >= 0.0) or abs(excess_mps) < 1e-6 or abs(gap_m) < 1e-6
    grazing = np.array(velocity) - excess_mps * np.array([nx, ny])
    assert least_gap_m(circles[0], grazing, horizon_s) == pytest.approx(0.0, abs=1e-6)


@given(
    angle_rad=finite(-math.pi, math.pi),
    depth_m=finite(0.02, 1.0),
    velocity=VELOCITIES,
    walking=VELOCITIES,
    resolve_s=finite(0.1, 2.0),
)
def test_a_robot_inside_an_obstacle_gets_out_in_time(
    angle_rad: float,
    depth_m: float,
    velocity: tuple[float, float],
    walking: tuple[float, float],
    resolve_s: float,
) -> None:
    distance_m = 1.0 + ROBOT_RADIUS_M - depth_m
    circle = (distance_m * math.cos(angle_rad), distance_m * math.sin(angle_rad), *walking, 1.0)
    ((nx, ny, bound),) = half_planes(
        constraints_of(circle), (0, 0), velocity, ROBOT_RADIUS_M, resolve_s=resolve_s
    )
    normal = np.array([nx, ny])
    out = np.array(velocity) + max(bound - normal @ velocity, 0.0) * normal
    apart = np.array(circle[:2]) + resolve_s * (np.array(walking) - out)
    assert np.hypot(*apart) >= 1.0 + ROBOT_RADIUS_M - 1e-6


@given(
    circles=some_circles(0, 4), velocity=VELOCITIES, horizon_s=finite(0.5, 8), share=finite(0.5, 1)
)
def test_half_planes_and_cones_rotate_with_the_world(
    circles: list[Circle], velocity: tuple[float, float], horizon_s: float, share: float
) -> None:
    for circle in circles:
        # At a corner of the velocity obstacle, rounding decides for either side.
        assume(abs(least_gap_m(circle, np.zeros(2), 0.0)) > 0.01)
        assume(abs(circle[0] * velocity[1] - circle[1] * velocity[0]) > 1e-3)
    R, shift = rotation(0.7), np.array([3.0, -8.0])
    turned = [(*(R @ c[:2] + shift), *(R @ c[2:4]), c[4]) for c in map(np.array, circles)]
    before = half_planes(
        constraints_of(*circles), (0, 0), velocity, 0.3, horizon_s=horizon_s, share=share
    )
    after = half_planes(
        constraints_of(*turned), shift, R @ velocity, 0.3, horizon_s=horizon_s, share=share
    )
    changes = [
        rows[:, 2] - rows[:, :2] @ v for rows, v in ((before, velocity), (after, R @ velocity))
    ]
    np.testing.assert_allclose(changes[0], changes[1], atol=1e-6)
    cones = velocity_obstacles(constraints_of(*circles), (0, 0), 0.3).reshape(-1, 3, 2)
    turned_cones = velocity_obstacles(constraints_of(*turned), shift, 0.3).reshape(-1, 3, 2)
    np.testing.assert_allclose(cones @ R.T, turned_cones, atol=1e-9)


@given(circles=some_circles(1, 1), velocity=VELOCITIES)
def test_the_share_scales_the_change_of_velocity(
    circles: list[Circle], velocity: tuple[float, float]
) -> None:
    constraints = constraints_of(*circles)
    whole, half = (
        half_planes(constraints, (0, 0), velocity, ROBOT_RADIUS_M, share=share)[0]
        for share in (1.0, 0.5)
    )
    now = whole[:2] @ velocity
    np.testing.assert_allclose(half[:2], whole[:2])
    assert half[2] - now == pytest.approx(0.5 * (whole[2] - now), abs=1e-9)


def test_half_planes_agree_with_the_authors_library() -> None:
    """RVO2, through its Python binding; its share is always one half."""
    pyrvo = pytest.importorskip("pyrvo", reason="pyrvo comes with the extra dev")
    rng = np.random.default_rng(5)
    for _ in range(100):
        x, y = rng.uniform(-5, 5, 2)
        (vx, vy), velocity = rng.uniform(-2, 2, (2, 2))
        radius = rng.uniform(0.3, 1.5)
        simulator = pyrvo.RVOSimulator()
        simulator.set_time_step(0.5)
        for place, speed, size in (((0, 0), velocity, 0.45), ((x, y), (vx, vy), radius)):
            agent = simulator.add_agent(tuple(place), 50.0, 10, 3.0, 3.0, size, 9.0)
            simulator.set_agent_velocity(agent, tuple(speed))
            simulator.set_agent_pref_velocity(agent, tuple(speed))
        simulator.do_step()
        along, point = np.array(simulator.get_agent_orca_line(0, 0))
        (ours,) = half_planes(
            constraints_of((x, y, vx, vy, radius)),
            (0, 0),
            velocity,
            0.45,
            horizon_s=3.0,
            resolve_s=0.5,
            share=0.5,
        )
        normal = np.array([-along[1], along[0]])
        np.testing.assert_allclose(ours, [*normal, normal @ point], atol=2e-4)


@given(circles=some_circles(1, 1), velocity=VELOCITIES)
def test_a_velocity_between_the_legs_leads_into_the_person(
    circles: list[Circle], velocity: tuple[float, float]
) -> None:
    assume(least_gap_m(circles[0], np.zeros(2), 0.0) > 0.01)
    ((*apex, lx, ly, rx, ry),) = velocity_obstacles(
        constraints_of(*circles), (0, 0), ROBOT_RADIUS_M
    )
    dx, dy = np.array(velocity) - apex
    gap_m = least_gap_m(circles[0], np.array(velocity), 1e9)
    assume(abs(gap_m) > 1e-6 and math.hypot(dx, dy) > 1e-6)
    between = lx * dy - ly * dx <= 0.0 and rx * dy - ry * dx >= 0.0
    assert between == (gap_m < 0.0)


def test_no_people_and_a_person_at_the_robots_position() -> None:
    assert half_planes(constraints_of(), (0, 0), (1, 0), 0.4).shape == (0, 3)
    assert velocity_obstacles(constraints_of(), (0, 0), 0.4).shape == (0, 6)
    same = constraints_of((0.0, 0.0, 0.0, 0.0, 0.5))
    rows = half_planes(same, (0, 0), (0, 0), 0.4, resolve_s=0.5)
    assert np.hypot(*rows[0, :2]) == pytest.approx(1.0)
    assert rows[0, 2] == pytest.approx(0.9 / 0.5)
    assert np.isfinite(velocity_obstacles(same, (0, 0), 0.4)).all()
