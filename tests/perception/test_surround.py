"""Wide lenses, flat views cut from their images, and the people of each view."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_people import person_at

from perception import (
    AwarenessPipeline,
    Camera,
    HeadPose,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
)
from perception.surround import (
    FisheyeLens,
    PanoramaLens,
    SurroundPipeline,
    merge_views,
    ring_of_views,
)

FISHEYE = (-0.02, 0.004, -0.001, 0.0002)
FLAT = Camera.from_fov(220, 160, math.radians(110.0))
RING = ring_of_views(FLAT, np.radians([0.0, 90.0, 180.0, -90.0]))


def person(position: np.ndarray, **changes: object) -> PersonObservation:
    """Return an observation at a position, with a depth less certain than the direction."""
    observation = PersonObservation(
        stamp_s=1.0,
        position_camera_m=position,
        position_covariance_m2=np.diag([0.05, 0.05, 0.15]) ** 2,
        gaze_camera=np.array([0.0, 0.0, -1.0]),
        awareness=0.5,
        awareness_std=0.1,
        score=0.9,
        box_xyxy_px=None,
    )
    return replace(observation, **changes)


def at(bearing_rad: float, range_m: float) -> np.ndarray:
    """Return a position in the camera frame; left bearings are positive."""
    return np.array([-range_m * math.sin(bearing_rad), 0.2, range_m * math.cos(bearing_rad)])


def views_of(place: np.ndarray, rng: np.random.Generator) -> list[tuple[int, np.ndarray]]:
    """Return the views that show a position, and the position in each with 3 cm of noise."""
    shown = []
    for number, view in enumerate(RING):
        inside = view.rotation_camera_view.T @ place
        u = FLAT.project([inside])[0, 0]
        if inside[2] > 0.0 and -0.5 <= u <= FLAT.width_px - 0.5:
            shown.append((number, inside + rng.normal(0.0, 0.03, 3)))
    return shown


def test_fisheye_agrees_with_opencv() -> None:
    lens = FisheyeLens(1280, 960, 300.0, 310.0, 640.0, 470.0, np.array(FISHEYE))
    points = np.random.default_rng(0).uniform([-8, -8, 0.7], [8, 8, 8], (500, 3))
    expected, _ = cv2.fisheye.projectPoints(
        points[:, None],
        np.zeros(3),
        np.zeros(3),
        np.array([[300.0, 0, 640.0], [0, 310.0, 470.0], [0, 0, 1]]),
        np.array(FISHEYE),
    )
    np.testing.assert_allclose(lens.project(points), expected[:, 0], atol=1e-6)


@given(st.floats(0.0, math.radians(99.9)), st.floats(-math.pi, math.pi))
def test_an_undistorted_fisheye_is_equidistant_beyond_a_right_angle(angle, around):
    lens = FisheyeLens(1000, 1000, 250.0, 250.0, 500.0, 500.0)
    ray = [
        math.sin(angle) * math.cos(around),
        math.sin(angle) * math.sin(around),
        math.cos(angle),
    ]
    away = lens.project([ray])[0] - 500.0
    assert np.hypot(*away) == pytest.approx(250.0 * angle, abs=1e-6)


def test_a_fisheye_sees_nothing_beyond_its_circle() -> None:
    lens = FisheyeLens(1000, 1000, 250.0, 250.0, 500.0, 500.0, max_angle_rad=math.radians(95.0))
    pixels = lens.project([at(1.6, 2.0) * [1, 0, 1], at(1.7, 2.0), [0.0, 0.0, -1.0]])
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1:]).all()


def directions_of(lens, height: int, width: int) -> np.ndarray:
    """Return an image (H, W, 3) whose colours are the directions of the pixels."""
    if isinstance(lens, PanoramaLens):
        heading = ((np.arange(width) + 0.5) / width - 0.5) * 2.0 * math.pi
        down = ((np.arange(height) + 0.5) / height - 0.5) * math.pi
        heading, down = np.meshgrid(heading, down)
        rays = np.stack(
            [np.sin(heading) * np.cos(down), np.sin(down), np.cos(heading) * np.cos(down)], axis=-1
        )
    else:
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        x, y = (u - lens.cx_px) / lens.fx_px, (v - lens.cy_px) / lens.fy_px
        angle = np.hypot(x, y)
        share = np.sinc(angle / math.pi)
        rays = np.stack([share * x, share * y, np.cos(angle)], axis=-1)
    return np.round(127.5 * (rays + 1.0)).astype(np.uint8)


@pytest.mark.parametrize(
    "lens",
    [
        PanoramaLens(1440, 720),
        FisheyeLens(900, 900, 220.0, 220.0, 450.0, 450.0, max_angle_rad=math.radians(110.0)),
    ],
    ids=["panorama", "fisheye"],
)
def test_each_view_shows_its_directions(lens) -> None:
    views = (*RING, *ring_of_views(Camera.from_fov(120, 90, 1.0), [0.6]))
    pipeline = SurroundPipeline(lens, views, partial(AwarenessPipeline, simulator_networks=True))
    image = directions_of(lens, lens.height_px, lens.width_px)
    for view, flat in zip(views, pipeline.flat_pictures(image), strict=True):
        camera = view.camera
        u, v = np.meshgrid(np.arange(camera.width_px, dtype=float), np.arange(camera.height_px))
        rays = np.column_stack(
            [camera.normalise(np.column_stack([u.ravel(), v.ravel()])), np.ones(u.size)]
        )
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ view.rotation_camera_view.T
        wanted = 127.5 * (rays.reshape(*u.shape, 3) + 1.0)
        seen = np.isfinite(lens.project(rays)).all(axis=1).reshape(u.shape)
        inner = cv2.erode(seen.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        assert inner.any() or view is RING[2]
        assert np.abs(flat[inner] - wanted[inner]).max(initial=0.0) <= 2.5
        if isinstance(lens, PanoramaLens):
            assert seen.all()
        else:
            beyond = cv2.erode((~seen).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
            assert not flat[beyond].any()


def test_in_camera_rotates_position_covariance_and_gaze() -> None:
    seen = person(np.array([0.3, 0.2, 2.0]), gaze_camera=np.array([0.6, 0.0, -0.8]))
    for view, place, gaze in zip(
        RING,
        [(0.3, 0.2, 2.0), (-2.0, 0.2, 0.3), (-0.3, 0.2, -2.0), (2.0, 0.2, -0.3)],
        [(0.6, 0.0, -0.8), (0.8, 0.0, 0.6), (-0.6, 0.0, 0.8), (-0.8, 0.0, -0.6)],
        strict=True,
    ):
        turned = view.in_camera(seen)
        np.testing.assert_allclose(turned.position_camera_m, place, atol=1e-12)
        np.testing.assert_allclose(turned.gaze_camera, gaze, atol=1e-12)
        np.testing.assert_allclose(
            np.linalg.eigvalsh(turned.position_covariance_m2),
            np.linalg.eigvalsh(seen.position_covariance_m2),
        )
        assert (turned.awareness, turned.awareness_std) == (0.5, 0.1)


@given(
    st.lists(st.tuples(st.floats(-math.pi, math.pi), st.floats(0.8, 9.0)), min_size=1, max_size=6),
    st.integers(0, 2**32 - 1),
)
def test_people_more_than_1_2_m_apart_are_reported_once_each(people, seed):
    rng = np.random.default_rng(seed)
    places = [at(*each) for each in people]
    apart = [places[0]]
    for place in places[1:]:
        if all(np.linalg.norm(place - other) > 1.2 for other in apart):
            apart.append(place)
    seen: list[list[PersonObservation]] = [[] for _ in RING]
    for place in apart:
        for number, inside in views_of(place, rng):
            seen[number].append(person(inside))
    merged = merge_views(RING, seen)
    assert len(merged) == len(apart)
    for place in apart:
        nearest = min(np.linalg.norm(each.observation.position_camera_m - place) for each in merged)
        assert nearest < 0.3


@given(st.floats(0.6, 1.0), st.floats(1.0, 5.0), st.integers(0, 2**32 - 1))
def test_two_people_shoulder_to_shoulder_in_the_overlap_stay_two(bearing, range_m, seed):
    """Each of them appears in one view or in both."""
    rng = np.random.default_rng(seed)
    half = 0.3 / range_m
    seen: list[list[PersonObservation]] = [[] for _ in RING]
    for place in (at(bearing - half, range_m), at(bearing + half, range_m)):
        for number, inside in views_of(place, rng):
            seen[number].append(person(inside))
    both = [len(rows) for rows in seen[:2]]
    merged = merge_views(RING, seen)
    if both == [2, 2]:
        assert len(merged) == 2
    assert max(both) <= len(merged) <= 2


def test_the_more_central_observation_is_kept_and_the_covariance_decides_about_pairs() -> None:
    place = at(math.radians(40.0), 3.0)
    ahead, left = (RING[n].rotation_camera_view.T @ place for n in (0, 1))
    merged = merge_views(RING, [[person(ahead, score=0.7)], [person(left, score=0.8)], [], []])
    assert [(each.view, each.row) for each in merged] == [(0, 0)]
    # 0.6 m apart: one person with large covariances, two people with small ones.
    aside = RING[1].rotation_camera_view.T @ np.add(place, [0.0, 0.0, 0.6])
    for std_m, people in ((0.3, 1), (0.02, 2)):
        covariance = np.eye(3) * std_m**2
        both = merge_views(
            RING,
            [
                [person(ahead, position_covariance_m2=covariance)],
                [person(aside, position_covariance_m2=covariance)],
                [],
                [],
            ],
        )
        assert len(both) == people


def test_a_box_of_a_view_is_mapped_to_the_image_of_the_lens() -> None:
    lens = PanoramaLens(1440, 720)
    corners = np.array([80.0, 30.0, 140.0, 130.0])
    for view in RING:
        box = view.box_in(lens, corners)
        if view is RING[2]:  # behind, across the seam
            assert box is None
            continue
        assert box is not None
        inside = np.random.default_rng(0).uniform(corners[:2], corners[2:], (50, 2))
        rays = np.column_stack([FLAT.normalise(inside), np.ones(50)])
        pixels = lens.project(rays @ view.rotation_camera_view.T)
        assert (pixels >= box[:2] - 0.5).all()
        assert (pixels <= box[2:] + 0.5).all()
    narrow = FisheyeLens(400, 400, 100.0, 100.0, 200.0, 200.0, max_angle_rad=1.0)
    assert RING[1].box_in(narrow, corners) is None


# --- each view has people of its own --------------------------------------------------------------


VIEW = Camera.from_fov(320, 240, math.radians(100.0))
PANORAMA = PanoramaLens(720, 360)
RATE_HZ = 20.0
_BODY = 250


class Networks:
    """Detector and pose network that see somebody in a picture with bright pixels."""

    def __init__(self) -> None:
        person = person_at((0.0, 0.4, 3.0))
        self._pixels = VIEW.project(person.points_camera_m)
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

    flats = [VIEW] * 3 if cameras == "one" else [Camera.from_fov(320, 240, 1.7) for _ in range(3)]
    views = tuple(
        ring_of_views(flat, [math.radians(heading)])[0]
        for flat, heading in zip(flats, (0.0, 90.0, -90.0), strict=True)
    )
    pipeline = SurroundPipeline(PANORAMA, views, make)
    for index in range(8):
        assert headings_seen(pipeline, index, 0.0, 90.0) == [0, 90]
    assert len(made) == (1 if cameras == "one" else 3)
    assert 3 <= networks.looks < 24  # of 8 images with 3 views


def test_one_pipeline_for_several_cameras_is_not_shared_either() -> None:
    networks = Networks()
    shared = AwarenessPipeline(VIEW, networks, networks, detect_every_s=0.2)
    other = Camera.from_fov(320, 240, math.radians(100.0))
    views = ring_of_views(VIEW, [0.0]) + ring_of_views(other, [math.pi / 2.0])
    pipeline = SurroundPipeline(PANORAMA, views, lambda camera: shared)
    for index in range(6):
        assert headings_seen(pipeline, index, 0.0) == [0]
    # Somebody new is found within the detector's interval.
    for index in range(10, 16):
        assert headings_seen(pipeline, index, 0.0, 90.0) == [0, 90]


class Looking(Networks):
    """The same, with a head that looks past the camera."""

    def estimate(self, image_rgb, detections, people=None):
        if people is None:
            return super().estimate(image_rgb, detections)
        turn = Rotation.from_euler("y", 40.0, degrees=True).as_matrix()
        head = turn @ np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        return tuple(
            HeadPose(np.array([0.0, -0.2, 3.0]), head, 1e-4 * np.eye(6), 1.0) for _ in people
        )


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, 150.0, -90.0])
@pytest.mark.parametrize("aside_m", [-1.5, 0.0, 1.5])
def test_the_robot_is_where_it_is_in_every_view(heading_deg: float, aside_m: float) -> None:
    """People look at the robot's points, which turn with the views as the people do."""
    networks = Looking()
    view = ring_of_views(VIEW, [math.radians(heading_deg)])[0]
    in_view = np.array([[aside_m, 0.5, 0.4], [aside_m, 0.5, -0.4]])

    def make(points_m: np.ndarray, camera: Camera) -> AwarenessPipeline:
        return AwarenessPipeline(
            camera, networks, networks, networks, robot_points_camera_m=points_m
        )

    picture = panorama(0, heading_deg)
    in_camera = in_view @ view.rotation_camera_view.T
    surround = SurroundPipeline(PANORAMA, [view], partial(make, in_camera))
    (seen,) = surround.process(picture, 0.0)
    (flat,) = make(in_view, VIEW).process(surround.flat_pictures(picture)[0], 0.0)
    assert seen.awareness == pytest.approx(flat.awareness, abs=1e-6)
    assert flat.awareness is not None
