"""People over the horizon: circles, covariances, and the prediction model where it is chosen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, constraints_of, crowds, finite, person, robot_at, some_circles

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.exporters import predicted_circles, speed_limit_at
from tracking import PersonTrack
from tracking.prediction import FITTED, PredictionModel, predict_ahead


@given(circles=some_circles(), growth_mps=finite(0, 1), steps=st.integers(0, 5))
def test_predicted_circles_move_and_grow(circles, growth_mps, steps) -> None:
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
def test_slots_hold_the_nearest_people_and_then_empty_circles(circles, slots) -> None:
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


def test_obstacles_keep_a_read_only_covariance_at_the_stamp() -> None:
    (obstacle,) = constraints_for((person(sigma_m=0.2),), now=0.1).obstacles
    assert obstacle.covariance_odom is not None
    np.testing.assert_allclose(obstacle.covariance_odom, np.diag([0.04, 0.04, 0.0, 0.0]))
    with pytest.raises(ValueError, match="read-only"):
        obstacle.covariance_odom[0, 0] = 1.0
    assert "covariance" not in repr(obstacle)


TIMES_S = np.array([0.0, 0.2, 0.5, 1.0, 2.0])


def walker(**arguments: object) -> PersonTrack:
    """Return a person whose velocity is uncertain too."""
    track = person(**arguments)  # type: ignore[arg-type]
    covariance = np.kron([[0.01, 0.01], [0.01, 0.04]], np.eye(2))
    return replace(track, covariance_odom=covariance)


def constraints_for(
    tracks: tuple[PersonTrack, ...],
    prediction: PredictionModel | None = None,
    *,
    speed_mps: float = 0.0,
    now: float = 0.0,
) -> NavConstraints:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT, prediction=prediction)
    return adapter.update(tracks, robot_at(now, speed_mps=speed_mps), now)


@settings(max_examples=25)
@given(tracks=crowds())
def test_circles_and_limits_are_those_without_a_prediction(tracks: tuple[PersonTrack, ...]) -> None:
    plain, wide = constraints_for(tracks), constraints_for(tracks, FITTED)
    assert wide.speed_limit_mps == plain.speed_limit_mps
    assert wide.limited_by == plain.limited_by
    for one, other in zip(plain.obstacles, wide.obstacles, strict=True):
        assert one.radius_m == other.radius_m
        np.testing.assert_array_equal(one.center_odom_m, other.center_odom_m)
        assert one.polygon.equals(other.polygon)


def test_the_speed_field_is_more_cautious_the_further_ahead() -> None:
    track = walker(position=(4.0, 0.0))
    plain, wide = constraints_for((track,)), constraints_for((track,), FITTED)
    poses = np.zeros((1, 20, 2))
    before, after = (speed_limit_at(each, poses, dt_s=0.1)[0] for each in (plain, wide))
    assert after[0] == pytest.approx(before[0], abs=0.02)
    assert (np.diff(after) <= 0.0).all()
    assert np.ptp(before) < 1e-6
    assert after[-1] < before[-1] - 0.1


def test_alerts_reach_as_far_as_the_person_may_be_by_then() -> None:
    """A person who passes at 1.8 m in 1.5 s may have come within half a metre."""
    aside = walker(position=(1.8, 1.8), velocity=(0.0, 0.0))
    plain, wide = (
        constraints_for((aside,), model, speed_mps=1.2).alerts for model in (None, FITTED)
    )
    assert plain == ()
    assert [alert.track_id for alert in wide] == [1]


def test_predicted_circles_grow_with_the_uncertainty() -> None:
    tracks = (walker(position=(4.0, 1.0)), walker(track_id=2, velocity=(1.3, 0.0)))
    constraints = constraints_for(tracks)
    plain = predicted_circles(constraints, TIMES_S)
    grown = predicted_circles(constraints, TIMES_S, model=FITTED, sigmas=1.5)
    np.testing.assert_array_equal(grown[:, :, :4], plain[:, :, :4])
    spread = predict_ahead(tracks, TIMES_S).covariances_odom_m2
    sigmas_m = np.sqrt(np.linalg.eigvalsh(spread)[..., -1])
    wanted = plain[:, :, 4] + 1.5 * np.maximum(sigmas_m - 0.1, 0.0)
    np.testing.assert_allclose(grown[:, :, 4], wanted, atol=1e-9)
    assert (np.diff(grown[:, :, 4], axis=1) > 0.0).all()
