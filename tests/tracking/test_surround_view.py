"""The view of a camera whose image is cut into several flat views."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import camera_at, observe

from perception import Camera
from perception.surround import ring_of_views
from tracking import CameraView, PersonTracker, SurroundView, TrackingError, View

CAMERA = Camera.from_fov(800, 600, math.radians(110.0))
T_ODOM_CAMERA = camera_at()


def surround(*headings_deg: float) -> SurroundView:
    views = ring_of_views(CAMERA, np.radians(headings_deg))
    flat = CameraView(CAMERA, max_range_m=10.0)
    return SurroundView((flat,) * len(views), tuple(each.rotation_camera_view for each in views))


@given(st.floats(-math.pi, math.pi), st.floats(0.6, 7.9))
def test_four_views_cover_all_directions(bearing, range_m):
    place = [[range_m * math.cos(bearing), range_m * math.sin(bearing)]]
    assert surround(0, 90, 180, -90).visibility(place, T_ODOM_CAMERA)[0] == 1.0


@given(st.floats(-math.pi, math.pi), st.floats(0.6, 12.0))
def test_another_view_never_lowers_the_visibility(bearing, range_m):
    place = [[range_m * math.cos(bearing), range_m * math.sin(bearing)]]
    ahead, more = surround(0), surround(0, 90)
    alone = CameraView(CAMERA, max_range_m=10.0).visibility(place, T_ODOM_CAMERA)
    assert ahead.visibility(place, T_ODOM_CAMERA) == alone
    assert more.visibility(place, T_ODOM_CAMERA) >= alone


def test_positive_headings_are_to_the_left() -> None:
    left, right, behind = [[0.0, 2.0]], [[0.0, -2.0]], [[-2.0, 0.0]]
    view = surround(0, 90)
    assert isinstance(view, View)
    assert view.visibility(left, T_ODOM_CAMERA)[0] == 1.0
    assert view.visibility(right, T_ODOM_CAMERA)[0] == 0.0
    assert view.visibility(behind, T_ODOM_CAMERA)[0] == 0.0
    assert view.visibility(np.empty((0, 2)), T_ODOM_CAMERA).shape == (0,)


def test_a_person_missed_behind_the_robot_is_deleted_sooner_with_a_view_there() -> None:
    """Only frames that could have shown the person count against the track."""
    kept = {}
    for name, view in (("ahead", surround(0)), ("around", surround(0, 90, 180, -90))):
        tracker = PersonTracker(view=view)
        for step in range(40):
            tracker.update([observe([-3.0, 0.0], 0.05 * step)], 0.05 * step, T_ODOM_CAMERA)
        last_s = 39 * 0.05
        stamp_s = last_s
        while tracker.update([], stamp_s := stamp_s + 0.05, T_ODOM_CAMERA):
            pass
        kept[name] = stamp_s - last_s
    assert kept["around"] < 1.5
    assert kept["ahead"] > 2.9


def test_views_and_rotations_that_do_not_fit_are_refused() -> None:
    flat = CameraView(CAMERA)
    with pytest.raises(TrackingError, match="of one length, at least 1, got 0 and 0"):
        SurroundView((), ())
    with pytest.raises(TrackingError, match="got 2 and 1"):
        SurroundView((flat, flat), (np.eye(3),))
    with pytest.raises(TrackingError, match=r"rotations_camera_view\[0\] must be a rotation"):
        SurroundView((flat,), (2.0 * np.eye(3),))
    with pytest.raises(TrackingError, match="visibility"):
        SurroundView(("view",), (np.eye(3),))  # type: ignore[arg-type]
    with pytest.raises(TrackingError, match="T_odom_camera"):
        surround(0).visibility([[1.0, 0.0]], np.zeros((4, 4)))
