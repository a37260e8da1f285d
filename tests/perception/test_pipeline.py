"""The awareness pipeline with estimators whose errors are known, and the types it returns."""

import math

import numpy as np
import pytest
from synthetic_people import Given, person_at

from perception import (
    AttentionCone,
    AwarenessPipeline,
    Camera,
    FloorPlane,
    HeadPose,
    PerceptionError,
    PersonDetection,
)
from perception.eyes import EyeGaze

CAMERA = Camera.from_fov(1280, 960, math.radians(60.0))
FRAME = np.zeros((960, 1280, 3), np.uint8)


def known(*people, noise_px=1.0, seen=None):
    """Return a detector and pose estimator for people, with errors of pixels and depths."""
    rng = np.random.default_rng(0)
    boxes = [CAMERA.project(person.points_camera_m) for person in people]
    return Given(
        [person.keypoints(CAMERA, noise_px, rng, lift_std_m=0.02, seen=seen) for person in people],
        [PersonDetection(np.r_[each.min(axis=0), each.max(axis=0)], 0.9) for each in boxes],
    )


def processed(networks, stamp_s=0.0, floor=None, **options):
    pipeline = AwarenessPipeline(CAMERA, networks, networks, **options)
    return pipeline.process(FRAME, stamp_s, floor=floor)


def test_several_people_have_position_gaze_and_awareness_each():
    people = [
        person_at((-1.0, 0.4, 3.5), head_yaw_rad=0.2),
        person_at((0.4, 0.4, 2.5), body_yaw_rad=0.8, head_yaw_rad=0.3),
        person_at((1.5, 0.4, 6.0), body_yaw_rad=-0.6),
    ]
    seen = processed(known(*people), 12.5)
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


def test_a_person_who_looks_at_any_point_of_the_robot_is_aware():
    person = person_at((0.0, 0.4, 3.0), head_yaw_rad=math.radians(50.0))
    networks = known(person, noise_px=0.0)
    (camera_only,) = processed(networks)
    gaze = person.rotation_camera_head[:, 1]
    looked_at = person.eyes_camera_m + 2.0 * gaze
    (two_points,) = processed(networks, robot_points_camera_m=[[0, 0, 0], looked_at])
    assert camera_only.awareness < 0.4
    assert two_points.awareness > 0.95


def test_a_head_of_unknown_direction_is_no_evidence_unless_it_shows_no_face():
    person = person_at((0.0, 0.4, 3.0))
    covariance = np.diag([math.radians(30.0) ** 2] * 3 + [0.01**2] * 3)
    observed = []
    for seen in (0.9, 0.01):
        head = HeadPose((0.0, -0.1, 3.0), person.rotation_camera_head, covariance, 0.0, seen)
        observed += processed(known(person), head_pose_estimator=Given((), heads=(head,)))
    face, back = observed
    assert face.awareness is face.awareness_std is face.gaze_camera is back.gaze_camera is None
    assert face.awareness_reason == "head direction unknown"
    assert back.awareness == pytest.approx(0.0, abs=0.01)
    assert back.awareness_std < 0.1
    np.testing.assert_array_equal(face.position_camera_m, back.position_camera_m)


def test_a_floor_improves_the_range_and_may_be_given_per_frame():
    errors = []
    camera_height_m = 1.25
    floor = FloorPlane([0.0, -1.0, 0.0], camera_height_m)
    for stature in (1.55, 1.95):
        scale = stature / 1.83
        person = person_at((0.0, camera_height_m - 0.93 * scale, 4.5), stature_m=stature)
        rng = np.random.default_rng(0)
        networks = Given([person.keypoints(CAMERA, 1.0, rng, unit=1.0 / stature)])
        ((without,), (per_frame,)) = (processed(networks, floor=each) for each in (None, floor))
        pipeline = AwarenessPipeline(CAMERA, networks, networks, floor=floor)
        (constant,) = pipeline.process(FRAME, 0.0)
        np.testing.assert_array_equal(constant.position_camera_m, per_frame.position_camera_m)
        errors.append(
            [
                np.linalg.norm(seen.position_camera_m - person.chest_camera_m)
                for seen in (without, per_frame)
            ]
        )
    assert all(with_floor < 0.6 * without_floor for without_floor, with_floor in errors)


def test_an_estimator_with_too_few_results_is_named():
    found = known(person_at((0.0, 0.4, 3.0)))
    with pytest.raises(PerceptionError, match="pose_estimator"):
        processed(Given((), found.detections))


# --- eyes ---------------------------------------------------------------------------------------


class KnownEyes:
    """An eye estimator that gives the same measurement for everybody, and keeps what it got."""

    def __init__(self, eyes):
        self.eyes = eyes

    def estimate(self, image_rgb, camera, heads, people):
        self.heads = heads
        return (self.eyes,) * len(heads)


def seen_with(eye_estimator):
    people = [person_at((0.0, 0.4, 1.8), head_yaw_rad=0.2), person_at((0.9, 0.4, 2.5))]
    return processed(known(*people), eye_estimator=eye_estimator)


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
        def estimate(self, image_rgb, camera, heads, people):
            return ()

    with pytest.raises(PerceptionError, match=r"eye_estimator must return one result per person"):
        seen_with(TooFew(None))
    with pytest.raises(PerceptionError, match=r"eye_estimator must have the method estimate"):
        seen_with(object())
