"""Valid tracks and bounded memory for any input and any settings, however long."""

from __future__ import annotations

import copy
import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest
from fusion_scenes import LASER, laser_at, seen_by_laser, sensors
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from tracking_scenes import CAMERA, as_bytes, camera_at, nearest, observe

from perception import Camera
from tracking import (
    AwarenessFilterConfig,
    CameraView,
    PersonTrack,
    PersonTracker,
    TrackerConfig,
    TrackingError,
)

VIEW = CameraView(Camera.from_fov(640, 480, 1.2))
REMEMBERS = AwarenessFilterConfig(noticed_memory_s=4.0)

# Clutter bursts, duplicates and people, certain and vague. There are few positions to draw from, so
# they coincide.
spots = st.tuples(
    st.sampled_from([0.2, 1.0, 1.0, 1.2, 2.5, 6.0]),
    st.sampled_from([-0.5, 0.0, 0.0, 0.3, 4.0]),
    st.sampled_from([0.0, 1e-4, 0.02, 0.02, 4.0]),
    st.sampled_from([None, 0.0, 0.5, 1.0]),
    st.sampled_from([0.0, 0.05, 0.25, 2.0]),
)
crowds = st.lists(spots, max_size=6) | st.lists(spots, min_size=15, max_size=25)
steps_s = st.sampled_from([0.0, 1e-9, 0.01, 0.05, 0.05, 0.3, 1.1, 4.0, 1e4, -0.02, -0.3, -2.0])
frames = st.tuples(steps_s, crowds, st.sampled_from(["camera", "camera", LASER]))


@pytest.mark.parametrize("view", [None, VIEW], ids=["no view", "view"])
@settings(max_examples=25, deadline=None)
@given(sequence=st.lists(frames, max_size=25))
def test_the_tracks_are_valid_after_any_sequence(view, sequence) -> None:
    config = TrackerConfig(max_pause_s=1e12, new_clock_after_s=1e5, awareness=REMEMBERS)
    tracker = PersonTracker(config, view=view, sensors=sensors())
    latest, lower = 0.0, {}
    for dt_s, crowd, sensor in sequence:
        now = latest + dt_s
        if sensor == LASER:
            seen = [seen_by_laser((x, y), now) for x, y, *_ in crowd]
            T = laser_at()
        else:
            T = camera_at(yaw_rad=0.3 * dt_s)
            seen = [
                observe((x, y), now, covariance_odom_m2=var, awareness=alpha, awareness_std=std)
                for x, y, var, alpha, std in crowd
            ]
        last_s = tracker.last_stamp_s
        before = as_bytes(tracker.predict(last_s or 0.0))
        for track in tracker.predict(max(now, last_s or 0.0)):
            assert track.awareness_lower <= lower[track.id]
        try:
            tracks = tracker.update(seen, now, T, sensor=sensor)
        except TrackingError:
            # Late, or ahead again although a frame of another sensor has shown that to be wrong.
            assert not latest - config.max_lag_s <= now <= latest + config.max_lag_s
            assert (as_bytes(tracker.predict(last_s or 0.0)), tracker.last_stamp_s) == (
                before,
                last_s,
            )
            continue
        # A frame far ahead is taken back by one that goes on from before it.
        assert tracker.last_stamp_s in (now, latest if last_s is not None else now)
        latest = tracker.last_stamp_s
        ids = [track.id for track in tracks]
        assert ids == sorted(set(ids))
        if dt_s >= 0.0:
            assert any(track.time_since_seen_s == 0.0 for track in tracks) >= bool(seen)
        for track in tracks:
            PersonTrack(**{name: getattr(track, name) for name in PersonTrack.__slots__})
            np.testing.assert_array_equal(track.covariance_odom, track.covariance_odom.T)
            np.linalg.cholesky(track.covariance_odom)
            assert track.stamp_s == latest
            assert 0.0 <= track.awareness_lower <= track.awareness <= 1.0
            # A sensor is silent after 2.5 of its intervals, which are 4 s at most.
            assert track.status != "confirmed" or track.time_since_seen_s <= 10.0
            if track.status == "tentative":
                assert track.noticed == track.awareness_lower == 0.0
        lower = {track.id: track.awareness_lower for track in tracks}
    assert as_bytes(copy.deepcopy(tracker).predict(latest)) == as_bytes(tracker.predict(latest))


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_order_of_the_measurements_in_a_frame_does_not_matter(seed: int) -> None:
    """Only the ids of people who are first seen in one frame follow its order."""
    rng = np.random.default_rng(seed)
    first, second = PersonTracker(), PersonTracker()
    people = rng.uniform((1.0, -3.0), (7.0, 3.0), (6, 2))
    names: dict[int, int] = {}
    for step in range(25):
        now = 0.05 * step
        places = people + rng.normal(0.0, 0.1, people.shape)
        alphas = rng.uniform(size=6)
        frame = [
            observe(place, now, awareness=float(alpha))
            for place, alpha in zip(places, alphas, strict=True)
            if rng.uniform() < 0.9
        ]
        one = first.update(frame, now, CAMERA)
        shuffled = [frame[i] for i in rng.permutation(len(frame))]
        other = {
            track.position_odom_m.tobytes(): track for track in second.update(shuffled, now, CAMERA)
        }
        assert len(other) == len(one)
        for track in one:
            twin = other[track.position_odom_m.tobytes()]
            assert names.setdefault(track.id, twin.id) == twin.id
            assert as_bytes([track])[0][1:] == as_bytes([twin])[0][1:]


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_frame_may_come_in_two_parts(seed: int) -> None:
    """Two drivers may each send the people of one half of the image, with the same stamp."""
    rng = np.random.default_rng(seed)
    whole, parts = PersonTracker(), PersonTracker()
    people = np.array([[3.0, -2.0], [3.0, 2.0], [5.0, 0.0], [7.0, -2.0], [7.0, 2.0]])
    for step in range(30):
        now = 0.05 * step
        places = people + rng.normal(0.0, 0.1, people.shape)
        frame = [observe(place, now, awareness=0.8) for place in places if rng.uniform() < 0.9]
        one = whole.update(frame, now, CAMERA)
        half = int(rng.integers(0, len(frame) + 1))
        parts.update(frame[:half], now, CAMERA)
        other = parts.update(frame[half:], now, CAMERA)
        # Outliers beside a person may be hidden by them, or not, in the first part.
        surely = [track for track in one if track.status != "tentative"]
        assert len(surely) == sum(track.status != "tentative" for track in other)
        for track in surely:
            twin = nearest(other, track.position_odom_m)
            assert twin.status == track.status
            for name in ("position_odom_m", "velocity_odom_mps", "covariance_odom"):
                np.testing.assert_allclose(getattr(twin, name), getattr(track, name), atol=1e-9)
            assert twin.awareness == pytest.approx(track.awareness, abs=0.02)


@pytest.mark.parametrize("frames", [1_000, pytest.param(100_000, marks=pytest.mark.full)])
def test_memory_is_bounded_for_any_number_of_frames(frames: int) -> None:
    rng = np.random.default_rng(1)
    tracker = PersonTracker(TrackerConfig(max_lag_s=0.2), view=VIEW)
    sizes = []
    now = 0.0
    for step in range(frames):
        now += 0.03
        spots = [(3.0 + np.sin(0.3 * now), 0.5), *rng.uniform((1, -3), (7, 3), (rng.poisson(1), 2))]
        late_s = now - 0.15 if step % 7 == 3 else now
        tracker.update([observe(spot, late_s, awareness=0.5) for spot in spots], late_s, CAMERA)
        if step % (frames // 20) == frames // 20 - 1:
            sizes.append(len(pickle.dumps(tracker)))
    assert max(sizes[10:]) < 1.5 * max(sizes[:10])
    assert np.mean(sizes[10:]) < 1.2 * np.mean(sizes[:10])
    assert max(sizes) < 300_000


def numbers(model: type[BaseModel]) -> dict[str, tuple[float, float]]:
    """Return the least and the greatest value of every setting that is a number."""
    found = {}
    for name, schema in model.model_json_schema()["properties"].items():
        if schema.get("type") == "number":
            low = schema.get("minimum", np.nextafter(schema.get("exclusiveMinimum", -np.inf), 9e9))
            high = schema.get("maximum", np.nextafter(schema.get("exclusiveMaximum", np.inf), 0.0))
            found[name] = float(low), float(high)
    return found


@st.composite
def extreme(draw: st.DrawFn, model: type[BaseModel]) -> dict[str, float]:
    """Draw some settings at or near their bounds."""
    found = numbers(model)
    assert np.isfinite(list(found.values())).all()
    chosen = draw(st.sets(st.sampled_from(sorted(found)), max_size=4))
    return {
        name: draw(st.sampled_from(found[name]) | st.floats(*found[name]))
        for name in sorted(chosen)
    }


@settings(max_examples=40, deadline=None)
@given(extreme(TrackerConfig), extreme(AwarenessFilterConfig))
def test_the_tracker_runs_with_any_settings_it_accepts(changes, of_awareness) -> None:
    try:
        awareness = AwarenessFilterConfig(**of_awareness)  # type: ignore[arg-type]
    except ValidationError:
        assume(False)
    tracker = PersonTracker(TrackerConfig(awareness=awareness, **changes))  # type: ignore[arg-type]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for step in range(12):
            now = 0.1 * step
            people = [
                observe((3.0 + 0.1 * step, 0.0), now, awareness=0.8),
                observe((4.0, 0.4), now),
            ]
            for track in tracker.update(people if step % 5 != 3 else [], now, CAMERA):
                assert np.isfinite(track.position_odom_m).all()
                assert np.isfinite(track.velocity_odom_mps).all()
                assert np.isfinite(track.covariance_odom).all()
                assert 0.0 <= track.awareness_lower <= track.awareness <= 1.0
        tracker.predict(now + 30.0)


def test_a_config_is_the_same_after_yaml(tmp_path: Path) -> None:
    config = TrackerConfig(max_coast_s=2.5, awareness=REMEMBERS)
    config.to_yaml(tmp_path / "tracker.yaml")
    assert TrackerConfig.from_yaml(tmp_path / "tracker.yaml") == config
