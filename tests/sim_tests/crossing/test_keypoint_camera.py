import math

import numpy as np
import pytest

from perception import Camera
from perception.anthropometry import MEAN_STATURE_M
from sim_tests import KeypointNoise, SimError
from sim_tests.crossing.sensors import KeypointCamera

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
# Looking along odom x from a height of 1.4 m.
T_ODOM_CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1.0]])
EXACT = KeypointNoise(pixel_std_px=0.0, lift_std_m=0.0, miss_rate=0.0)


class Body:
    """A rigid set of keypoints: a flat cross of 23 points, facing the camera."""

    def __init__(self, x_m=3.0, y_m=0.0, stature_m=1.8):
        rng = np.random.default_rng(0)
        self.keypoints_odom_m = np.column_stack(
            [np.full(23, x_m), y_m + rng.uniform(-0.3, 0.3, 23), rng.uniform(0.2, 1.8, 23)]
        )
        self.keypoints_odom_m[:5, 2] = 1.7
        self.stature_m = stature_m

    def reach_odom_m(self):
        return np.array([self.keypoints_odom_m.min(axis=0), self.keypoints_odom_m.max(axis=0)])


class Wall:
    """A wall at a distance over part of the image."""

    def __init__(self, depth_m=np.inf, from_u_px=0.0):
        self.depth_m = depth_m
        self.from_u_px = from_u_px

    def blocked(self, eye_odom_m, ends_odom_m, detail):
        points = (ends_odom_m - eye_odom_m) @ T_ODOM_CAMERA[:3, :3]
        behind = points[:, 2] > self.depth_m
        return behind & (CAMERA.project(points)[:, 0] >= self.from_u_px)


def look(body, wall=None, noise=EXACT, seed=0):
    camera = KeypointCamera(CAMERA, wall or Wall(), noise, np.random.default_rng(seed))
    workers = camera.look(T_ODOM_CAMERA, [body])
    detections = camera.detect(None)
    return workers, detections, camera.estimate(None, detections)


def test_without_noise_the_keypoints_are_the_projected_truth():
    body = Body()
    workers, (detection,), (keypoints,) = look(body)
    points = (body.keypoints_odom_m - T_ODOM_CAMERA[:3, 3]) @ T_ODOM_CAMERA[:3, :3]
    pixels = CAMERA.project(points)
    visible = keypoints.scores[:23] > 0
    inside = np.all((pixels >= -0.5) & (pixels < [639.5, 479.5]), axis=1)
    assert workers == (0,)
    np.testing.assert_array_equal(visible, inside)
    np.testing.assert_allclose(keypoints.keypoints_px[:23][visible], pixels[visible])
    np.testing.assert_allclose(
        keypoints.keypoints_root_m[:23],
        (points - points[11:13].mean(axis=0)) * MEAN_STATURE_M / 1.8,
    )
    assert not keypoints.scores[23:].any()
    left, top, right, bottom = detection.box_xyxy_px
    assert np.all(pixels[visible] >= [left, top])
    assert np.all(pixels[visible] <= [right, bottom])


def test_a_wall_hides_what_is_behind_it():
    body = Body()
    _, _, (behind,) = look(body, Wall(3.5))
    assert behind.scores[:23].sum() >= 15
    assert look(body, Wall(2.0))[0] == ()
    _, _, (half,) = look(body, Wall(2.0, from_u_px=320.0))
    u = half.keypoints_px[:, 0][half.scores > 0]
    assert 5 <= len(u) < behind.scores.sum()
    assert u.max() <= 325.0


def test_noise_has_the_configured_size_and_is_independent_between_frames():
    noise = KeypointNoise(pixel_std_px=2.0, lift_std_m=0.05, miss_rate=0.0)
    camera = KeypointCamera(CAMERA, Wall(), noise, np.random.default_rng(0))
    pixels, lifts = [], []
    for _ in range(300):
        camera.look(T_ODOM_CAMERA, [Body()])
        (keypoints,) = camera.estimate(None, camera.detect(None))
        pixels.append(keypoints.keypoints_px[:5])
        lifts.append(keypoints.keypoints_root_m[:23, 2])
    pixels, lifts = np.array(pixels), np.array(lifts)
    assert pixels.std(axis=0).mean() == pytest.approx(2.0, rel=0.06)
    assert lifts.std(axis=0).mean() == pytest.approx(0.05, rel=0.06)
    lag = pixels - pixels.mean(axis=0)
    assert abs(np.mean(lag[1:] * lag[:-1])) < 0.3


def test_people_are_missed_at_the_configured_rate():
    noise = KeypointNoise(miss_rate=0.3)
    camera = KeypointCamera(CAMERA, Wall(), noise, np.random.default_rng(1))
    found = [len(camera.look(T_ODOM_CAMERA, [Body()])) for _ in range(1000)]
    assert np.mean(found) == pytest.approx(0.7, abs=0.05)


def test_the_noise_of_one_person_does_not_depend_on_another():
    noise = KeypointNoise()
    alone = KeypointCamera(CAMERA, Wall(), noise, np.random.default_rng(2))
    together = KeypointCamera(CAMERA, Wall(), noise, np.random.default_rng(2))
    alone.look(T_ODOM_CAMERA, [Body()])
    together.look(T_ODOM_CAMERA, [Body(), Body(y_m=0.8)])
    first = alone.estimate(None, alone.detect(None))[0]
    same = together.estimate(None, together.detect(None))[0]
    np.testing.assert_array_equal(first.keypoints_px, same.keypoints_px)


def test_foreign_detections_and_impossible_noise_are_refused():
    camera = KeypointCamera(CAMERA, Wall(), EXACT, np.random.default_rng(0))
    camera.look(T_ODOM_CAMERA, [Body()])
    (old,) = camera.detect(None)
    camera.look(T_ODOM_CAMERA, [Body()])
    with pytest.raises(SimError, match="detections"):
        camera.estimate(None, (old,))
    with pytest.raises(ValueError, match="miss_rate"):
        KeypointNoise(miss_rate=1.5)


def test_a_person_outside_the_field_of_view_is_not_detected():
    assert look(Body(x_m=-3.0))[0] == ()
    assert look(Body(x_m=1.0, y_m=4.0))[0] == ()
