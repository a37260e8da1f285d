"""The awareness pipeline with estimators whose errors are known, and the types it returns."""

import math

import numpy as np
import pytest
from synthetic_people import person_at

from perception import (
    AttentionCone,
    AwarenessPipeline,
    Camera,
    FloorPlane,
    HeadPose,
    PerceptionError,
    PersonDetection,
    PersonObservation,
)
from perception.eyes import EyeGaze

CAMERA = Camera.from_fov(1280, 960, math.radians(60.0))
FRAME = np.zeros((960, 1280, 3), np.uint8)


class KnownPeople:
    """A detector and pose estimator for given people."""

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


def pipeline(known, **options):
    return AwarenessPipeline(CAMERA, known, known, **options)


def test_several_people_have_position_gaze_and_awareness_each():
    people = [
        person_at((-1.0, 0.4, 3.5), head_yaw_rad=0.2),
        person_at((0.4, 0.4, 2.5), body_yaw_rad=0.8, head_yaw_rad=0.3),
        person_at((1.5, 0.4, 6.0), body_yaw_rad=-0.6),
    ]
    seen = pipeline(KnownPeople(people)).process(FRAME, 12.5)
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


def test_the_position_is_that_of_the_body_and_not_of_the_nose():
    person = person_at((0.0, 0.4, 3.0), body_yaw_rad=math.pi / 2)
    (seen,) = pipeline(KnownPeople([person], noise_px=0.0)).process(FRAME, 0.0)
    nose = person.points_camera_m[0]
    assert np.linalg.norm(seen.position_camera_m - person.chest_camera_m) < 0.1
    assert np.linalg.norm(seen.position_camera_m - nose) > 0.25


def test_a_head_that_is_not_seen_gives_no_evidence():
    person = person_at((0.0, 0.4, 3.0))
    hidden = np.r_[np.zeros(5), np.ones(12)]
    (seen,) = pipeline(KnownPeople([person], seen=hidden)).process(FRAME, 0.0)
    assert seen.awareness is None
    assert seen.awareness_std is None
    assert seen.gaze_camera is None


def test_a_person_without_usable_keypoints_still_has_a_position():
    person = person_at((0.5, 0.4, 4.0))
    (seen,) = pipeline(KnownPeople([person], seen=np.zeros(17))).process(FRAME, 0.0)
    assert seen.awareness is None
    assert np.linalg.norm(seen.position_camera_m - person.chest_camera_m) < 1.5
    assert np.sqrt(seen.position_covariance_m2[2, 2]) > 0.5


def test_a_person_who_looks_at_any_point_of_the_robot_is_aware():
    person = person_at((0.0, 0.4, 3.0), head_yaw_rad=math.radians(50.0))
    known = KnownPeople([person], noise_px=0.0)
    (camera_only,) = pipeline(known).process(FRAME, 0.0)
    gaze = person.rotation_camera_head[:, 1]
    looked_at = person.eyes_camera_m + 2.0 * gaze
    (two_points,) = pipeline(known, robot_points_camera_m=[[0, 0, 0], looked_at]).process(
        FRAME, 0.0
    )
    assert camera_only.awareness < 0.4
    assert two_points.awareness > 0.95


def test_the_back_of_a_head_is_unaware_with_certainty():
    person = person_at((0.0, 0.4, 3.0), body_yaw_rad=math.pi)
    ears_only = np.r_[np.zeros(3), np.ones(14)]
    (seen,) = pipeline(KnownPeople([person], seen=ears_only)).process(FRAME, 0.0)
    assert seen.awareness == 0.0
    assert seen.awareness_std < 0.05


class UnsureHeads:
    """A head pose network whose direction is off by up to 30°."""

    def __init__(self, face_seen):
        self.face_seen = face_seen

    def estimate(self, image_rgb, camera, people):
        rotation = person_at((0.0, 0.4, 3.0)).rotation_camera_head
        covariance = np.diag([math.radians(30.0) ** 2] * 3 + [0.01**2] * 3)
        pose = HeadPose((0.0, -0.1, 3.0), rotation, covariance, 0.0, self.face_seen)
        return tuple(pose for _ in people)


def test_a_head_of_unknown_direction_is_no_evidence_unless_it_shows_no_face():
    face, back = (
        pipeline(
            KnownPeople([person_at((0.0, 0.4, 3.0))]), head_pose_estimator=UnsureHeads(seen)
        ).process(FRAME, 0.0)[0]
        for seen in (0.9, 0.01)
    )
    assert face.awareness is face.awareness_std is face.gaze_camera is back.gaze_camera is None
    assert face.awareness_reason == "head direction unknown"
    assert back.awareness == pytest.approx(0.0, abs=0.01)
    assert back.awareness_std < 0.1
    np.testing.assert_array_equal(face.position_camera_m, back.position_camera_m)


def test_eye_movements_increase_the_standard_deviation_and_do_not_change_alpha():
    person = person_at((0.0, 0.4, 2.5), head_yaw_rad=math.radians(25.0))
    steady, wandering = (
        pipeline(KnownPeople([person]), eye_in_head_std_rad=std).process(FRAME, 0.0)[0]
        for std in (0.0, (math.radians(15.0), math.radians(10.0)))
    )
    assert steady.awareness == wandering.awareness
    assert wandering.awareness_std > 1.5 * steady.awareness_std


def test_a_floor_improves_the_range_and_may_be_given_per_frame():
    errors = []
    camera_height_m = 1.25
    floor = FloorPlane([0.0, -1.0, 0.0], camera_height_m)
    for stature in (1.55, 1.95):
        scale = stature / 1.83
        person = person_at((0.0, camera_height_m - 0.93 * scale, 4.5), stature_m=stature)
        known = KnownPeople([person])
        known.estimate = lambda image, found, person=person, stature=stature: (
            person.keypoints(CAMERA, 1.0, np.random.default_rng(0), unit=1.0 / stature),
        )
        (without,) = pipeline(known).process(FRAME, 0.0)
        (constant,) = pipeline(known, floor=floor).process(FRAME, 0.0)
        (per_frame,) = pipeline(known).process(FRAME, 0.0, floor=floor)
        np.testing.assert_array_equal(constant.position_camera_m, per_frame.position_camera_m)
        errors.append(
            [
                np.linalg.norm(seen.position_camera_m - person.chest_camera_m)
                for seen in (without, per_frame)
            ]
        )
    assert all(with_floor < 0.6 * without_floor for without_floor, with_floor in errors)


def test_an_estimator_with_too_few_results_is_named():
    class LosesOne(KnownPeople):
        def estimate(self, image_rgb, detections):
            return super().estimate(image_rgb, detections)[1:]

    with pytest.raises(PerceptionError, match="pose_estimator"):
        pipeline(LosesOne([person_at((0.0, 0.4, 3.0))])).process(FRAME, 0.0)


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


def test_observations_keep_a_read_only_copy_of_arrays():
    position = np.array([0.0, 0.0, 1.0])
    seen = observation(position_camera_m=position)
    position[2] = 9.0
    assert seen.position_camera_m[2] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        seen.position_camera_m[2] = 5.0


# --- eyes ---------------------------------------------------------------------------------------


class KnownEyes:
    """An eye estimator that gives the same measurement for everybody, and keeps what it got."""

    def __init__(self, eyes):
        self.eyes = eyes

    def estimate(self, image_rgb, camera, heads):
        self.heads = heads
        return (self.eyes,) * len(heads)


def seen_with(eye_estimator, **options):
    people = [person_at((0.0, 0.4, 1.8), head_yaw_rad=0.2), person_at((0.9, 0.4, 2.5))]
    known = pipeline(KnownPeople(people), eye_estimator=eye_estimator, **options)
    return known.process(FRAME, 0.0)


def test_measured_eyes_turn_the_gaze_and_awareness_follows():
    sure = EyeGaze([math.radians(10.0), 0.0], np.eye(2) * 1e-8)
    alone, turned = seen_with(None), seen_with(KnownEyes(sure))
    for before, after in zip(alone, turned, strict=True):
        assert (before.eyes_seen, after.eyes_seen) == (False, True)
        angle = math.acos(float(before.gaze_camera @ after.gaze_camera))
        assert angle == pytest.approx(math.radians(10.0), abs=1e-3)
        # To the person's left, the image's right.
        assert after.gaze_camera[0] > before.gaze_camera[0]
        assert np.array_equal(before.position_camera_m, after.position_camera_m)
        assert after.awareness_std < before.awareness_std
    # Both heads point past the camera's right already.
    assert turned[0].awareness < alone[0].awareness


@pytest.mark.parametrize("eyes", [None, EyeGaze([0.9, 0.0], np.eye(2) * 1e-4)])
def test_without_a_credible_measurement_nothing_changes_to_the_bit(eyes):
    for before, after in zip(seen_with(None), seen_with(KnownEyes(eyes)), strict=True):
        assert not after.eyes_seen
        assert np.array_equal(before.gaze_camera, after.gaze_camera)
        assert (before.awareness, before.awareness_std) == (after.awareness, after.awareness_std)


def test_an_eye_estimator_gets_one_head_per_person_and_returns_as_many():
    estimator = KnownEyes(None)
    assert len(seen_with(estimator)) == len(estimator.heads) == 2
    assert all(isinstance(head, HeadPose) for head in estimator.heads)

    class TooFew(KnownEyes):
        def estimate(self, image_rgb, camera, heads):
            return ()

    with pytest.raises(PerceptionError, match=r"eye_estimator must return one result per person"):
        seen_with(TooFew(None))
    with pytest.raises(PerceptionError, match=r"eye_estimator must have the method estimate"):
        seen_with(object())
