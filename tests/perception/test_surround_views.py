"""Each view of a surround camera has people of its own, whatever the detector's rate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from synthetic_people import person_at

from perception import AwarenessPipeline, Camera, PersonDetection, PersonKeypoints
from perception.surround import PanoramaLens, SurroundPipeline, ring_of_views

FLAT = Camera.from_fov(320, 240, math.radians(100.0))
LENS = PanoramaLens(720, 360)
RATE_HZ = 20.0
_BODY = 250


class Networks:
    """Detector and pose network that see somebody in a picture with bright pixels."""

    def __init__(self) -> None:
        person = person_at((0.0, 0.4, 3.0))
        self._pixels = FLAT.project(person.points_camera_m)
        self._root = person.points_camera_m - person.points_camera_m[11:13].mean(axis=0)
        self.looks = 0

    def detect(self, image_rgb):
        self.looks += 1
        if not (image_rgb == _BODY).any():
            return ()
        low, high = self._pixels.min(axis=0) - 8.0, self._pixels.max(axis=0) + 8.0
        return (PersonDetection(np.clip([*low, *high], 0.0, (320, 240, 320, 240)), 0.9),)

    def estimate(self, image_rgb, detections):
        score = float((image_rgb == _BODY).any())
        return tuple(
            PersonKeypoints(self._pixels, self._root, np.full(17, score), "coco")
            for _ in detections
        )


def hall(index: int, height: int, width: int) -> np.ndarray:
    """Return a picture of so much noise that a change of it tells nothing."""
    rows, columns = height // 4, width // 4
    noise = np.random.default_rng(index).integers(60, 120, (rows, columns, 1)).astype(np.uint8)
    return np.kron(noise, np.ones((4, 4, 3), np.uint8))


def panorama(index: int, *headings_deg: float) -> np.ndarray:
    """Return a panorama with somebody bright at each heading; left is positive."""
    image = hall(index, 360, 720)
    for heading in headings_deg:
        middle = round(359.5 - 2.0 * heading)
        image[130:260, middle - 20 : middle + 20] = _BODY
    return image


def headings_seen(pipeline: SurroundPipeline, index: int, *headings_deg: float) -> list[int]:
    seen = pipeline.process(panorama(index, *headings_deg), index / RATE_HZ)
    places = [each.position_camera_m for each in seen]
    return sorted(round(math.degrees(math.atan2(-place[0], place[2]))) for place in places)


@pytest.mark.parametrize("cameras", ["one", "each"])
def test_everybody_is_seen_in_every_image(cameras) -> None:
    networks, made = Networks(), []

    def make(camera: Camera) -> AwarenessPipeline:
        made.append(camera)
        return AwarenessPipeline(camera, networks, networks, detect_every_s=0.2)

    flats = [FLAT] * 3 if cameras == "one" else [Camera.from_fov(320, 240, 1.7) for _ in range(3)]
    views = tuple(
        ring_of_views(flat, [math.radians(heading)])[0]
        for flat, heading in zip(flats, (0.0, 90.0, -90.0), strict=True)
    )
    pipeline = SurroundPipeline(LENS, views, make)
    for index in range(8):
        assert headings_seen(pipeline, index, 0.0, 90.0) == [0, 90]
    assert len(made) == (1 if cameras == "one" else 3)
    assert 3 <= networks.looks < 24  # of 8 images with 3 views


def test_one_pipeline_for_several_cameras_is_not_shared_either() -> None:
    networks = Networks()
    shared = AwarenessPipeline(FLAT, networks, networks, detect_every_s=0.2)
    other = Camera.from_fov(320, 240, math.radians(100.0))
    views = ring_of_views(FLAT, [0.0]) + ring_of_views(other, [math.pi / 2.0])
    pipeline = SurroundPipeline(LENS, views, lambda camera: shared)
    for index in range(6):
        assert headings_seen(pipeline, index, 0.0) == [0]
    # Somebody new is found within the detector's interval.
    for index in range(10, 16):
        assert headings_seen(pipeline, index, 0.0, 90.0) == [0, 90]


def test_stand_ins_for_a_pipeline_are_made_for_each_view() -> None:
    class Counting:
        def __init__(self, camera: Camera) -> None:
            self.images = 0
            made.append(self)

        def process(self, image_rgb, stamp_s, floor=None):
            self.images += 1
            return ()

    made: list[Counting] = []
    views = ring_of_views(FLAT, np.radians([0.0, 90.0, 180.0]))
    pipeline = SurroundPipeline(LENS, views, Counting)
    assert pipeline.process(panorama(0), 0.0) == ()
    assert [each.images for each in made] == [1, 1, 1]


def test_a_pipeline_for_another_view_shares_networks_and_knows_nobody() -> None:
    networks = Networks()
    first = AwarenessPipeline(FLAT, networks, networks, detect_every_s=0.2)

    def picture(index: int, *, with_person: bool) -> np.ndarray:
        image = hall(index, 240, 320)
        image[100:180, 150:170] = _BODY if with_person else 90
        return image

    for index in range(2):
        (seen,) = first.process(picture(index, with_person=True), index / RATE_HZ)
    assert networks.looks == 1
    second = first.for_another_view()
    assert second.camera is first.camera
    assert second.process(picture(2, with_person=False), 2 / RATE_HZ) == ()
    assert networks.looks == 2
    # The first one still carries its person.
    (again,) = first.process(picture(2, with_person=True), 2 / RATE_HZ)
    assert networks.looks == 2
    np.testing.assert_allclose(again.position_camera_m, seen.position_camera_m, atol=0.05)
