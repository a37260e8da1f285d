"""Detectors with an input of fixed size on wide cameras: a second look at the middle."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception import Camera, PersonDetection
from perception.networks.detectors import for_wide_view

WIDE = Camera.from_fov(1920, 1200, math.radians(120.0))
INPUT_PX = 320
LEAST_PX = 30


class Detector:
    """Finds each person of :attr:`people` who is at least 30 px tall in an input of 320 px.

    The red and green of a pixel are its column and row in the whole image, in units of 8 px, so
    that the detector knows what part it sees. A person is cut at the edges.
    """

    def __init__(self, *people: tuple[float, float, float, float]) -> None:
        self.people = people
        self.seen: list[tuple[int, ...]] = []

    def detect(self, image_rgb: np.ndarray) -> tuple[PersonDetection, ...]:
        height, width = image_rgb.shape[:2]
        left, top = (8 * image_rgb[0, 0, :2].astype(int)).tolist()
        self.seen.append((left, top, left + width, top + height))
        found = []
        for number, person in enumerate(self.people):
            box = np.clip(np.subtract(person, (left, top, left, top)), 0, (width, height) * 2)
            shown = (box[2:] - box[:2]).min() > 0
            if shown and (box[3] - box[1]) * INPUT_PX / max(width, height) >= LEAST_PX:
                found.append(PersonDetection(box, 0.9 - 0.1 * number))
        return tuple(found)


@functools.cache
def image() -> np.ndarray:
    rows, columns = np.mgrid[:1200, :1920] // 8
    return np.stack([columns, rows, rows], axis=-1).astype(np.uint8)


def boxes(*people: tuple[float, float, float, float]) -> list[list[float]]:
    found = for_wide_view(Detector(*people), WIDE).detect(image())
    assert [each.score for each in found] == sorted((each.score for each in found), reverse=True)
    return sorted(each.box_xyxy_px.tolist() for each in found)


def test_a_camera_of_up_to_90_degrees_needs_no_second_look():
    detector = Detector()
    for fov_deg in (60.0, 89.9):
        camera = Camera.from_fov(1920, 1200, math.radians(fov_deg))
        assert for_wide_view(detector, camera) is detector
    for_wide_view(detector, WIDE).detect(image())
    assert sorted(detector.seen) == [(0, 0, 1920, 1200), (480, 120, 1440, 1080)]


def test_somebody_far_ahead_is_found_in_the_middle_alone():
    far = (900.0, 580.0, 940.0, 700.0)  # 120 px are 20 in the whole image's input
    assert Detector(far).detect(image()) == ()
    assert boxes(far) == [list(far)]


@pytest.mark.parametrize(
    "person",
    [
        (900.0, 500.0, 1000.0, 760.0),  # in both looks
        (420.0, 500.0, 540.0, 760.0),  # cut by the left edge of the middle
        (900.0, 300.0, 1200.0, 1190.0),  # cut below
        (100.0, 500.0, 200.0, 760.0),  # beside the middle
    ],
)
def test_each_person_is_found_once_and_whole(person):
    assert boxes(person) == [list(person)]


def test_somebody_before_another_hides_nobody():
    behind, before = (950.0, 520.0, 1010.0, 700.0), (900.0, 480.0, 1050.0, 900.0)
    assert boxes(before, behind) == sorted([list(before), list(behind)])


def test_somebody_behind_hides_nobody_whom_the_middle_cuts():
    behind, near = (950.0, 520.0, 1010.0, 700.0), (800.0, 100.0, 1200.0, 1200.0)
    assert boxes(near, behind) == sorted([list(near), list(behind)])


def test_a_part_of_somebody_in_the_whole_image_is_nobody_else():
    person, part = (900.0, 500.0, 1000.0, 760.0), (910.0, 505.0, 960.0, 600.0)

    class Parts(Detector):
        def detect(self, image_rgb: np.ndarray) -> tuple[PersonDetection, ...]:
            whole = image_rgb.shape[1] == WIDE.width_px
            return (PersonDetection(part, 0.4),) if whole else super().detect(image_rgb)

    found = for_wide_view(Parts(person), WIDE).detect(image())
    assert [each.box_xyxy_px.tolist() for each in found] == [list(person)]


def test_a_middle_that_reaches_the_images_edges_cuts_nobody_there():
    low = Camera.from_fov(1920, 480, math.radians(120.0))
    person = (900.0, 200.0, 980.0, 480.0)  # the image ends below
    detector = for_wide_view(Detector(person), low)
    found = detector.detect(image()[:480])
    assert [each.box_xyxy_px.tolist() for each in found] == [list(person)]


class ShortBoxes(Detector):
    """Boxes of people whom an edge of the image cuts end short of it, as those of networks do."""

    def __init__(self, *people: tuple[float, float, float, float], short: float) -> None:
        super().__init__(*people)
        self.short = short

    def detect(self, image_rgb: np.ndarray) -> tuple[PersonDetection, ...]:
        height, width = image_rgb.shape[:2]
        found = []
        for each in super().detect(image_rgb):
            left, top, right, bottom = each.box_xyxy_px
            short = self.short * width * (width < WIDE.width_px)
            low = np.array([left + short * (left == 0), top + short * (top == 0)])
            high = np.array([right - short * (right == width), bottom - short * (bottom == height)])
            if (high - low).min() > 1.0:
                found.append(PersonDetection(np.concatenate([low, high]), each.score))
        return tuple(found)


@given(
    middle=st.tuples(st.floats(300.0, 1620.0), st.floats(200.0, 1000.0)),
    height=st.floats(250.0, 1100.0),
    short=st.floats(0.0, 0.12),
)
def test_nobody_is_found_twice_wherever_the_middle_cuts_them(
    middle: tuple[float, float], height: float, short: float
) -> None:
    half = np.array([0.4 * height, height]) / 2.0
    person = np.clip(
        np.concatenate([np.subtract(middle, half), np.add(middle, half)]), 0.0, (1920, 1200) * 2
    )
    found = for_wide_view(ShortBoxes(tuple(person), short=short), WIDE).detect(image())
    assert [each.box_xyxy_px.tolist() for each in found] == [person.tolist()]
