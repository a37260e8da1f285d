"""People as shapes, as costs of trajectories, and as half-planes and cones of velocities."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import (
    ROBOT,
    Circle,
    constraints_of,
    crowds,
    finite,
    person,
    robot_at,
    settled_update,
    some_circles,
)
from shapely.geometry import Point

from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    boxes,
    circles,
    points,
    polygons,
)
from nav_adapter.exporters import half_planes, people_cost
from tracking import PersonTrack


def constraints_of_people(tracks: tuple[PersonTrack, ...]) -> NavConstraints:
    return NavAdapter(AwarenessPolicy(), ROBOT).update(tracks, robot_at(), 0.0)


@given(tracks=crowds(), spacing_m=finite(0.01, 2.0))
def test_all_shapes_agree(tracks: tuple[PersonTrack, ...], spacing_m: float) -> None:
    constraints = constraints_of_people(tracks)
    rows = circles(constraints)
    assert rows.shape == (len(tracks), 5)
    assert boxes(constraints).shape == (len(tracks), 7)
    assert len(polygons(constraints)) == len(tracks)
    perimeter = points(constraints, spacing_m)
    for (x, y, vx, vy, radius), box, polygon, obstacle in zip(
        rows, boxes(constraints), polygons(constraints), constraints.obstacles, strict=True
    ):
        assert [x, y] == obstacle.center_odom_m.tolist()
        assert [vx, vy] == obstacle.velocity_odom_mps.tolist()
        assert radius == obstacle.radius_m

        # The polygon contains the circle and is hardly larger.
        inner = polygon.exterior.distance(Point(x, y))
        outer = shapely.hausdorff_distance(polygon, Point(x, y))
        assert inner == pytest.approx(radius, rel=1e-9)
        assert radius < outer < 1.01 * radius

        np.testing.assert_allclose(box[:6], [x, y, 0.85, 2 * radius, 2 * radius, 1.7])
        speed = math.hypot(vx, vy)
        np.testing.assert_allclose(
            speed * np.array([math.cos(box[6]), math.sin(box[6])]), [vx, vy], atol=1e-12
        )

        count = max(8, math.ceil(2 * math.pi * radius / spacing_m))
        ring, perimeter = perimeter[:count], perimeter[count:]
        np.testing.assert_allclose(np.linalg.norm(ring - [x, y], axis=1), radius)
        gaps = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
        assert gaps.max() <= spacing_m + 1e-12
    assert len(perimeter) == 0


def test_copies_have_the_same_polygon() -> None:
    (obstacle,) = settled_update([person(position=(3.0, 1.0))]).obstacles
    copies = (
        pickle.loads(pickle.dumps(obstacle)),
        copy.copy(obstacle),
        replace(obstacle, track_id=7),
    )
    for each in copies:
        assert each.polygon.equals_exact(obstacle.polygon, 0.0)


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
    circles, samples, steps, first_s, robot_radius_m, seed
):
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


def test_no_people_and_a_person_at_the_robots_position() -> None:
    assert half_planes(constraints_of(), (0, 0), (1, 0), 0.4).shape == (0, 3)
    same = constraints_of((0.0, 0.0, 0.0, 0.0, 0.5))
    rows = half_planes(same, (0, 0), (0, 0), 0.4, resolve_s=0.5)
    assert np.hypot(*rows[0, :2]) == pytest.approx(1.0)
    assert rows[0, 2] == pytest.approx(0.9 / 0.5)
