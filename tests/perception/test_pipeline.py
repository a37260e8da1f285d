import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_people import person_at

from perception import (
    AttentionCone,
    AwarenessPipeline,
    Camera,
    HeadPose,
    PerceptionError,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
)
from perception._floor import FloorPlane
from perception.networks import NETWORK_TIME

CAMERA = Camera.from_fov(1280, 960, math.radians(60.0))
FRAME = np.zeros((960, 1280, 3), np.uint8)


class Eyes:
    """A detector and pose estimator that know the people in front of the camera."""

    def __init__(self, people, noise_px=1.0, seed=0, seen=None):
        self.people = people
        self.noise_px = noise_px
        self.rng = np.random.default_rng(seed)
        self.seen = seen

    def detect(self, image_rgb):
        boxes = []
        for person in self.people:
            pixels = CAMERA.project(person.points_camera_m)
            boxes.append(PersonDetection(np.r_[pixels.min(axis=0), pixels.max(axis=0)], 0.9))
        return tuple(boxes)

    def estimate(self, image_rgb, detections):
        return tuple(
            person.keypoints(CAMERA, self.noise_px, self.rng, lift_std_m=0.02, seen=self.seen)
            for person in self.people
        )


def pipeline(eyes, **options):
    return AwarenessPipeline(CAMERA, eyes, eyes, **options)


def test_many_people_each_with_position_gaze_and_awareness():
    people = [
        person_at((-1.0, 0.4, 3.5), head_yaw_rad=0.2),
        person_at((0.4, 0.4, 2.5), body_yaw_rad=0.8, head_yaw_rad=0.3),
        person_at((1.5, 0.4, 6.0), body_yaw_rad=-0.6),
    ]
    seen = pipeline(Eyes(people)).process(FRAME, 12.5)
    assert len(seen) == 3
    for person, observation in zip(people, seen, strict=True):
        assert observation.stamp_s == 12.5
        distance = np.linalg.norm(person.chest_camera_m)
        error = np.linalg.norm(observation.position_camera_m - person.chest_camera_m)
        assert error < 0.05 * distance
        gaze = person.rotation_camera_head[:, 1]
        truth = AttentionCone().score(person.eyes_camera_m, gaze, np.zeros(3))
        assert observation.awareness == pytest.approx(truth, abs=0.15)
        assert abs(observation.awareness - truth) < 4.0 * observation.awareness_std + 0.02
        assert observation.gaze_camera @ gaze > math.cos(math.radians(15.0))
        assert observation.box_xyxy_px is not None


def test_position_is_the_body_and_not_the_nose():
    person = person_at((0.0, 0.4, 3.0), body_yaw_rad=math.pi / 2)
    (seen,) = pipeline(Eyes([person], noise_px=0.0)).process(FRAME, 0.0)
    nose = person.points_camera_m[0]
    assert np.linalg.norm(seen.position_camera_m - person.chest_camera_m) < 0.1
    assert np.linalg.norm(seen.position_camera_m - nose) > 0.25


def test_no_face_is_no_evidence_and_never_aware():
    person = person_at((0.0, 0.4, 3.0))
    hidden = np.r_[np.zeros(5), np.ones(12)]
    (seen,) = pipeline(Eyes([person], seen=hidden)).process(FRAME, 0.0)
    assert seen.awareness is None
    assert seen.awareness_std is None
    assert seen.gaze_camera is None


def test_a_person_without_usable_keypoints_is_still_an_obstacle():
    person = person_at((0.5, 0.4, 4.0))
    (seen,) = pipeline(Eyes([person], seen=np.zeros(17))).process(FRAME, 0.0)
    assert seen.awareness is None
    assert np.linalg.norm(seen.position_camera_m - person.chest_camera_m) < 1.5
    assert np.sqrt(seen.position_covariance_m2[2, 2]) > 0.5


def test_any_point_of_the_robot_counts():
    person = person_at((0.0, 0.4, 3.0), head_yaw_rad=math.radians(50.0))
    eyes = Eyes([person], noise_px=0.0)
    (camera_only,) = pipeline(eyes).process(FRAME, 0.0)
    gaze = person.rotation_camera_head[:, 1]
    looked_at = person.eyes_camera_m + 2.0 * gaze
    (anywhere,) = pipeline(eyes, robot_points_camera_m=[[0, 0, 0], looked_at]).process(FRAME, 0.0)
    assert camera_only.awareness < 0.4
    assert anywhere.awareness > 0.95


def test_nobody_is_an_empty_result():
    assert pipeline(Eyes([])).process(FRAME, 0.0) == ()


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (None, "NoneType"),
        (np.zeros((960, 1280), np.uint8), "shape"),
        (np.zeros((960, 1280, 3), np.float32), "float32"),
        (np.zeros((0, 0, 3), np.uint8), "shape"),
        (np.zeros((480, 640, 3), np.uint8), r"\(960, 1280, 3\)"),
    ],
)
def test_unusable_images_are_refused(image, message):
    with pytest.raises(PerceptionError, match=message):
        pipeline(Eyes([])).process(image, 0.0)


def test_a_clock_without_a_time_is_refused():
    with pytest.raises(PerceptionError, match="stamp_s"):
        pipeline(Eyes([])).process(FRAME, math.nan)


def test_parts_that_are_none_are_named():
    for change, name in [
        ({"robot_points_camera_m": np.empty((0, 3))}, "robot_points_camera_m"),
        ({"floor": 1.2}, "floor must be a FloorPlane"),
        ({"eye_in_head_std_rad": -0.1}, "eye_in_head_std_rad"),
        ({"eye_in_head_std_rad": (0.1, 0.1, 0.1)}, "eye_in_head_std_rad"),
        ({"keypoint_std_px": 0.0}, "keypoint_std_px"),
        ({"min_score": 1.5}, "min_score"),
    ]:
        with pytest.raises(PerceptionError, match=name):
            pipeline(Eyes([]), **change)
    with pytest.raises(PerceptionError, match="floor must be a FloorPlane"):
        pipeline(Eyes([])).process(FRAME, 0.0, floor="z = 0")


def test_without_networks_of_its_own_it_runs_the_shipped_ones():
    seen = AwarenessPipeline(CAMERA).process(FRAME, 0.0)
    assert all(person.awareness is None or person.awareness_std is not None for person in seen)


def test_the_backs_of_heads_are_surely_unaware():
    person = person_at((0.0, 0.4, 3.0), body_yaw_rad=math.pi)
    ears_only = np.r_[np.zeros(3), np.ones(14)]
    (seen,) = pipeline(Eyes([person], seen=ears_only)).process(FRAME, 0.0)
    assert seen.awareness == 0.0
    assert seen.awareness_std < 0.05


def test_wandering_eyes_widen_alpha_and_leave_it_where_it_is():
    person = person_at((0.0, 0.4, 2.5), head_yaw_rad=math.radians(25.0))
    steady, wandering = (
        pipeline(Eyes([person]), eye_in_head_std_rad=std).process(FRAME, 0.0)[0]
        for std in (0.0, (math.radians(15.0), math.radians(10.0)))
    )
    assert steady.awareness == wandering.awareness
    assert wandering.awareness_std > 1.5 * steady.awareness_std


def test_a_floor_helps_with_range_and_each_frame_may_bring_its_own():
    rng_error = []
    camera_height_m = 1.25
    floor = FloorPlane([0.0, -1.0, 0.0], camera_height_m)
    for stature in (1.55, 1.95):
        scale = stature / 1.83
        person = person_at((0.0, camera_height_m - 0.93 * scale, 4.5), stature_m=stature)
        eyes = Eyes([person])
        eyes.estimate = lambda image, found, person=person, stature=stature: (
            person.keypoints(CAMERA, 1.0, np.random.default_rng(0), unit=1.0 / stature),
        )
        (without,) = pipeline(eyes).process(FRAME, 0.0)
        (always,) = pipeline(eyes, floor=floor).process(FRAME, 0.0)
        (now,) = pipeline(eyes).process(FRAME, 0.0, floor=floor)
        np.testing.assert_array_equal(always.position_camera_m, now.position_camera_m)
        blind, floored = (
            np.linalg.norm(seen.position_camera_m - person.chest_camera_m)
            for seen in (without, now)
        )
        rng_error.append((blind, floored))
    assert all(floored < 0.6 * blind for blind, floored in rng_error)


def test_timings_add_up_and_are_of_the_last_frame():
    person = person_at((0.0, 0.4, 3.0))
    eyes = Eyes([person])
    line = pipeline(eyes)
    assert line.last_timings.total_s == 0.0
    line.process(FRAME, 0.0)
    timings = line.last_timings
    parts = (timings.detector_s, timings.pose_s, timings.head_pose_s, timings.rest_s)
    assert min(parts) > 0.0
    assert timings.total_s == pytest.approx(sum(parts))
    eyes.people = []
    line.process(FRAME, 0.1)
    assert line.last_timings.head_pose_s == 0.0


def test_the_runs_of_networks_are_told_from_the_rest():
    class Slow(Eyes):
        def detect(self, image_rgb):
            NETWORK_TIME.elapsed_s += 0.015  # as a network would that took that long
            return super().detect(image_rgb)

    person = person_at((0.0, 0.4, 3.0))
    eyes = Slow([person])
    line = pipeline(eyes)
    assert line.last_timings.networks_s == 0.0
    for people in ([person], [person], []):  # of each frame, not of all so far
        eyes.people = people
        line.process(FRAME, 0.0)
        timings = line.last_timings
        assert timings.networks_s == pytest.approx(0.015)
        assert timings.outside_s == pytest.approx(timings.total_s - 0.015)


def test_an_estimator_that_loses_people_is_named():
    class Forgetful(Eyes):
        def estimate(self, image_rgb, detections):
            return super().estimate(image_rgb, detections)[1:]

    with pytest.raises(PerceptionError, match="pose_estimator"):
        pipeline(Forgetful([person_at((0.0, 0.4, 3.0))])).process(FRAME, 0.0)


def observation(**change):
    fields = {
        "stamp_s": 0.0,
        "position_camera_m": [0, 0, 1],
        "position_covariance_m2": np.eye(3),
        "gaze_camera": None,
        "awareness": None,
        "awareness_std": None,
        "score": 1.0,
        "box_xyxy_px": None,
    }
    return PersonObservation(**(fields | change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stamp_s": math.inf}, "stamp_s"),
        ({"position_camera_m": [0, math.nan, 1]}, "position_camera_m"),
        ({"position_camera_m": [0, 1]}, r"position_camera_m must have shape \(3,\)"),
        ({"position_covariance_m2": -np.eye(3)}, "semi-definite"),
        ({"position_covariance_m2": np.triu(np.ones((3, 3)))}, "symmetric"),
        ({"gaze_camera": [0, 0, 2]}, "unit vector"),
        ({"awareness": 1.2, "awareness_std": 0.1}, "awareness"),
        ({"awareness": 0.5}, "awareness_std"),
        ({"score": -0.1}, "score"),
        ({"score": "high"}, "score"),
    ],
)
def test_observations_refuse_bad_fields_by_name(change, message):
    with pytest.raises(PerceptionError, match=message):
        observation(**change)


def test_seam_types_keep_their_own_locked_copy():
    position = np.array([0.0, 0.0, 1.0])
    seen = observation(position_camera_m=position)
    position[2] = 9.0
    assert seen.position_camera_m[2] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        seen.position_camera_m[2] = 5.0


def test_head_pose_and_keypoints_refuse_what_is_not_one():
    flipped = np.diag([1.0, 1.0, -1.0])
    with pytest.raises(PerceptionError, match="rotation_camera_head"):
        HeadPose([0, 0, 1], flipped, np.eye(6), 0.0)
    good = HeadPose([0, 0, 1], Rotation.random(random_state=0).as_matrix(), np.eye(6), 0.0)
    assert np.linalg.norm(good.gaze_camera) == pytest.approx(1.0)
    with pytest.raises(PerceptionError, match="layout"):
        PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), np.zeros(17), "halpe")
    with pytest.raises(PerceptionError, match="keypoints_px"):
        PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), np.zeros(133), "coco_wholebody")
    with pytest.raises(PerceptionError, match="right >= left"):
        PersonDetection([10, 0, 5, 5], 0.5)
