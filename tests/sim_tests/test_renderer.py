"""Rendered pictures and depth fall where the camera model projects the truth."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from perception import Camera
from perception import layouts as kp
from sim_tests._amr import Amr
from sim_tests._bullet import pybullet
from sim_tests._errors import SimError
from sim_tests._layout import WarehouseLayout
from sim_tests._renderer import CameraRenderer
from sim_tests._warehouse import Warehouse
from sim_tests._worker import Worker

_DOWN_FROM_3_M = np.array(
    [[0.0, -1.0, 0.0, 1.05], [-1.0, 0.0, 0.0, -0.5], [0.0, 0.0, -1.0, 3.0], [0.0, 0.0, 0.0, 1.0]]
)
OFF_CENTRE = Camera(320, 240, 270.0, 260.0, 171.3, 110.6)


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.open_floor()) as warehouse:
        yield warehouse


@pytest.fixture(scope="module")
def renderer(hall: Warehouse) -> CameraRenderer:
    return CameraRenderer(hall)


@pytest.fixture(scope="module")
def worker(hall: Warehouse) -> Worker:
    return Worker(hall, 1.75)


def _pose(
    position_m: tuple[float, float, float], heading_rad: float, pitch_down_rad: float = 0.0
) -> np.ndarray:
    """T_odom_camera of a camera with a level horizon."""
    ch, sh = math.cos(heading_rad), math.sin(heading_rad)
    cp, sp = math.cos(pitch_down_rad), math.sin(pitch_down_rad)
    forward = np.array([cp * ch, cp * sh, -sp])
    right = np.array([sh, -ch, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = position_m
    return pose


def _to_camera(T_odom_camera: np.ndarray, points_odom_m: np.ndarray) -> np.ndarray:
    return (points_odom_m - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]


def test_a_ball_appears_where_it_is_projected(hall: Warehouse, renderer: CameraRenderer) -> None:
    shape = pybullet.createVisualShape(
        pybullet.GEOM_SPHERE, radius=0.06, rgbaColor=(1, 0, 0, 1), physicsClientId=hall.client
    )
    ball = pybullet.createMultiBody(0.0, -1, shape, physicsClientId=hall.client)
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(24):
        T = _pose((0.0, 0.0, 1.4), rng.uniform(-3.0, 3.0), rng.uniform(-0.2, 0.3))
        camera_m = np.array([rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6), rng.uniform(2.0, 3.5)])
        odom_m = T[:3, :3] @ camera_m + T[:3, 3]
        pybullet.resetBasePositionAndOrientation(
            ball, odom_m, (0, 0, 0, 1), physicsClientId=hall.client
        )
        view = renderer.render(OFF_CENTRE, T)
        rows, columns = np.nonzero(view.body_ids == ball)
        assert len(rows) > 50
        centroid = np.array([columns.mean(), rows.mean()])
        errors.append(centroid - OFF_CENTRE.project(camera_m[None])[0])
        front = view.depth_m[rows, columns].min()
        assert front == pytest.approx(camera_m[2] - 0.06, abs=0.006)  # the ball has facets
    pybullet.removeBody(ball, physicsClientId=hall.client)
    # One ball's centroid depends on which pixels its edge takes; all together show any offset.
    assert np.abs(np.mean(errors, axis=0)).max() < 0.06
    assert np.linalg.norm(errors, axis=1).max() < 0.2


@pytest.mark.parametrize("pitch_rad", [0.35, 1.2])
def test_depth_of_the_floor_is_exact(renderer: CameraRenderer, pitch_rad: float) -> None:
    T = _pose((0.0, 0.0, 1.4), 0.3, pitch_rad)
    view = renderer.render(OFF_CENTRE, T)
    rows, columns = np.mgrid[:240, :320]
    rays = np.stack(
        [
            (columns - OFF_CENTRE.cx_px) / OFF_CENTRE.fx_px,
            (rows - OFF_CENTRE.cy_px) / OFF_CENTRE.fy_px,
            np.ones_like(rows, dtype=float),
        ],
        axis=-1,
    )
    falls = rays @ T[2, :3]  # odom z a metre of depth
    expected = np.where(falls < 0.0, -1.4 / falls, np.inf)
    near = expected < 3.5  # farther away the racks and walls begin
    assert near.sum() > 10_000
    # Paint lies up to 4 mm above the floor.
    np.testing.assert_allclose(view.depth_m[near], expected[near], rtol=4e-3)


def test_a_rectangle_is_that_part_of_the_whole(renderer: CameraRenderer, worker: Worker) -> None:
    worker.place((3.0, 0.3), 2.5, 0.3, 1.0)
    T = _pose((0.0, 0.0, 1.4), 0.0)
    whole = renderer.render(OFF_CENTRE, T)
    for u0, v0, u1, v1 in ((100, 40, 220, 200), (0, 0, 77, 33), (159, 100, 160, 101)):
        part = renderer.render(OFF_CENTRE, T, (u0, v0, u1, v1))
        assert part.rgb.shape == (v1 - v0, u1 - u0, 3)
        same = part.body_ids == whole.body_ids[v0:v1, u0:u1]
        # A sample on the very edge of a triangle may round to either side.
        assert same.mean() > 0.995
        np.testing.assert_allclose(part.depth_m[same], whole.depth_m[v0:v1, u0:u1][same], rtol=2e-3)


def test_a_coarser_grid_samples_the_middle_of_its_cells(renderer: CameraRenderer) -> None:
    T = _pose((0.0, 0.0, 1.4), 0.3, 1.2)
    coarse = renderer.depth(OFF_CENTRE, T, (60.0, 30.0, 180.0, 210.0), (40, 60))
    assert coarse.shape == (60, 40)
    fine = renderer.depth(OFF_CENTRE, T)
    # Cells of 3 by 3 pixels: the middle of a cell is the middle one of its pixels.
    np.testing.assert_allclose(coarse, fine[31:210:3, 61:180:3], rtol=2e-3)


def test_a_rectangle_may_reach_outside_the_image(renderer: CameraRenderer) -> None:
    T = _pose((0.0, 0.0, 1.4), 0.3, 1.2)
    wide = renderer.depth(OFF_CENTRE, T, (-20, -10, 340, 250))
    np.testing.assert_allclose(wide[10:250, 20:340], renderer.depth(OFF_CENTRE, T), rtol=2e-3)


def test_nothing_is_infinitely_far(renderer: CameraRenderer) -> None:
    view = renderer.render(OFF_CENTRE, _pose((-30.0, 0.0, 1.4), math.pi))
    assert np.isinf(view.depth_m).all()
    assert (view.body_ids == -1).all()


def test_pictures_are_repeatable_and_not_empty(renderer: CameraRenderer, worker: Worker) -> None:
    worker.place((3.0, 0.0), math.pi)
    T = _pose((0.0, 0.0, 1.4), 0.0)
    picture = renderer.rgb(OFF_CENTRE, T)
    assert picture.shape == (240, 320, 3)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture, renderer.rgb(OFF_CENTRE, T))
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100


@pytest.mark.parametrize("stature_m", [1.6, 1.9])
@pytest.mark.parametrize("yaw_deg", [-70, -30, 0, 40, 70])
def test_points_of_the_face_lie_on_the_drawn_head(
    hall: Warehouse, renderer: CameraRenderer, stature_m: float, yaw_deg: float
) -> None:
    """Seen from its own side, each point is within 1.5 cm of the surface."""
    worker = Worker(hall, stature_m)
    worker.place((1.0, 0.0), 0.4, 0.0, 0.0, math.radians(yaw_deg), 0.2)
    head = worker.rotation_odom_head
    sides = {
        kp.NOSE: head[:, 1],
        kp.LEFT_EYE: head[:, 1],
        kp.RIGHT_EYE: head[:, 1],
        kp.LEFT_EAR: -head[:, 2],
        kp.RIGHT_EAR: head[:, 2],
    }
    camera = Camera(41, 41, 400.0, 400.0, 20.0, 20.0)
    for row, outwards in sides.items():
        point = worker.keypoints_odom_m[row]
        T = np.eye(4)
        forward = -outwards
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        T[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
        T[:3, 3] = point + 1.0 * outwards
        view = renderer.render(camera, T)
        assert view.body_ids[20, 20] == worker.body
        assert view.depth_m[20, 20] == pytest.approx(1.0, abs=0.015), kp.COCO_NAMES[row]
    worker.place((-30.0, 0.0), 0.0)


@pytest.mark.parametrize("stature_m", [1.5, 1.95])
def test_drawn_body_is_as_tall_as_its_stature(
    hall: Warehouse, renderer: CameraRenderer, stature_m: float
) -> None:
    worker = Worker(hall, stature_m, position_odom_m=(1.0, -0.5))
    # Straight down from 3 m, wide enough for the head.
    view = renderer.render(Camera(81, 81, 200.0, 200.0, 40.0, 40.0), _DOWN_FROM_3_M)
    assert 3.0 - view.depth_m[view.body_ids == worker.body].min() == pytest.approx(
        stature_m, abs=0.01
    )
    worker.place((-30.0, 0.0), 0.0)


@pytest.mark.parametrize("heading_deg", [0, 60, 135, 180, 270])
def test_joints_lie_inside_the_drawn_body(
    renderer: CameraRenderer, worker: Worker, heading_deg: float
) -> None:
    worker.place((3.2, 0.1), math.radians(heading_deg), 0.4, 1.2)
    T = _pose((0.0, 0.0, 1.2), 0.0)
    camera = Camera(320, 240, 190.0, 190.0, 160.0, 120.0)
    view = renderer.render(camera, T)
    points = _to_camera(T, worker.keypoints_odom_m)
    columns, rows = np.rint(camera.project(points)).astype(int).T
    body = [*range(5, 17)]
    assert (view.body_ids[rows, columns][body] == worker.body).all()
    # Nothing but the worker's own body lies in front of a joint, and by less than its girth.
    behind = points[body, 2] - view.depth_m[rows, columns][body]
    assert behind.min() > -0.02
    assert (behind < 0.16).sum() >= 6


def test_robots_camera_sees_the_worker_and_not_itself(
    hall: Warehouse, renderer: CameraRenderer, worker: Worker
) -> None:
    amr = Amr(hall)
    worker.place((2.5, 0.0), math.pi)
    camera = Camera.from_fov(320, 240, math.radians(60.0))
    view = renderer.render(camera, amr.T_odom_camera)
    assert not (view.body_ids == amr.body).any()
    assert (view.body_ids == worker.body).mean() > 0.05
    # And the worker, looking at the robot, sees it and not the inside of the own head.
    worker.place((2.5, 0.0), math.pi, head_pitch_rad=-0.2)
    view = renderer.render(camera, worker.T_odom_eyes)
    assert (view.body_ids == amr.body).mean() > 0.02
    assert not (view.body_ids == worker.body)[:160].any()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"roi_xyxy_px": (10, 10, 10, 20)}, "roi_xyxy_px"),
        ({"roi_xyxy_px": (0, 0, float("nan"), 20)}, "roi_xyxy_px"),
        ({"size_px": (0, 10)}, "size_px"),
        ({"T_odom_camera": np.ones((4, 4))}, "T_odom_camera"),
        ({"camera": Camera(32, 24, 30, 30, 16, 12, np.array([0.1, 0, 0, 0, 0]))}, "undistorted"),
    ],
)
def test_unusable_requests_are_refused(
    renderer: CameraRenderer, arguments: dict, message: str
) -> None:
    good = {"camera": OFF_CENTRE, "T_odom_camera": np.eye(4)}
    with pytest.raises(SimError, match=message):
        renderer.render(**{**good, **arguments})


def test_unusable_ranges_are_refused(hall: Warehouse) -> None:
    with pytest.raises(SimError, match="near_m"):
        CameraRenderer(hall, near_m=0.0)
    with pytest.raises(SimError, match="far_m"):
        CameraRenderer(hall, near_m=1.0, far_m=0.5)
