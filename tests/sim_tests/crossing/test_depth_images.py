"""Range of people from rendered depth images: children, people who carry boxes, bad images."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import AwarenessPipeline, Camera, PerceptionError
from sim_tests.actors.body import Worker
from sim_tests.crossing.sensors import KeypointCamera, KeypointNoise
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
# Looking along odom x from a height of 1.2 m.
T_ODOM_CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1.0]])
BLANK = np.zeros((CAMERA.height_px, CAMERA.width_px, 3), np.uint8)
STATURES_M = (1.05, 1.3, 1.75, 1.9)


class Clear:
    """Nothing hides anybody."""

    def blocked(self, eye_odom_m, ends_odom_m, detail):
        return np.zeros(len(ends_odom_m), dtype=bool)


@pytest.fixture(scope="module")
def hall():
    with Warehouse(renderer="auto") as warehouse:
        yield warehouse


@pytest.fixture(scope="module")
def workers(hall):
    return {stature: Worker(hall, stature) for stature in STATURES_M}


class Look:
    """The view of an RGB-D camera of one person, and the truth."""

    def __init__(self, hall, worker, place_m, heading_rad, activity="none", seed=0):
        worker.place(place_m, heading_rad, 0.3, 1.0, activity=activity)
        self.truth_m = (worker.chest_odom_m - T_ODOM_CAMERA[:3, 3]) @ T_ODOM_CAMERA[:3, :3]
        camera = KeypointCamera(
            CAMERA, Clear(), KeypointNoise(miss_rate=0.0), np.random.default_rng(seed)
        )
        camera.look(T_ODOM_CAMERA, [worker])
        self.depth_m = CameraRenderer(hall).render(CAMERA, T_ODOM_CAMERA).depth_m
        self.trunk_px = camera.estimate(None, camera.detect(None))[0].keypoints_px[[5, 6, 11, 12]]
        self._pipeline = AwarenessPipeline(CAMERA, camera, camera)
        worker.place((hall.layout.x_min_m - 5.0, 0.0), 0.0)

    def seen(self, depth_m=None, **options):
        (person,) = self._pipeline.process(BLANK, 1.0, depth_m=depth_m, **options)
        return person

    def error(self, person):
        """Relative error of the range, and the squared Mahalanobis distance."""
        off = person.position_camera_m - self.truth_m
        ratio = np.linalg.norm(person.position_camera_m) / np.linalg.norm(self.truth_m)
        return ratio - 1.0, off @ np.linalg.solve(person.position_covariance_m2, off)


def sensed(depth_m, rng):
    """As a depth camera has it: a wrong scale, noise, holes, and a few pixels off."""
    noisy = depth_m * (1.0 + rng.normal(0.0, 0.01)) * (1.0 + rng.normal(0.0, 0.01, depth_m.shape))
    noisy[rng.random(depth_m.shape) < 0.25] = 0.0
    return np.roll(noisy, rng.integers(-2, 3, 2), (0, 1))


@pytest.mark.parametrize("stature_m", STATURES_M)
def test_a_depth_image_places_people_of_any_stature(hall, workers, stature_m):
    rng = np.random.default_rng(0)
    errors = []
    for number in range(8):
        away = rng.uniform(1.5, 5.5)
        place = away, rng.uniform(-0.2, 0.2) * away
        activity = "carry_box" if number % 4 == 0 else "none"
        look = Look(hall, workers[stature_m], place, rng.uniform(-3.1, 3.1), activity, number)
        errors.append(look.error(look.seen(sensed(look.depth_m, rng))))
    off, mahalanobis2 = np.abs(errors).T
    assert np.median(off) <= 0.03
    assert np.max(off) <= 0.08
    # 95 % of a normal error of three dimensions.
    assert np.mean(mahalanobis2 <= 7.81) >= 0.9


def test_without_depth_a_child_is_placed_too_far(hall, workers):
    look = Look(hall, workers[1.05], (3.0, 0.2), math.pi)
    assert look.error(look.seen())[0] > 0.5
    assert abs(look.error(look.seen(look.depth_m))[0]) < 0.03


def test_metres_and_millimetres_and_their_holes_give_the_same(hall, workers):
    look = Look(hall, workers[1.75], (3.0, 0.2), 2.0)
    metres = np.round(look.depth_m, 3)
    metres[::3] = np.nan
    millimetres = np.where(np.isfinite(metres), 1000.0 * metres, 0.0).round().astype(np.uint16)
    wanted = look.seen(metres).position_camera_m
    for other in (millimetres, metres.astype(np.float32), np.where(metres > 0.0, metres, -1.0)):
        assert look.seen(other).position_camera_m == pytest.approx(wanted, abs=1e-3)
    assert look.seen(metres, depth_stamp_s=1.04).position_camera_m == pytest.approx(wanted)


@pytest.mark.parametrize("hole", [0.0, np.nan, np.inf])
def test_an_image_of_holes_changes_nothing(hall, workers, hole):
    look = Look(hall, workers[1.75], (3.0, 0.2), 2.0)
    without, nothing = look.seen(), look.seen(np.full(look.depth_m.shape, hole))
    assert np.array_equal(without.position_camera_m, nothing.position_camera_m)
    assert np.array_equal(without.position_covariance_m2, nothing.position_covariance_m2)


def test_two_surfaces_on_the_chest_prove_nothing(hall, workers):
    look = Look(hall, workers[1.75], (3.0, 0.0), math.pi)
    depth = look.depth_m.copy()
    left, right = look.trunk_px[:, 0].min(), look.trunk_px[:, 0].max()
    depth[:, round(0.5 * (left + right)) :] = 1.0  # the edge of a shelf
    assert np.array_equal(look.seen(depth).position_camera_m, look.seen().position_camera_m)


@pytest.mark.parametrize(
    ("depth", "options", "message"),
    [
        ([[1.0]], {}, "must be an array of shape (480, 640), got list"),
        (np.ones((240, 320)), {}, "of the image's shape (480, 640)"),
        (np.ones((480, 640), np.uint8), {}, "or in millimetres (uint16), got uint8"),
        (np.full((480, 640), 2500.0), {}, "its median is 2500, which looks like millimetres"),
        (np.full((480, 640), 3, np.uint16), {}, "its median is 3, which looks like another unit"),
        (np.ones((480, 640)), {"depth_stamp_s": 1.2}, "got one +0.200 s from it"),
        (None, {"depth_stamp_s": 1.0}, "depth_stamp_s needs depth_m"),
    ],
)
def test_other_depth_images_are_refused(hall, workers, depth, options, message):
    look = Look(hall, workers[1.75], (3.0, 0.0), math.pi)
    with pytest.raises(PerceptionError) as refusal:
        look.seen(depth, **options)
    assert message in str(refusal.value)
