"""People of any size before a simulated camera, and what the pipeline says of their place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from perception import (
    AwarenessPipeline,
    Camera,
    FloorPlane,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
)
from perception.arrays import FloatArray
from sim_tests.actors.body import Worker
from sim_tests.crossing.eyes import KeypointCamera, KeypointNoise
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer

Posture = Literal["standing", "seated", "bent"]
Cut = Literal["whole", "shelf", "border"]
Cues = Literal["none", "floor", "depth"]

CAMERA: Final = Camera.from_fov(640, 480, math.radians(60.0))
#: Looking along odom x from a height of 1.2 m.
T_ODOM_CAMERA: Final = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1.0]])
STATURES_M: Final = (1.0, 1.1, 1.25, 1.4, 1.6, 1.75, 1.9)
#: 95 % of a normal error of three dimensions lie within this squared Mahalanobis distance.

_LOOKS: Final = ("jamila", "mateo", "linnea", "kofi", "ivan")
_BLANK: Final = np.zeros((CAMERA.height_px, CAMERA.width_px, 3), np.uint8)
# Errors of the floor that a robot assumes, as FloorPlane has them by default.
_FLOOR_HEIGHT_STD_M, _FLOOR_TILT_STD_RAD = 0.02, 0.01
_BENT_RAD: Final = (0.35, 1.2)
_SHELF_SHARE: Final = (0.45, 0.6)  # of the stature, or above the hips of somebody seated


@dataclass(frozen=True, slots=True)
class Case:
    """Somebody before the camera.

    Attributes:
        stature_m: standing height.
        posture: of the body.
        cut: what hides their legs.
        skeleton: whether the pose network finds a skeleton, or there is the box alone.
        look: worker.
        place_m: (x, y) in odom.
        heading_rad: of the body.
        bent_rad: of the trunk, if it is bent.
        seed: of the noise.
    """

    stature_m: float
    posture: Posture
    cut: Cut
    skeleton: bool
    look: str
    place_m: tuple[float, float]
    heading_rad: float
    bent_rad: float
    seed: int


@dataclass(frozen=True, slots=True)
class Result:
    """Error of an observation.

    Attributes:
        range_error: placed range over true range, minus one.
        mahalanobis2: squared Mahalanobis distance of the position from the truth.
        range_std: relative standard deviation of the range, as reported.
    """

    range_error: float
    mahalanobis2: float
    range_std: float


def cases(
    stature_m: float, posture: Posture, cut: Cut, *, skeleton: bool = True, count: int, seed: int
) -> Iterator[Case]:
    """Yield ``count`` people at 1.5 to 5.5 m; those whom the border cuts at 0.8 to 2 m."""
    rng = np.random.default_rng([seed, round(100 * stature_m), len(posture), len(cut)])
    for number in range(count):
        away_m = rng.uniform(*((0.8, 2.0) if cut == "border" else (1.5, 5.5)))
        yield Case(
            stature_m,
            posture,
            cut,
            skeleton,
            _LOOKS[number % len(_LOOKS)],
            (away_m, rng.uniform(-0.2, 0.2) * away_m),
            rng.uniform(-math.pi, math.pi),
            rng.uniform(*_BENT_RAD),
            seed * 1000 + number,
        )


class Body:
    """A worker in a posture, as :class:`~sim_tests.crossing.eyes.KeypointCamera` looks at it.

    Args:
        worker: of the stature of the case; it is placed.
        case: where and how.
    """

    def __init__(self, worker: Worker, case: Case) -> None:
        activity = "sitting" if case.posture == "seated" else "none"
        worker.place(case.place_m, case.heading_rad, activity=activity)
        points, chest = worker.keypoints_odom_m, worker.chest_odom_m
        if case.posture == "bent":
            points, chest = _bent(points, chest, case)
        self.keypoints_odom_m: FloatArray = points
        self.chest_odom_m: FloatArray = chest
        self.stature_m = case.stature_m

    def reach_odom_m(self) -> FloatArray:
        """Return the corners (2, 3) of a box around all keypoints."""
        points = self.keypoints_odom_m
        return np.array([points.min(axis=0), points.max(axis=0)])


def _bent(points: FloatArray, chest: FloatArray, case: Case) -> tuple[FloatArray, FloatArray]:
    """Return keypoints and chest with everything above the hips bent forward about them."""
    forward = np.array([math.cos(case.heading_rad), math.sin(case.heading_rad), 0.0])
    side, up = np.cross([0.0, 0.0, 1.0], forward), np.array([0.0, 0.0, 1.0])
    c, s = math.cos(case.bent_rad), math.sin(case.bent_rad)
    axes = np.array([forward, side, up])
    turn = axes.T @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ axes
    hips = points[11:13].mean(axis=0)
    bent = points.copy()
    bent[:11] = hips + (points[:11] - hips) @ turn.T
    return bent, hips + turn @ (chest - hips)


class _Shelf:
    """A shelf that hides everything below a height, close before the person."""

    def __init__(self, top_m: float) -> None:
        self._top_m = top_m

    def blocked(self, eye_odom_m: FloatArray, ends_odom_m: FloatArray, detail: Any) -> Any:
        return ends_odom_m[:, 2] < self._top_m


class _BoxOnly(KeypointCamera):
    """A keypoint camera without keypoints, whose boxes end at the border that cuts the person."""

    def look(self, T_odom_camera: FloatArray, workers: Any) -> tuple[int, ...]:
        points = (workers[0].keypoints_odom_m - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]
        self._is_cut = bool((CAMERA.project(points)[:, 1] > CAMERA.height_px).any())
        return super().look(T_odom_camera, workers)

    def detect(self, image_rgb: Any) -> tuple[PersonDetection, ...]:
        found = super().detect(image_rgb)
        if not self._is_cut:
            return found
        lower = float(CAMERA.height_px)
        boxes = [np.array([*one.box_xyxy_px[:3], lower]) for one in found]
        return tuple(PersonDetection(box, one.score) for box, one in zip(boxes, found, strict=True))

    def estimate(self, image_rgb: Any, detections: Any) -> tuple[PersonKeypoints, ...]:
        return tuple(
            replace(person, scores=np.zeros(len(person.scores)))
            for person in super().estimate(image_rgb, super().detect(image_rgb))
        )


class HowFar:
    """The simulated camera and its pipeline, with and without further cues.

    Args:
        warehouse: an empty floor, open until the end.
    """

    def __init__(self, warehouse: Warehouse) -> None:
        self._warehouse = warehouse
        self._renderer = CameraRenderer(warehouse)
        self._workers: dict[tuple[str, float], Worker] = {}

    def worker(self, look: str, stature_m: float) -> Worker:
        """Return the worker of this look and stature."""
        if (look, stature_m) not in self._workers:
            self._workers[look, stature_m] = Worker(self._warehouse, stature_m, look=look)
        return self._workers[look, stature_m]

    def observed(self, case: Case, cues: Cues) -> tuple[PersonObservation, FloatArray] | None:
        """Return what the pipeline says of a case, and the true chest (3,) in the camera frame.

        It is None if too little of the person is in view.
        """
        rng = np.random.default_rng([case.seed, 22])
        worker = self.worker(case.look, case.stature_m)
        body = Body(worker, case)
        hips_m = float(body.keypoints_odom_m[11:13, 2].mean())
        low, high = _SHELF_SHARE
        top_m = rng.uniform(low, high) * case.stature_m
        if case.posture == "seated":
            top_m = hips_m + (top_m - low * case.stature_m)
        sight = _Shelf(top_m if case.cut == "shelf" else -1.0)
        kind = KeypointCamera if case.skeleton else _BoxOnly
        eye = kind(CAMERA, sight, KeypointNoise(miss_rate=0.0), rng)
        depth_m = self._depth(worker, body, case, rng) if cues == "depth" else None
        worker.place((self._warehouse.layout.x_min_m - 5.0, 0.0), 0.0)
        if not eye.look(T_ODOM_CAMERA, [body]):
            return None
        floor = _assumed_floor(rng) if cues == "floor" else None
        found = AwarenessPipeline(CAMERA, eye, eye, floor=floor).process(
            _BLANK, 0.0, depth_m=depth_m
        )
        if not found:
            return None
        truth = (body.chest_odom_m - T_ODOM_CAMERA[:3, 3]) @ T_ODOM_CAMERA[:3, :3]
        return found[0], truth

    def results(self, people: Iterable[Case], cues: Cues) -> list[Result]:
        """Return the errors of all people of whom enough is in view."""
        seen = (self.observed(case, cues) for case in people)
        return [_result(*one) for one in seen if one is not None]

    def _depth(
        self, worker: Worker, body: Body, case: Case, rng: np.random.Generator
    ) -> FloatArray:
        """Return a depth image: 1 % of wrong scale, 0.5 % of noise, 20 % of holes, 3 px off."""
        if case.posture == "bent":
            depth = _depth_of_trunk(body)
        else:
            depth = self._renderer.depth(CAMERA, T_ODOM_CAMERA).copy()
        depth *= 1.0 + rng.normal(0.0, 0.01)
        depth *= 1.0 + rng.normal(0.0, 0.005, depth.shape)
        depth[rng.random(depth.shape) < 0.2] = 0.0
        return np.roll(depth, rng.integers(-3, 4, 2), (0, 1))


def _assumed_floor(rng: np.random.Generator) -> FloorPlane:
    normal = np.array([0.0, -1.0, 0.0]) + rng.normal(0.0, _FLOOR_TILT_STD_RAD, 3)
    height_m = float(T_ODOM_CAMERA[2, 3] + rng.normal(0.0, _FLOOR_HEIGHT_STD_M))
    return FloorPlane(
        normal / np.linalg.norm(normal), height_m, _FLOOR_HEIGHT_STD_M, _FLOOR_TILT_STD_RAD
    )


def _depth_of_trunk(body: Body) -> FloatArray:
    """Return the depth (H, W) of spheres that fill a bent trunk, for which there is no skin."""
    scale = body.stature_m / 1.75
    points = body.keypoints_odom_m
    along, across = (axis.ravel()[:, None] for axis in np.mgrid[0:1:12j, 0:1:5j])
    upper = points[5] + across * (points[6] - points[5])
    lower = points[11] + across * (points[12] - points[11])
    centres = upper + along * (lower - upper)
    centres = (centres - T_ODOM_CAMERA[:3, 3]) @ T_ODOM_CAMERA[:3, :3]
    rows, columns = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px]
    rays = np.ones((CAMERA.height_px, CAMERA.width_px, 3))
    rays[..., :2] = CAMERA.normalise(
        np.column_stack((columns.ravel(), rows.ravel())).astype(float)
    ).reshape(*rows.shape, 2)
    squared = (rays * rays).sum(axis=-1)
    depth = np.full(rows.shape, np.inf)
    for centre in centres:
        # z of the nearer point where the ray meets the sphere.
        half = rays @ centre
        rest = half * half - squared * (centre @ centre - (0.12 * scale) ** 2)
        hit = rest > 0.0
        depth[hit] = np.minimum(depth[hit], (half[hit] - np.sqrt(rest[hit])) / squared[hit])
    return depth


def _result(person: PersonObservation, truth_m: FloatArray) -> Result:
    place, covariance = person.position_camera_m, person.position_covariance_m2
    error, range_m = place - truth_m, float(np.linalg.norm(place))
    return Result(
        range_m / float(np.linalg.norm(truth_m)) - 1.0,
        float(error @ np.linalg.solve(covariance, error)),
        math.sqrt(place @ covariance @ place) / range_m**2,
    )
