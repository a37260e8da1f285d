"""MediaPipe as an eye estimator; most tests need the extra."""

from __future__ import annotations

import importlib.util
import math
import re
import sys
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from perception import Camera, HeadPose, PerceptionError
from perception.eyes import EyeEstimator
from perception.installation import install_command
from perception.networks import MediaPipeEyeEstimator
from perception.networks.poses import iris_std_m
from perception.networks.poses._mediapipe_eyes import iris_offset

HAS_MEDIAPIPE = importlib.util.find_spec("mediapipe") is not None
needs_mediapipe = pytest.mark.skipif(
    not HAS_MEDIAPIPE, reason="mediapipe is not installed (the extra 'mediapipe')"
)
CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
FRAME = np.zeros((480, 640, 3), np.uint8)
FACING = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], axis=1)


def head_at(distance_m, yaw_deg=0.0):
    angle = math.radians(yaw_deg)
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return HeadPose([0.0, 0.0, distance_m], turn @ FACING, 1e-3 * np.eye(6), 0.5)


def landmarks(left=(0.0, 0.0), right=(0.0, 0.0), opening=0.03):
    """Return 478 landmarks with eyes 0.1 wide, whose irises lie off the middle of the corners."""
    marks = [SimpleNamespace(x=0.5, y=0.5) for _ in range(478)]
    for iris, corners, lids, middle, off in (
        (473, (362, 263), (386, 374), (0.6, 0.4), left),
        (468, (133, 33), (159, 145), (0.4, 0.4), right),
    ):
        marks[iris] = SimpleNamespace(x=middle[0] + off[0], y=middle[1] + off[1])
        for row, side in zip(corners, (-0.05, 0.05), strict=True):
            marks[row] = SimpleNamespace(x=middle[0] + side, y=middle[1])
        for row, side in zip(lids, (-0.5, 0.5), strict=True):
            marks[row] = SimpleNamespace(x=middle[0], y=middle[1] + side * opening)
    return marks


def test_a_broken_package_is_refused_with_the_name_of_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "mediapipe", None)
    monkeypatch.setitem(sys.modules, "mediapipe.python.solutions", None)
    missing = "MediaPipeEyeEstimator needs .*" + re.escape(install_command("mediapipe"))
    with pytest.raises(PerceptionError, match=missing):
        MediaPipeEyeEstimator()


def test_the_offset_is_the_mean_of_both_irises():
    found = iris_offset(landmarks(left=(0.01, -0.002), right=(0.02, 0.004)))
    assert found == pytest.approx([0.015, 0.001])


@pytest.mark.parametrize(
    "marks", [landmarks(opening=0.01), landmarks(left=(math.nan, 0.0)), landmarks(opening=0.0)]
)
def test_closed_eyes_and_numbers_that_are_none_say_nothing(marks):
    assert iris_offset(marks) is None


def test_the_place_of_irises_is_less_certain_with_fewer_pixels():
    stds = [iris_std_m(CAMERA.fx_px / distance) for distance in (0.7, 1.0, 1.5, 2.0, 2.5, 5.0)]
    for near, far in pairwise(stds):
        assert far[0] > near[0]
        assert far[1] > near[1]
    # Lids cover irises above and below, so less is known along the head's height.
    assert all(along > 2.0 * across for across, along in stds[:3])


# --- with MediaPipe -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def estimator():
    with MediaPipeEyeEstimator() as opened:
        yield opened


@needs_mediapipe
def test_it_is_an_eye_estimator_and_finds_no_eyes_in_the_dark(estimator):
    assert isinstance(estimator, EyeEstimator)
    assert estimator.estimate(FRAME, CAMERA, ()) == ()
    assert estimator.estimate(FRAME, CAMERA, (None, head_at(1.5))) == (None, None)


@needs_mediapipe
@pytest.mark.parametrize("head", [head_at(3.0), head_at(1.5, yaw_deg=60.0), head_at(1.5, 180.0)])
def test_far_heads_and_those_turned_away_cost_no_run(estimator, head, monkeypatch):
    monkeypatch.setattr(estimator, "_mesh", object())  # has no method to run
    assert estimator.estimate(FRAME, CAMERA, (head,)) == (None,)


@needs_mediapipe
def test_a_closed_estimator_and_anything_but_an_rgb_image_are_refused(estimator):
    with pytest.raises(PerceptionError, match="image_rgb"):
        estimator.estimate(FRAME[..., 0], CAMERA, ())
    closed = MediaPipeEyeEstimator()
    closed.close()
    closed.close()
    with pytest.raises(PerceptionError, match="closed"):
        closed.estimate(FRAME, CAMERA, ())


@needs_mediapipe
@pytest.mark.parametrize("look", ["giulia", "daniel"])
def test_eyes_of_a_rendered_worker_are_measured(estimator, look):
    sim = pytest.importorskip("sim_tests")
    pytest.importorskip("pybullet")
    turns = np.radians([-16.0, 0.0, 16.0])
    with sim.Warehouse() as warehouse:
        worker = sim.Worker(warehouse, look=look)
        renderer = sim.CameraRenderer(warehouse)
        found, scores = [], []
        for turn in turns:
            worker.place((1.2, 0.0), math.pi, eye_yaw_rad=float(turn))
            camera_z = float(worker.eyes_odom_m[2])
            T_odom_camera = np.array(
                [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, camera_z], [0, 0, 0, 1]], dtype=float
            )
            rotation = T_odom_camera[:3, :3].T @ worker.rotation_odom_head
            nose = (worker.keypoints_odom_m[0] - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]
            head = HeadPose(nose, rotation, 1e-6 * np.eye(6), 0.5)
            (eyes,) = estimator.estimate(
                renderer.render(CAMERA, T_odom_camera).rgb, CAMERA, (head,)
            )
            assert eyes is not None
            found.append(eyes.angles_rad[0])
            scores.append((eyes.angles_rad[0] - turn) ** 2 / eyes.covariance_rad2[0, 0])
    assert np.corrcoef(found, turns)[0, 1] > 0.95
    assert 0.5 < np.polyfit(turns, found, 1)[0] < 1.5
    assert max(scores) < 9.0
