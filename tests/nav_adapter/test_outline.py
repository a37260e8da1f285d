"""Polygons longer than their circles: elongated ahead, or swept over the predicted motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from nav_scenes import ROBOT, finite, person, robot_at
from shapely.geometry import LineString, Point, Polygon

from nav_adapter import AwarenessPolicy, NavAdapter
from nav_adapter.policies import ObstacleOutline
from tracking import PersonTrack


def polygon(outline: ObstacleOutline, track: PersonTrack) -> Polygon:
    policy = AwarenessPolicy(outline=outline)
    (obstacle,) = NavAdapter(policy, ROBOT).update((track,), robot_at(), 0.0).obstacles
    assert obstacle.polygon.contains(Point(obstacle.center_odom_m).buffer(obstacle.radius_m - 1e-6))
    return obstacle.polygon


def reach_m(shape: Polygon, direction: np.ndarray, track: PersonTrack) -> float:
    corners = np.asarray(shape.exterior.coords) - track.position_odom_m
    return float((corners @ direction).max())


@given(angle=finite(-math.pi, math.pi), speed=finite(0.2, 2.0), ahead_s=finite(0.0, 1.5))
def test_elongation_is_a_capsule_along_the_motion(
    angle: float, speed: float, ahead_s: float
) -> None:
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    walker = person(velocity=speed * along)
    outline = ObstacleOutline(unaware_ahead_s=ahead_s, longest_ahead_m=1.2)
    shape = polygon(outline, walker)
    length = min(speed * ahead_s, 1.2)
    capsule = LineString([walker.position_odom_m, walker.position_odom_m + length * along])
    assert shape.buffer(1e-9).contains(capsule.buffer(1.0, quad_segs=32))
    # The 24 sides of the discs reach a little farther.
    assert capsule.buffer(1.02).contains(shape)
    assert reach_m(shape, across, walker) == pytest.approx(1.0, rel=0.02)


def test_a_standing_person_has_no_elongation_and_an_aware_one_a_shorter_one() -> None:
    outline = ObstacleOutline(unaware_ahead_s=1.0, aware_ahead_s=0.2)
    standing, circle = polygon(outline, person()), polygon(ObstacleOutline(), person())
    assert shapely.hausdorff_distance(standing, circle) < 1e-12
    assert [outline.ahead_s(alpha) for alpha in (0.0, 0.1, 0.6, 1.0)] == [1.0, 1.0, 0.2, 0.2]


def test_elongation_shrinks_at_the_bounded_rate_and_keeps_its_direction() -> None:
    """A walker stops at once: the polygon keeps its direction and shrinks step by step."""
    policy = AwarenessPolicy(outline=ObstacleOutline(unaware_ahead_s=1.0))
    adapter, before = NavAdapter(policy, ROBOT), None
    for step in range(60):
        now = 0.05 * step
        velocity = (0.0, 1.0) if step < 20 else (0.0, 0.0)
        track = person(now, velocity=velocity)
        (obstacle,) = adapter.update((track,), robot_at(now), now).obstacles
        reach = reach_m(obstacle.polygon, np.array([0.0, 1.0]), track)
        if before is not None:
            assert before - reach <= policy.timing.shrink_rate_mps * 0.05 + 1e-9
        before = reach
        if step == 19:
            assert reach == pytest.approx(2.0, abs=0.02)
    assert before == pytest.approx(1.0, abs=0.25)


@given(sigma=finite(0.0, 0.3), horizon=finite(0.3, 2.0), speed=finite(0.0, 1.5))
def test_the_sweep_covers_the_predicted_motion_and_its_uncertainty(
    sigma: float, horizon: float, speed: float
) -> None:
    """The NEES one second ahead is 3.5 instead of 2, so the covariance is multiplied by 1.75."""
    track = person(velocity=(0.0, speed), sigma_m=sigma)
    outline = ObstacleOutline(sweep_s=horizon)
    shape = polygon(outline, track)
    for share in (0.25, 0.5, 1.0):
        t = share * horizon
        predicted_m = math.sqrt((sigma**2 + 0.05 * t**3 / 3.0) * (1.0 + 0.75 * t))
        disc = Point(3.0, speed * t).buffer(1.0 + 2.0 * sigma + 2.0 * (predicted_m - sigma))
        # The hull is straight between its steps, the exact outline larger by millimetres.
        assert shape.buffer(0.01).contains(disc)
    exact = reach_m(shape, np.array([0.0, 1.0]), track)
    assert exact == pytest.approx(speed * horizon + 1.0 + 2.0 * predicted_m, rel=0.02)


@given(low=finite(0.0, 1.0), high=finite(0.0, 1.0))
def test_awareness_never_lengthens_the_elongation(low: float, high: float) -> None:
    low, high = sorted((low, high))
    for shape in ("linear", "smoothstep", "logistic", "two_level"):
        outline = ObstacleOutline(unaware_ahead_s=1.0, aware_ahead_s=0.1, shape=shape)
        assert outline.ahead_s(high) <= outline.ahead_s(low) + 1e-12
