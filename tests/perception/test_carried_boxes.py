"""The detector looks at some images only; boxes follow the keypoints in between."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_people import person_at

from perception import (
    AwarenessPipeline,
    Camera,
    PerceptionError,
    PersonDetection,
    PersonKeypoints,
    PnpHeadPoseEstimator,
)
from perception._people_finder import SceneChanges

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
HALL = np.random.default_rng(3).integers(90, 130, (480, 640, 1)).astype(np.uint8)
RATE_HZ = 20.0


class World:
    """People who move, a detector and a pose network that see them, and pictures of them.

    A person is a function from time to (x, z, head yaw), or to None where nobody is.
    """

    def __init__(self, *people, camera_px_per_s=0.0):
        self.people = people
        self.camera_px_per_s = camera_px_per_s
        self.t_s = 0.0
        self.looks = []
        self.fails = False

    def present(self):
        states = [person(self.t_s) for person in self.people]
        return [
            person_at((state[0], 0.4, state[1]), head_yaw_rad=state[2])
            for state in states
            if state is not None
        ]

    @staticmethod
    def box(person):
        pixels = CAMERA.project(person.points_camera_m)
        pad = 0.08 * (pixels[:, 1].max() - pixels[:, 1].min())
        box = np.r_[pixels.min(axis=0) - pad, pixels.max(axis=0) + pad]
        return np.clip(box, 0.0, (640, 480, 640, 480))

    def image(self):
        shift = round(self.camera_px_per_s * self.t_s)
        image = np.repeat(np.roll(HALL, shift, axis=1), 3, axis=2)
        for person in self.present():
            left, top, right, bottom = self.box(person).astype(int)
            image[top:bottom, left:right] = 250
        return image

    def detect(self, image_rgb):
        self.looks.append(self.t_s)
        return tuple(PersonDetection(self.box(person), 0.9) for person in self.present())

    def estimate(self, image_rgb, detections):
        if self.fails:
            raise PerceptionError("no keypoints today")
        present = self.present()
        centres = [0.5 * (self.box(each)[:2] + self.box(each)[2:]) for each in present]
        found = []
        for detection in detections:
            box = detection.box_xyxy_px
            middle = 0.5 * (box[:2] + box[2:])
            off = [np.linalg.norm(centre - middle) for centre in centres]
            nearest = int(np.argmin(off)) if off else -1
            if nearest < 0 or off[nearest] > 0.5 * (box[2] - box[0]):
                flat = np.repeat(middle[None], 17, axis=0)
                found.append(PersonKeypoints(flat, np.zeros((17, 3)), np.zeros(17), "coco"))
                continue
            person = present[nearest]
            points = person.points_camera_m
            pixels = CAMERA.project(points)
            shown = ((pixels > 0.0) & (pixels < (639.0, 479.0))).all(axis=1)
            root = points[11:13].mean(axis=0)
            found.append(PersonKeypoints(pixels, points - root, shown.astype(float), "coco"))
        return tuple(found)

    def run(self, pipeline, frames, rate_hz=RATE_HZ):
        """Process frames; return the observations of each."""
        seen = []
        for index in range(frames):
            self.t_s = index / rate_hz
            seen.append(pipeline.process(self.image(), self.t_s))
        return seen


def pipeline(world, every_s):
    return AwarenessPipeline(CAMERA, world, world, detect_every_s=every_s)


def walker(t_s):
    """Walk to the right at 1.4 m/s, 4 m ahead, and turn the head."""
    return -1.0 + 1.4 * t_s, 4.0, 0.8 * math.sin(3.0 * t_s)


def stander(t_s):
    return 1.2, 4.0, 0.0


def test_between_looks_boxes_follow_and_awareness_is_of_the_same_image():
    often, seldom = World(walker), World(walker)
    wanted = often.run(pipeline(often, 0.0), 25)
    found = seldom.run(pipeline(seldom, 0.15), 25)
    assert len(often.looks) == 25
    assert len(seldom.looks) == 9
    for index, ((expected,), (carried,)) in enumerate(zip(wanted, found, strict=True)):
        # The velocity is known from the second image on; until then the box lags 10 px behind.
        tolerance = 11.0 if index < 2 else 1.0
        np.testing.assert_allclose(carried.box_xyxy_px, expected.box_xyxy_px, atol=tolerance)
        # Box and score are all that is carried.
        assert carried.awareness == pytest.approx(expected.awareness, abs=1e-12)
        np.testing.assert_allclose(carried.gaze_camera, expected.gaze_camera, atol=1e-12)
        assert carried.stamp_s == expected.stamp_s
    assert len({round(each.awareness, 3) for (each,) in found}) > 15


@settings(max_examples=5, deadline=None)
@given(st.floats(5.0, 100.0), st.floats(0.01, 0.2), st.sampled_from([(), (stander,)]))
def test_two_looks_are_never_farther_apart_than_asked(rate_hz, every_s, people):
    world = World(*people)
    count = 12
    world.run(pipeline(world, every_s), count, rate_hz)
    gaps = np.diff([*world.looks, (count - 1) / rate_hz])
    assert gaps.max() <= max(every_s, 1.0 / rate_hz) + 1e-6
    # And not more often than needed: one image earlier at most.
    if every_s > 2.0 / rate_hz:
        assert gaps[:-1].min(initial=np.inf) > every_s - 1.0 / rate_hz - 1e-6


@pytest.mark.parametrize("camera_px_per_s", [0.0, 300.0])
@pytest.mark.parametrize("start_s", [0.05, 0.31, 0.449])
def test_a_newcomer_is_found_at_once_or_in_the_time_asked_if_the_camera_moves(
    start_s, camera_px_per_s
):
    world = World(
        stander,
        lambda t_s: None if t_s < start_s else (-1.2, 4.0, 0.0),
        camera_px_per_s=camera_px_per_s,
    )
    seen = world.run(pipeline(world, 0.2), 20)
    assert len(world.looks) < 10
    late_s = [i / RATE_HZ for i, people in enumerate(seen) if len(people) < 2]
    assert max(late_s) < start_s + (0.2 if camera_px_per_s else 0.0)


def test_nobody_is_reported_who_is_gone():
    class Heads(PnpHeadPoseEstimator):
        def estimate(self, image_rgb, camera, people):
            assert people, "heads of nobody"
            return super().estimate(image_rgb, camera, people)

    for others in ((stander,), ()):
        world = World(*others, lambda t_s: (-1.2, 4.0, 0.0) if t_s < 0.32 else None)
        pipe = AwarenessPipeline(CAMERA, world, world, Heads(), detect_every_s=0.2)
        seen = world.run(pipe, 14)
        wanted = [(1 if i / RATE_HZ < 0.32 else 0) + len(others) for i in range(14)]
        assert [len(people) for people in seen] == wanted
        assert all(each.awareness is not None for people in seen for each in people)


def test_people_who_overlap_are_detected_in_every_image():
    # They cross between 0.6 and 1.4 s.
    world = World(lambda t_s: (-1.0 + 1.0 * t_s, 3.5, 0.0), lambda t_s: (1.0 - 1.0 * t_s, 4.5, 0.0))
    world.run(pipeline(world, 0.2), 41)
    during = [t_s for t_s in world.looks if 0.75 <= t_s <= 1.25]
    assert len(during) == 11
    assert len(world.looks) < 41


def test_somebody_of_whom_too_little_is_seen_is_not_carried():
    # 0.45 m ahead, only the trunk is in the image.
    world = World(lambda t_s: (0.0, 0.45, 0.0))
    world.run(pipeline(world, 0.2), 8)
    assert len(world.looks) == 8


@pytest.mark.parametrize("jump_s", [0.5, 60.0, -0.05, -3.0, 0.0])
def test_after_a_jump_in_time_the_detector_looks(jump_s):
    world = World(stander)
    pipe = pipeline(world, 0.2)
    world.run(pipe, 2)
    count = len(world.looks)
    pipe.process(world.image(), world.t_s + jump_s)
    assert len(world.looks) == count + 1


def test_after_another_scene_and_after_a_failure_the_detector_looks():
    world = World(stander)
    pipe = pipeline(world, 0.2)
    world.run(pipe, 2)
    count = len(world.looks)
    world.fails = True
    with pytest.raises(PerceptionError, match="today"):
        pipe.process(world.image(), 0.1)
    world.fails = False
    assert len(pipe.process(world.image(), 0.15)) == 1
    assert len(world.looks) == count + 1
    pipe.process(255 - world.image(), 0.2)
    assert len(world.looks) == count + 2


def changed(image, boxes=(), reference=None):
    changes = SceneChanges()
    changes.refer_to(np.repeat(HALL, 3, axis=2) if reference is None else reference)
    return changes.found_in(image, boxes)


@pytest.mark.parametrize("noise", [0.0, 2.0, 4.0])
def test_noise_and_light_are_no_change(noise):
    rng = np.random.default_rng(int(noise))
    image = np.repeat(HALL, 3, axis=2)
    for light in (0, 3):
        noisy = np.clip(image + light + rng.normal(0.0, noise, image.shape), 0, 255)
        assert not changed(noisy.astype(np.uint8), reference=image)


@pytest.mark.parametrize("size", [(1080, 1920, 3), (51, 37, 3)])
def test_a_person_sized_change_counts_unless_it_is_in_a_box(size):
    height, width = size[:2]
    reference = np.full(size, 90, np.uint8)
    image = reference.copy()
    left, right = round(0.4 * width), round(0.52 * width)
    top, bottom = round(0.3 * height), round(0.8 * height)
    image[top:bottom, left:right] = 180
    assert changed(image, reference=reference)
    assert not changed(image, [np.array([left, top, right, bottom])], reference)
