"""Keypoints confirm or refute what the detector found."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_people import person_at

from perception import (
    AwarenessPipeline,
    Camera,
    PersonDetection,
    PersonKeypoints,
    PnpHeadPoseEstimator,
)
from perception.confirmation import KeypointConfirmation
from perception.ownership import FoundPerson

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
FRAME = np.zeros((480, 640, 3), np.uint8)
RULE = KeypointConfirmation()
NEUTRAL, CERTAIN, WEIGHT, MOST = 0.4, 0.4, 3.0, 8
probabilities = st.floats(0.0, 1.0)


def detection(score, box=(10.0, 10.0, 60.0, 200.0)):
    return PersonDetection(np.array(box), score)


def keypoints(*scores):
    """Keypoints with 17 scores, or one for all of them."""
    values = np.full(17, scores[0]) if len(scores) == 1 else np.array(scores)
    return PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), values, "coco")


@given(probabilities, probabilities, probabilities, probabilities)
def test_the_score_grows_with_the_detectors_and_with_the_keypoints(first, second, low, high):
    first, second = sorted((first, second))
    low, high = sorted((low, high))
    least = RULE.score(detection(first), keypoints(low))
    assert 0.0 <= least <= RULE.score(detection(second), keypoints(low)) <= 1.0
    assert least <= RULE.score(detection(first), keypoints(high))


@given(
    st.floats(0.01, CERTAIN - 1e-6), st.floats(0.01, 0.99), st.just(NEUTRAL) | st.floats(0.01, 0.99)
)
def test_the_odds_are_multiplied(score, seen, neutral):
    found = KeypointConfirmation(neutral=neutral).score(detection(score), keypoints(seen))

    def odds(probability):
        return probability / (1.0 - probability)

    wanted = odds(score) * (odds(seen) / odds(neutral)) ** WEIGHT
    assert found == pytest.approx(wanted / (1.0 + wanted), rel=1e-6, abs=1e-9)


def test_four_hidden_keypoints_do_not_count():
    half = keypoints(*[0.0] * 4, *[0.8] * 13)
    assert RULE.score(detection(0.3), half) == RULE.score(detection(0.3), keypoints(0.8))


@given(st.floats(CERTAIN, 1.0), probabilities)
def test_a_certain_detection_is_kept_whatever_the_keypoints_say(score, seen):
    (kept,) = RULE.confirmed([FoundPerson(detection(score), keypoints(seen), None)])
    assert kept.detection.score >= RULE.score_threshold


def kept_rows(detections, people, reasons):
    """Return the rows of the detections that are people."""
    found = [FoundPerson(*each) for each in zip(detections, people, reasons, strict=True)]
    kept = [one.keypoints for one in RULE.confirmed(found)]
    return [row for row, person in enumerate(people) if any(person is each for each in kept)]


def test_candidates_of_the_detector_need_good_keypoints_of_their_own():
    found = [detection(0.1, (100.0 * k, 0.0, 100.0 * k + 50.0, 200.0)) for k in range(3)]
    people = [keypoints(0.8), keypoints(0.3), keypoints(0.8)]
    assert kept_rows(found, people, [None, None, "no body has such limbs"]) == [0]
    assert RULE.score(found[0], people[0]) > 0.5
    # What the detector reports by itself stays without an owner of its skeleton, as before.
    strong = [detection(0.3)]
    assert kept_rows(strong, [keypoints(0.8)], ["no body has such limbs"]) == [0]


def test_a_part_of_a_better_person_is_nobody_of_its_own():
    whole = detection(0.6, (100.0, 100.0, 200.0, 400.0))
    trunk = (120.0, 110.0, 190.0, 250.0)
    good = [keypoints(0.7), keypoints(0.7)]
    assert kept_rows([detection(0.1, trunk), whole], good, [None, None]) == [1]
    assert kept_rows([whole, detection(0.3, trunk)], good, [None, None]) == [0, 1]
    shared = [None, "head of another person"]
    assert kept_rows([whole, detection(0.3, trunk)], good, shared) == [0]
    assert kept_rows([whole, detection(0.5, trunk)], good, shared) == [0, 1]
    beside = detection(0.1, (180.0, 100.0, 280.0, 400.0))
    assert kept_rows([whole, beside], good, [None, None]) == [0, 1]


@given(st.lists(probabilities, max_size=30))
def test_only_the_best_candidates_cost_a_run(scores):
    found = [detection(score) for score in scores]
    looked_at = [each.score for each in RULE.candidates(found)]
    strong = [score for score in scores if score >= RULE.score_threshold]
    weak = sorted((s for s in scores if s < RULE.score_threshold), reverse=True)
    assert [score for score in looked_at if score >= RULE.score_threshold] == strong
    kept = sorted((s for s in looked_at if s < RULE.score_threshold), reverse=True)
    assert kept == weak[: len(kept)]
    assert len(kept) >= min(MOST, len(weak))
    # Equal scores are all looked at.
    assert len(kept) <= MOST or kept[-1] == weak[MOST - 1]


class Weak:
    """A detector with one weak box, and a pose network that sees a person in it, or nothing."""

    def __init__(self, score, seen):
        self.person = person_at((0.2, 0.4, 3.0))
        self.box_score, self.seen = score, seen
        self.looks = 0

    def detect(self, image_rgb):
        self.looks += 1
        pixels = CAMERA.project(self.person.points_camera_m)
        box = np.r_[pixels.min(axis=0) - 8.0, pixels.max(axis=0) + 8.0]
        return (PersonDetection(np.clip(box, 0, (640, 480, 640, 480)), self.box_score),)

    def estimate(self, image_rgb, detections):
        rng = np.random.default_rng(0)
        return tuple(
            self.person.keypoints(CAMERA, 0.5, rng, seen=np.full(17, self.seen)) for _ in detections
        )


def pipeline_of(world, **options):
    return AwarenessPipeline(CAMERA, world, world, PnpHeadPoseEstimator(), **options)


def test_a_pipeline_reports_confirmed_people_alone_and_with_their_new_score():
    (one,) = pipeline_of(Weak(0.1, 0.8), confirmation=RULE).process(FRAME, 0.0)
    assert one.score == pytest.approx(RULE.score(detection(0.1), keypoints(0.8)))
    assert one.awareness is not None
    assert pipeline_of(Weak(0.1, 0.35), confirmation=RULE).process(FRAME, 0.0) == ()
    # Without the rule a detector's word is final.
    (other,) = pipeline_of(Weak(0.1, 0.35)).process(FRAME, 0.0)
    assert other.score == 0.1


class Cut(Weak):
    """A detector whose box ends below the shoulders; the pose network sees the whole person."""

    def __init__(self, score, seen, regrown=None):
        super().__init__(score, seen)
        self.boxes = []
        self.regrown = seen if regrown is None else regrown

    def detect(self, image_rgb):
        (whole,) = super().detect(image_rgb)
        left, top, right, bottom = whole.box_xyxy_px
        box = np.array([left, 0.6 * top + 0.4 * bottom, right, bottom])
        return (PersonDetection(box, whole.score),)

    def estimate(self, image_rgb, detections):
        self.boxes += [each.box_xyxy_px for each in detections]
        self.seen = self.seen if len(self.boxes) == 1 else self.regrown
        return super().estimate(image_rgb, detections)


def test_an_unsure_box_grows_to_the_keypoints_beyond_it():
    world = Cut(0.3, 0.8)
    (one,) = pipeline_of(world, confirmation=RULE).process(FRAME, 0.0)
    before, after = world.boxes
    assert one.box_xyxy_px.tolist() == after.tolist()
    assert after[1] < before[1] - 50.0
    assert after[3] >= before[3]
    head = CAMERA.project(world.person.points_camera_m)[:5]
    assert after[1] <= head[:, 1].min()


def test_a_grown_box_must_be_better_and_sure_boxes_stay():
    worse = Cut(0.3, 0.8, regrown=0.7)
    (one,) = pipeline_of(worse, confirmation=RULE).process(FRAME, 0.0)
    assert one.box_xyxy_px.tolist() == worse.boxes[0].tolist()
    sure = Cut(0.7, 0.8)
    pipeline_of(sure, confirmation=RULE).process(FRAME, 0.0)
    assert len(sure.boxes) == 1
    without = Cut(0.3, 0.8)
    pipeline_of(without).process(FRAME, 0.0)
    assert len(without.boxes) == 1


@given(
    st.lists(st.tuples(st.floats(-50.0, 700.0), st.floats(-50.0, 500.0)), min_size=17, max_size=17),
    st.integers(0, 17),
)
def test_a_grown_box_holds_the_old_one_and_stays_in_the_image(points, hidden):
    scores = np.r_[np.zeros(hidden), np.full(17 - hidden, 0.8)]
    person = PersonKeypoints(np.array(points), np.zeros((17, 3)), scores, "coco")
    old = detection(0.3, (100.0, 100.0, 200.0, 400.0))
    new = RULE.grown(old, person, (640, 480), 0.3)
    if 17 - hidden < 6:
        assert new is None
    if new is not None:
        assert (new.box_xyxy_px[:2] <= old.box_xyxy_px[:2]).all()
        assert (new.box_xyxy_px[2:] >= old.box_xyxy_px[2:]).all()
        assert (new.box_xyxy_px >= 0.0).all()
        assert (new.box_xyxy_px <= [640, 480, 640, 480]).all()
        assert new.score == old.score


def test_two_people_do_not_become_one_where_a_box_grows():
    """The pose network finds the other, better seen person in the grown box."""

    class Neighbours(Weak):
        calls = 0

        def detect(self, image_rgb):
            pixels = [CAMERA.project(each.points_camera_m) for each in self.people]
            boxes = [np.r_[p.min(axis=0) - 4.0, p.max(axis=0) + 4.0] for p in pixels]
            boxes[1][0] += 0.5 * (boxes[1][2] - boxes[1][0])
            return tuple(
                PersonDetection(np.clip(box, 0, (640, 480, 640, 480)), score)
                for box, score in zip(boxes, (0.9, 0.45), strict=True)
            )

        def estimate(self, image_rgb, detections):
            rng = np.random.default_rng(0)
            self.calls += 1
            rows = (0, 1) if self.calls == 1 else (0,)
            scores = (0.9, 0.6) if self.calls == 1 else (0.9,)
            return tuple(
                self.people[row].keypoints(CAMERA, 0.5, rng, seen=np.full(17, score))
                for row, score in zip(rows, scores, strict=True)
            )

    world = Neighbours(0.0, 0.0)
    world.people = [person_at((-0.2, 0.4, 3.0)), person_at((0.5, 0.4, 3.2))]
    two = pipeline_of(world, confirmation=RULE).process(FRAME, 0.0)
    assert world.calls == 2
    assert len(two) == 2
    assert all(each.awareness is not None for each in two)


def test_a_carried_box_is_not_judged_again():
    world = Weak(0.1, 0.8)
    pipe = pipeline_of(world, confirmation=RULE, detect_every_s=0.2)
    scores = [pipe.process(FRAME, 0.05 * step)[0].score for step in range(8)]
    assert world.looks < 8
    assert scores == pytest.approx([scores[0]] * 8)
