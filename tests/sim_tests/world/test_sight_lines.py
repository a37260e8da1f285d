"""Lines of sight agree with brute force and with depth images, and heads hide faces."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from camera_poses import level_pose
from scipy.spatial.transform import Rotation
from triangle_hits import shares_met

from perception import Camera
from sim_tests.actors.body import Worker
from sim_tests.actors.body._pose import skin_points
from sim_tests.crossing.sensors import KeypointCamera, KeypointNoise
from sim_tests.world import FACE_DEPTH_M, FACE_KEYPOINTS, JOINT_DEPTH_M, Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.sightlines import PlacedSurface, SightLines, TriangleSet
from training.round_meshes import ellipsoid

CAMERA = Camera.from_fov(1920, 1200, math.radians(120.0))
EXACT = KeypointNoise(pixel_std_px=0.0, lift_std_m=0.0, miss_rate=0.0)
FINE = np.zeros(1, dtype=np.int64)
HOME = np.eye(4)[None]


@pytest.fixture(scope="module")
def hall() -> Iterator[tuple[Warehouse, list[Worker]]]:
    with Warehouse(WarehouseLayout.named("crossing")) as warehouse:
        workers = [Worker(warehouse, 1.62), Worker(warehouse, 1.85)]
        yield warehouse, workers


@pytest.mark.parametrize("seed", range(5))
def test_a_line_is_blocked_when_it_meets_one_of_the_triangles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(3 * 90, 3))
    rows = np.arange(3 * 90).reshape(-1, 3)
    corners = vertices[rows] * 0.5
    eye = 3.0 * rng.normal(size=3)
    ends = rng.normal(size=(60, 3)) - 0.5 * eye
    surface = PlacedSurface(TriangleSet([(0.5 * vertices, rows)]), HOME)
    met = [shares_met(corners, eye, end - eye) for end in ends]
    expected = [bool(((shares > 0.0) & (shares < 1.0)).any()) for shares in met]
    assert 5 < sum(expected) < 60
    np.testing.assert_array_equal(surface.blocks(eye, ends), expected)


def test_a_closed_surface_has_no_gaps_and_hides_only_what_is_behind() -> None:
    ball = ellipsoid((0.0, 0.0, 0.0), (0.4, 0.4, 0.4), 24, 16, (0.0, 0.0, 1.0, 1.0))
    surface = PlacedSurface(TriangleSet([(ball.vertices_m, ball.indices.reshape(-1, 3))]), HOME)
    rng = np.random.default_rng(0)
    eyes = Rotation.random(60, random_state=1).apply([3.0, 0.0, 0.0])
    for eye in eyes:
        inside = rng.normal(size=(20, 3))
        inside *= 0.3 * rng.random((20, 1)) / np.linalg.norm(inside, axis=1, keepdims=True)
        assert surface.blocks(eye, inside).all()
        # One point in front of the ball, and one past it at more than its radius.
        side = np.cross(eye, rng.normal(size=3))
        beside = 0.45 * side / np.linalg.norm(side)
        assert not surface.blocks(eye, np.array([0.2 * eye, beside - eye + beside])).any()


def test_a_rack_hides_what_is_behind_it_and_the_aisle_is_free() -> None:
    layout = WarehouseLayout.named("crossing")
    lines = SightLines(layout)
    x_min, y_min, x_max, y_max = layout.racks[0].box_odom_m
    middle = 0.5 * (x_min + x_max)
    before, behind = np.array([middle, y_min - 0.5, 1.2]), np.array([middle, y_max + 0.5, 1.2])
    assert lines.blocked(before, behind[None], FINE).all()
    assert not lines.blocked(np.array([0.0, 0.0, 1.4]), np.array([[6.0, 0.0, 1.0]]), FINE).any()


def test_a_worker_stays_within_its_reach_box_in_every_pose(hall) -> None:
    rng = np.random.default_rng(5)
    for worker in hall[1]:
        asset = worker.asset
        skin = asset.levels[2]
        for _ in range(15):
            _pose(worker, rng, (2.0, 0.0))
            low, high = worker.reach_odom_m()
            points = skin_points(asset.joints_m, worker.pose, skin.vertices_m, skin.weights)
            assert (points > low).all()
            assert (points < high).all()


def test_visibility_agrees_with_a_depth_image(hall: tuple[Warehouse, list[Worker]]) -> None:
    """The depth image is sampled at each keypoint's own pixel, at the same level of detail."""
    warehouse, workers = hall
    renderer = CameraRenderer(warehouse)
    camera = KeypointCamera(
        CAMERA, SightLines(warehouse.layout, actors=warehouse.actors), EXACT,
        np.random.default_rng(0),
    )  # fmt: skip
    rng = np.random.default_rng(11)
    same: dict[bool, list[bool]] = {True: [], False: []}
    for _ in range(6):
        for worker in workers:
            _pose(worker, rng, (rng.uniform(2.0, 6.0), rng.uniform(-2.0, 2.0)))
        T = level_pose((0.0, 0.0, 1.4), 0.0)
        seen = camera.look(T, workers)
        people = camera.estimate(None, camera.detect(None))
        for index, keypoints in zip(seen, people, strict=True):
            points = (workers[index].keypoints_odom_m - T[:3, 3]) @ T[:3, :3]
            pixels = CAMERA.project(points)
            inside = ((pixels > 0.0) & (pixels < [1919.0, 1199.0])).all(axis=1)
            for row in np.flatnonzero(inside):
                face = bool(row < FACE_KEYPOINTS)
                half_px = 0.5 * CAMERA.fx_px / points[row, 2] / (100.0 if face else 28.0)
                corner = pixels[row] + 0.5
                rectangle = np.concatenate([corner - half_px, corner + half_px])
                front = renderer.render(CAMERA, T, rectangle, (1, 1)).depth_m[0, 0]
                visible = points[row, 2] <= front + (FACE_DEPTH_M if face else JOINT_DEPTH_M)
                same[face].append(visible == (keypoints.scores[row] > 0.0))
    assert min(len(same[True]), len(same[False])) > 25
    # The rest are behind limbs of a nearer person, drawn with a finer outline in the image.
    assert np.mean(same[True]) >= 0.99
    assert np.mean(same[False]) >= 0.985


def test_the_back_of_a_head_never_shows_a_face(hall: tuple[Warehouse, list[Worker]]) -> None:
    warehouse, workers = hall
    lines = SightLines(warehouse.layout, actors=warehouse.actors)
    workers[1].place((-3.0, 0.0), 0.0)
    rng = np.random.default_rng(2)
    eye = np.array([0.0, 0.0, 1.4])
    for _ in range(50):
        worker = workers[0]
        _pose(worker, rng, (rng.uniform(1.2, 7.0), rng.uniform(-1.5, 1.5)), look_away=True)
        face = worker.keypoints_odom_m[:3]
        away = eye - worker.eyes_odom_m
        forward = worker.rotation_odom_head[:, 1]
        if forward @ away > math.cos(math.radians(140.0)) * np.linalg.norm(away):
            continue
        depth = face[:, 0] - eye[0]
        ends = eye + (1.0 - FACE_DEPTH_M / depth)[:, None] * (face - eye)
        assert lines.blocked(eye, ends, np.ones(3, dtype=np.int64)).all()


def test_a_person_hides_another_and_a_carried_box_hides_the_chest(hall) -> None:
    warehouse, (near, far) = hall
    lines = SightLines(warehouse.layout, actors=warehouse.actors)
    eye, detail = np.array([0.0, 0.0, 1.2]), np.full(1, 2)
    far.place((4.0, 0.0), math.pi)
    near.place((2.0, 0.0), math.pi)
    chest = far.chest_odom_m[None] - [[0.2, 0.0, 0.0]]
    assert lines.blocked(eye, chest, detail).all()
    near.place((2.0, 1.5), math.pi)
    assert not lines.blocked(eye, chest, detail).any()
    navel = np.array([[3.72, 0.0, 1.05]])
    assert not lines.blocked(eye, navel, detail).any()
    far.place((4.0, 0.0), math.pi, activity="carry_box")
    assert lines.blocked(eye, navel + np.array([0.1, 0.0, 0.0]), detail).all()


def _pose(
    worker: Worker,
    rng: np.random.Generator,
    position_m: tuple[float, float],
    *,
    look_away: bool = False,
) -> None:
    heading = rng.uniform(-0.6, 0.6) if look_away else rng.uniform(-math.pi, math.pi)
    worker.place(
        position_m,
        heading,
        rng.uniform(0.0, 3.0),
        rng.uniform(0.0, 2.0),
        rng.uniform(-0.5, 0.5) if look_away else rng.uniform(-1.3, 1.3),
        rng.uniform(-0.5, 0.5),
        activity=str(rng.choice(["none", "carry_box", "phone"])),
    )
