"""A saved state knows its sensors by name, in whatever order they come."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from fusion_scenes import everything, laser_at, seen_by_camera, seen_by_laser
from tracking_scenes import camera_at

from perception import Camera
from tracking import (
    CameraView,
    PersonTrack,
    PersonTracker,
    ScannerView,
    SensorConfig,
    TrackingError,
)

NAMES = ("rear", "back", "left")
VIEW = CameraView(Camera.from_fov(640, 480, math.radians(120.0)))


def sensors(names: tuple[str, ...]) -> dict[str, SensorConfig]:
    """Return sensors that differ, so that a column in the wrong place shows."""
    settings = {
        "rear": SensorConfig(view=ScannerView(), detection_probability=0.95),
        "back": SensorConfig(view=ScannerView(field_rad=2.0), detection_probability=0.6),
        "left": SensorConfig(miss_cost=8.0),
    }
    return {name: settings[name] for name in names}


def show(tracker: PersonTracker, step: int) -> tuple[PersonTrack, ...]:
    """Advance by 0.04 s: each sensor sees another of two people, at times."""
    now, walker = 0.04 * step, (3.0, 0.02 * step)
    if step % 3 == 0:
        tracker.update([seen_by_camera(walker, now, awareness=0.9)], now, camera_at())
    if step % 5 < 3:
        seen = [seen_by_laser(walker, now)] if step % 50 < 30 else []
        tracker.update(seen, now, laser_at(), sensor="rear")
    if step % 7 < 2:
        tracker.update([seen_by_laser((-2.0, 1.0), now)], now, laser_at(), sensor="back")
    return tracker.update([], now, laser_at(), sensor="left")


def saved(steps: int = 60) -> tuple[PersonTracker, str]:
    tracker = PersonTracker(view=VIEW, sensors=sensors(NAMES))
    for step in range(steps):
        show(tracker, step)
    return tracker, json.dumps(tracker.state())


@pytest.mark.parametrize("names", [NAMES, ("left", "back", "rear"), ("back", "rear", "left")])
@pytest.mark.parametrize("sort_keys", [False, True])
def test_sensors_may_come_in_any_order(names: tuple[str, ...], sort_keys: bool) -> None:
    tracker, text = saved()
    state = json.loads(json.dumps(json.loads(text), sort_keys=sort_keys))
    restored = PersonTracker.from_state(state, view=VIEW, sensors=sensors(names))
    assert restored.state() == tracker.state()
    for step in range(60, 200):
        assert everything(show(restored, step)) == everything(show(tracker, step))
    assert restored.silences_s == tracker.silences_s


def test_a_state_sorted_by_key_needs_no_sensors() -> None:
    tracker, text = saved()
    state = json.loads(json.dumps(json.loads(text), sort_keys=True))
    # Without views the tracks may be others, but not yet in this state.
    assert PersonTracker.from_state(state).state() == tracker.state()


@pytest.mark.parametrize("names", [("rear", "back"), ()])
def test_a_sensor_that_is_missing_is_named(names: tuple[str, ...]) -> None:
    _, text = saved(5)
    with pytest.raises(TrackingError, match=r"these differ: \[.*'left'\]"):
        PersonTracker.from_state(json.loads(text), view=VIEW, sensors=sensors(names))


def test_a_sensor_with_other_settings_is_named() -> None:
    _, text = saved(5)
    given = {**sensors(NAMES), "left": SensorConfig(miss_cost=9.0)}
    with pytest.raises(TrackingError, match=r"these differ: \['left'\]"):
        PersonTracker.from_state(json.loads(text), view=VIEW, sensors=given)


@pytest.mark.parametrize(
    ("order", "message"),
    [
        (["camera", "rear", "back"], "sensor_order must have each of"),
        (["camera", "rear", "back", "back"], "sensor_order must have each of"),
        (["rear", "camera", "back", "left"], "sensor_order must begin with 'camera'"),
    ],
)
def test_a_wrong_order_of_columns_is_refused(order: list[str], message: str) -> None:
    _, text = saved(5)
    state: dict[str, Any] = json.loads(text)
    state["sensor_order"] = order
    with pytest.raises(TrackingError, match=message):
        PersonTracker.from_state(state, view=VIEW, sensors=sensors(NAMES))
