"""Properties of the tracker that hold for anything: garbage, another world, another order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fusion_scenes import LASER, Event, both, laser_at, seen_by_camera, seen_by_laser
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import FloatArray, camera_at

from perception import PersonObservation
from tracking import (
    AwarenessFilterConfig,
    PersonTrack,
    PersonTracker,
    SensorConfig,
    TrackerConfig,
    TrackingError,
)

REMEMBERS = TrackerConfig(awareness=AwarenessFilterConfig(noticed_memory_s=3.0))
numbers = (
    st.sampled_from([0.0, 1e-9, -1e-170, 5e-324, 1.0, -1.2, 4.0, 1e6, 1e7, -1e7, 1e30])
    | st.floats(-10.0, 10.0)
    | st.floats(allow_nan=False, allow_infinity=False)
)
shares = st.sampled_from([0.0, 0.05, 0.3, 1.0, 1e3])


@st.composite
def observations(draw: st.DrawFn) -> PersonObservation:
    """Draw any observation that perception's own checks let through."""
    roots = np.array(draw(st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9))).reshape(3, 3)
    spread = roots @ roots.T * draw(st.sampled_from([0.0, 1e-12, 1e-3, 1.0, 1e6, 1e200]))
    alpha = draw(st.none() | st.floats(0.0, 1.0))
    sized = draw(st.booleans())
    return PersonObservation(
        0.0,
        draw(st.tuples(numbers, numbers, numbers)),
        0.5 * (spread + spread.T),
        None,
        alpha,
        None if alpha is None else draw(st.sampled_from([0.0, 0.05, 0.28, 1e9])),
        draw(st.floats(0.0, 1.0)),
        range_lasting_relative_std=draw(shares),
        size_range_m=draw(st.sampled_from([1e-300, 0.5, 4.0, 1e300])) if sized else None,
        size_range_relative_std=draw(st.sampled_from([1e-3, 0.1, 1e3])) if sized else None,
    )


poses = st.sampled_from(
    [np.eye(4), laser_at(2.0, -1.0, 2.0), camera_at(), camera_at(3.0, 1.0, -2.0, 0.4)]
)
# The pose of a camera that looks along x has the person at (0, y, 0) straight above or below it.
frames = st.tuples(
    st.sampled_from([0.1, 0.1, 0.04, 0.0, 0.4, 3.0, -0.2]),
    st.lists(observations(), max_size=3),
    poses,
    st.none() | st.sampled_from([1e-3, 1.0, 1e8]),
    st.sampled_from(["camera", "camera", LASER]),
)


@settings(max_examples=80, deadline=None)
@given(st.lists(frames, min_size=1, max_size=12), st.booleans())
def test_any_finite_input_gives_valid_tracks_or_a_tracking_error(sequence, with_views) -> None:
    tracker = both(REMEMBERS)
    if not with_views:
        tracker = PersonTracker(REMEMBERS, sensors={LASER: SensorConfig()})
    now = 100.0
    for dt_s, seen, T, pose, sensor in sequence:
        now += dt_s
        stamped = [replace(each, stamp_s=now) for each in seen]
        covariance = None if pose is None else pose * np.eye(3)
        try:
            tracks = tracker.update(stamped, now, T, pose_covariance_odom=covariance, sensor=sensor)
        except TrackingError:
            continue
        now = tracker.last_stamp_s or now
        for track in (*tracks, *tracker.predict(now + 0.5)):
            assert np.isfinite(track.position_odom_m).all()
            assert np.isfinite(track.velocity_odom_mps).all()
            assert 0.0 <= track.awareness_lower <= track.awareness <= 1.0
            assert 0.0 <= track.noticed <= 1.0
            deviations = np.sqrt(np.diag(track.covariance_odom))
            assert (deviations > 0.0).all()
            correlations = track.covariance_odom / np.outer(deviations, deviations)
            assert np.linalg.eigvalsh(correlations).min() > -1e-6


@pytest.mark.parametrize("x_m", [0.0, 1e-300, 1e-12, 1e-6])
def test_somebody_exactly_under_the_camera_is_tracked(x_m: float) -> None:
    """The error of a size that nobody knows lies along the ray, which has no direction there."""
    tracker = both()
    for step in range(10):
        now = 0.1 * step
        one = PersonObservation(
            now, [x_m, 1.2, 0.0], 0.01 * np.eye(3), None, None, None, 0.9,
            range_lasting_relative_std=0.05, size_range_m=1.3, size_range_relative_std=0.1,
        )  # fmt: skip
        tracker.update([one], now, camera_at())
        (track,) = tracker.update([seen_by_laser((0.0, 0.0), now)], now, laser_at(), sensor=LASER)
    assert track.status == "confirmed"
    np.testing.assert_allclose(track.position_odom_m, 0.0, atol=1e-5)


def events(seed: int) -> list[Event]:
    """Return frames of a camera and a scanner: walkers, a child, missed frames, clutter."""
    rng = np.random.default_rng(seed)
    starts = rng.uniform((1.0, -2.5), (7.0, 2.5), (4, 2))
    velocities = rng.choice([0.0, 1.0], (4, 1)) * rng.normal(0.0, 0.7, (4, 2))
    alphas = rng.choice([0.05, 0.6, 0.95], 4)
    found: list[Event] = []
    for stamp_s, sensor in sorted(
        [(0.1 * tick, "camera") for tick in range(25)]
        + [(0.013 + 0.05 * tick, LASER) for tick in range(48)]
    ):
        T = (camera_at if sensor == "camera" else laser_at)(0.3 * stamp_s, 0.0, 0.1 * stamp_s)
        places = [*(starts + stamp_s * velocities), rng.uniform((1.0, -3.0), (7.0, 3.0))]
        seen = []
        for index, place in enumerate(places):
            if rng.uniform() > (0.85 if index < 4 else 0.1):
                continue
            if sensor == "camera":
                one = seen_by_camera(
                    place,
                    stamp_s,
                    T=T,
                    ratio=1.4 if index == 3 else 1.0,
                    noise_m=rng.normal(size=2),
                    awareness=None if rng.uniform() < 0.2 else float(alphas[index % 4]),
                )
                seen.append(replace(one, range_lasting_relative_std=0.05))
            else:
                seen.append(seen_by_laser(place + rng.normal(0.0, 0.04, 2), stamp_s, T=T))
        found.append((stamp_s, seen, T, sensor))
    return found


def played(frames: list[Event], tracker: PersonTracker | None = None) -> tuple[PersonTrack, ...]:
    tracker = both(REMEMBERS) if tracker is None else tracker
    for stamp_s, seen, T, sensor in frames:
        tracker.update(seen, stamp_s, T, sensor=sensor)
    return tracker.predict(max(stamp_s for stamp_s, *_ in frames))


def assert_same(
    first: tuple[PersonTrack, ...],
    second: tuple[PersonTrack, ...],
    turn: FloatArray | None = None,
    shift_m: FloatArray | None = None,
    later_ids: int = 0,
) -> None:
    """Check that the second tracks are the first ones in a world that is turned and shifted."""
    turn = np.eye(2) if turn is None else turn
    whole = np.kron(np.eye(2), turn)
    assert [each.id + later_ids for each in first] == [each.id for each in second]
    for one, other in zip(first, second, strict=True):
        place = turn @ one.position_odom_m + (0.0 if shift_m is None else shift_m)
        np.testing.assert_allclose(other.position_odom_m, place, atol=1e-8)
        np.testing.assert_allclose(other.velocity_odom_mps, turn @ one.velocity_odom_mps, atol=1e-8)
        turned = whole @ one.covariance_odom @ whole.T
        np.testing.assert_allclose(other.covariance_odom, turned, atol=1e-8)
        assert (other.status, other.place_empty) == (one.status, one.place_empty)
        for name in ("awareness", "awareness_std", "awareness_lower", "noticed"):
            assert getattr(other, name) == pytest.approx(getattr(one, name), abs=1e-9)


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    x_m=st.floats(-100.0, 100.0),
    y_m=st.floats(-100.0, 100.0),
    yaw=st.floats(-np.pi, np.pi),
    mirrored=st.booleans(),
)
def test_a_world_that_is_turned_mirrored_or_shifted_has_the_same_people(
    seed, x_m, y_m, yaw, mirrored
):
    c, s = np.cos(yaw), np.sin(yaw)
    world, sign = np.eye(4), -1.0 if mirrored else 1.0
    world[:2, :2] = [[c, -sign * s], [s, sign * c]]
    world[:2, 3] = x_m, y_m
    frames = events(seed)
    others = []
    for stamp_s, seen, T, sensor in frames:
        # In a mirror, the image of a camera is mirrored left to right, and so is a scan.
        flip = np.diag([sign, 1.0, 1.0] if sensor == "camera" else [1.0, sign, 1.0])
        flipped = [
            replace(
                each,
                position_camera_m=flip @ each.position_camera_m,
                position_covariance_m2=flip @ each.position_covariance_m2 @ flip,
            )
            for each in seen
        ]
        there = world @ T
        there[:3, :3] = there[:3, :3] @ flip
        others.append((stamp_s, flipped, there, sensor))
    first, second = played(frames), played(others)
    assert_same(first, second, world[:2, :2], world[:2, 3])
    assert len(first) >= 2


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), earlier=st.integers(1, 4))
def test_numbers_that_were_given_before_change_nothing_but_the_numbers(seed, earlier) -> None:
    tracker, frames = both(REMEMBERS), events(seed)
    crowd = [seen_by_laser((2.0, y_m), -5.0) for y_m in range(earlier)]
    tracker.update(crowd, -5.0, laser_at(), sensor=LASER)
    tracker.reset()
    assert_same(played(frames), played(frames, tracker), later_ids=earlier)
