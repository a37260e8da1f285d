"""Views of single scans: how far their rays reach, and which places they have passed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fusion_scenes import seen_by_laser
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import Camera, PersonObservation
from perception.laser import LaserScan, RobotMotion, Scanner, scan_points
from tracking import CameraView, PersonTracker, RangedView, ScannerView, SensorConfig

STEP_RAD = math.radians(0.5)
ANGLES_RAD = -math.pi + STEP_RAD * np.arange(720)
RADIUS_M = np.array([0.4])


def view_of(ranges: np.ndarray, motion: RobotMotion | None = None, **changes: float) -> ScannerView:
    scan = LaserScan(0.0, -math.pi, STEP_RAD, ranges, 0.05, 20.0, **changes)
    at_rest = RobotMotion(0.0, np.eye(4)) if motion is None else motion
    return ScannerView(8.0, points=scan_points(scan, Scanner.mounted(0.0, 0.0, 0.2), at_rest))


def ahead(half_deg: float, value: float, other: float = 6.0, at_deg: float = 0.0) -> np.ndarray:
    off = np.abs(ANGLES_RAD - math.radians(at_deg))
    return np.where(off <= math.radians(half_deg), value, other)


def seen(view: ScannerView, x_m: float, y_m: float = 0.0) -> tuple[float, bool]:
    place, T = np.array([[x_m, y_m]]), np.eye(4)
    (visible,), (passed,) = view.visibility(place, T), view.passed(place, RADIUS_M, T)
    return float(visible), bool(passed)


def test_what_rays_have_passed_is_visible_and_empty() -> None:
    assert isinstance(ScannerView(), RangedView)
    assert not isinstance(CameraView(Camera.from_fov(64, 48, 1.0)), RangedView)
    view = view_of(np.full(720, 6.0))
    assert seen(view, 3.0) == (1.0, True)
    # A wall within the place: nothing shows that nobody is behind it.
    assert seen(view, 5.8) == (ScannerView(8.0).visibility([[0.0, 5.8]], np.eye(4))[0], False)
    assert seen(view, 6.5) == (0.0, False)


@pytest.mark.parametrize("value", [1.5, math.nan, 0.0, -math.inf, 65.5, 0.02])
def test_behind_what_stops_or_blinds_the_rays_nobody_is_visible(value: float) -> None:
    view = view_of(ahead(25.0, value))
    assert seen(view, 3.0) == (0.0, False)
    assert seen(view, 3.0, 3.0) == (1.0, True)


@pytest.mark.parametrize(
    ("ranges", "visible", "passed"),
    [
        (ahead(20.0, 1.0, at_deg=20.0), 0.5, False),  # half of a body
        (ahead(25.0, math.inf), 1.0, False),  # dark clothes return nothing
        (ahead(2.0, 2.9), 1.0, False),
        # A leg of 0.1 m suffices to stop the rays, single lost ones do not.
        (ahead(1.0, 2.9), 1.0, False),
        (ahead(0.2, math.nan), 1.0, True),
    ],
    ids=["half", "dark", "body", "leg", "lost ray"],
)
def test_a_place_is_empty_only_if_rays_have_passed_all_of_it(ranges, visible, passed) -> None:
    found, empty = seen(view_of(ranges), 3.0)
    assert found == pytest.approx(visible, abs=0.2)
    assert empty is passed


def test_the_places_at_the_edge_of_the_rays_are_not_empty() -> None:
    rays = np.where(np.abs(ANGLES_RAD) < math.radians(90.0), 6.0, np.nan)
    view = view_of(rays)
    assert seen(view, 0.5, 2.0)[1]
    assert not seen(view, 0.3, 2.0)[1]
    # Nor is what is around the scanner itself.
    assert not seen(view_of(np.full(720, 6.0)), 0.3)[1]


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-1.5, 1.5), st.floats(-1.2, 1.2))
def test_rays_are_where_the_robot_was_when_they_were_measured(yaw_rad, x_m, speed_mps, turn_radps):
    """A wall at 6 m with one open sector, from a robot that drives and turns in the scan."""
    T = np.eye(4)
    T[:2, :2] = [[math.cos(yaw_rad), -math.sin(yaw_rad)], [math.sin(yaw_rad), math.cos(yaw_rad)]]
    T[0, 3] = x_m
    motion = RobotMotion(0.0, T, np.array([speed_mps, 0.0]), turn_radps)
    view = view_of(ahead(12.0, 1.0, at_deg=40.0), motion, time_increment_s=1e-4)
    assert view.points is not None
    ray = 360 + 80
    origin, end = view.points.origins_odom_m[ray, :2], view.points.ends_odom_m[ray, :2]
    hidden = origin + 3.0 * (end - origin) / np.linalg.norm(end - origin)
    free = origin - 3.0 * (end - origin) / np.linalg.norm(end - origin)
    places = np.array([hidden, free])
    assert view.visibility(places, T).tolist() == pytest.approx([0.0, 1.0], abs=0.06)
    assert view.passed(places, np.array([0.3, 0.3]), T).tolist() == [False, True]


def legs(stamp_s: float) -> PersonObservation:
    return seen_by_laser((3.0, 0.0), stamp_s, T=np.eye(4))


def test_a_view_of_a_frame_holds_for_that_frame_also_when_frames_come_late() -> None:
    """The view of a scan is kept with it, and late frames are processed with their own."""

    hidden, free = view_of(ahead(25.0, 1.0)), view_of(np.full(720, 6.0))
    frames = [
        (stamp_s, [legs(stamp_s)] if stamp_s < 1.99 else [], hidden if stamp_s < 2.99 else free)
        for stamp_s in (0.05 * np.arange(70)).tolist()
    ]
    ordered, late = (
        PersonTracker(sensors={"laser": SensorConfig(view=ScannerView())}) for _ in range(2)
    )
    swapped = [frames[k + 1 if k % 2 == 0 else k - 1] for k in range(70)]
    for tracker, given_frames in ((ordered, frames), (late, swapped)):
        for stamp_s, people, view in given_frames:
            tracker.update(people, stamp_s, np.eye(4), sensor="laser", view=view)
    (one,), (other,) = ordered.predict(3.5), late.predict(3.5)
    assert np.array_equal(one.position_odom_m, other.position_odom_m)
    assert one.place_empty == other.place_empty
    # Hidden for 1 s and missed for 0.5 s since: it is not yet given up.
    assert not one.place_empty
    for step in range(8):
        stamp_s = 3.5 + 0.05 * step
        tracks = ordered.update([], stamp_s, np.eye(4), sensor="laser", view=free)
    assert tracks == () or tracks[0].place_empty


def test_whether_a_place_is_empty_is_kept() -> None:
    free = view_of(np.full(720, 6.0))
    sensors = {"laser": SensorConfig(view=ScannerView())}
    tracker = PersonTracker(sensors=sensors)
    for step in range(63):
        stamp_s = 0.05 * step
        people = [legs(stamp_s)] if step < 40 else []
        tracks = tracker.update(people, stamp_s, np.eye(4), sensor="laser", view=free)
    (track,) = tracks
    assert track.place_empty
    assert tracker.predict(stamp_s)[0].place_empty
