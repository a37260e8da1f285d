"""A camera that sees keypoints: true ones, projected, hidden by what stands in front, and noisy.

It stands where a person detector and a pose network would stand, so that everything behind them
runs as on a robot, at a fraction of the cost of rendering and inference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from perception import Camera, PersonDetection, PersonKeypoints
from perception.anthropometry import MEAN_STATURE_M
from perception.arrays import FloatArray
from tracking.config import StrictConfig

from ...world import FACE_DEPTH_M, FACE_KEYPOINTS, JOINT_DEPTH_M
from ...world.errors import SimError

_LAYOUT: Final = "coco_wholebody"
_LAYOUT_SIZE: Final = 133
_KEYPOINTS: Final = 23
# Of the bodies that hide: a face asks for a finer head than joints ask for limbs.
_FACE_DETAIL: Final = 1
_BODY_DETAIL: Final = 2
# Fewer seen keypoints than this (about a quarter of a body) and a detector finds nobody.
_MIN_SEEN: Final = 5
_NEAR_M: Final = 0.1


class KeypointNoise(StrictConfig):
    """How far keypoints are from the truth.

    Attributes:
        pixel_std_px: of each coordinate, independent between frames.
        lift_std_m: of each keypoint's depth relative to the body's root; 45 mm is what a current
            whole-body network shows.
        miss_rate: fraction of frames in which a visible person is not detected.
    """

    error: ClassVar[type[ValueError]] = SimError

    pixel_std_px: float = Field(default=1.0, ge=0.0)
    lift_std_m: float = Field(default=0.045, ge=0.0)
    miss_rate: float = Field(default=0.02, ge=0.0, le=1.0)


class TrueBody(Protocol):
    """What the camera asks of a worker."""

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(23, 3) COCO body keypoints, then the feet of COCO-WholeBody."""
        ...

    @property
    def stature_m(self) -> float:
        """Body height."""
        ...

    def reach_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box about all keypoints; cheaper than they are."""
        ...


class Sight(Protocol):
    """What the camera asks of the world: what stands in the way."""

    def blocked(
        self, eye_odom_m: FloatArray, ends_odom_m: FloatArray, detail: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """(K,) whether anything lies between the eye (3,) and each of the points (K, 3).

        ``detail`` (K,) is of the bodies held against each line: 0 the finest, 2 the coarsest.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class _Sighting:
    worker: int
    detection: PersonDetection
    keypoints: PersonKeypoints


class KeypointCamera:
    """Detector and pose estimator in one: see :class:`perception.PersonDetector`, `PoseEstimator`.

    Call :meth:`look` once a frame, then hand the camera to the pipeline.

    Args:
        camera: the camera model.
        sight: what hides what.
        noise: how far keypoints are from the truth.
        rng: source of that noise.
    """

    def __init__(
        self,
        camera: Camera,
        sight: Sight,
        noise: KeypointNoise,
        rng: np.random.Generator,
    ) -> None:
        self._camera = camera
        self._lines = sight
        self._noise = noise
        self._rng = rng
        self._sightings: tuple[_Sighting, ...] = ()
        self._sides = _frustum(camera)

    def look(self, T_odom_camera: FloatArray, workers: Sequence[TrueBody]) -> tuple[int, ...]:
        """Take a frame; returns which workers are in it, in the order of the detections."""
        sightings = (
            self._sight(index, worker, T_odom_camera) for index, worker in enumerate(workers)
        )
        self._sightings = tuple(seen for seen in sightings if seen is not None)
        return tuple(seen.worker for seen in self._sightings)

    def detect(self, image_rgb: Any) -> tuple[PersonDetection, ...]:
        """The people of the last frame; the picture itself is not used."""
        return tuple(seen.detection for seen in self._sightings)

    def estimate(
        self, image_rgb: Any, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Keypoints of the given detections, which must be those of the last frame."""
        by_detection = {id(seen.detection): seen.keypoints for seen in self._sightings}
        try:
            return tuple(by_detection[id(detection)] for detection in detections)
        except KeyError:
            raise SimError(
                "detections must be those that detect() returned for this frame"
            ) from None

    def _sight(self, index: int, worker: TrueBody, T_odom_camera: FloatArray) -> _Sighting | None:
        # Every worker draws the same amount of noise whether seen or not: what happens to one
        # never changes the luck of another.
        missed = self._rng.random() < self._noise.miss_rate
        pixel_noise = self._rng.normal(0.0, 1.0, (_KEYPOINTS, 2)) * self._noise.pixel_std_px
        lift_noise = self._rng.normal(0.0, 1.0, _KEYPOINTS) * self._noise.lift_std_m
        rotation, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
        if missed or self._is_outside(worker.reach_odom_m(), T_odom_camera):
            return None
        points_odom = worker.keypoints_odom_m
        points = (points_odom - origin) @ rotation
        pixels = self._camera.project(points)
        inside = (
            (points[:, 2] > _NEAR_M)
            & (pixels[:, 0] >= -0.5)
            & (pixels[:, 0] < self._camera.width_px - 0.5)
            & (pixels[:, 1] >= -0.5)
            & (pixels[:, 1] < self._camera.height_px - 0.5)
        )
        if np.count_nonzero(inside) < _MIN_SEEN:
            return None
        seen = inside & self._unhidden(points, points_odom, inside, origin)
        if np.count_nonzero(seen) < _MIN_SEEN:
            return None
        noisy = np.where(seen[:, None], pixels + pixel_noise, 0.0)
        # A lifting network knows proportions, not stature: its skeleton has the average size.
        root = points[11:13].mean(axis=0)
        lifted = (points - root) * (MEAN_STATURE_M / worker.stature_m)
        lifted[:, 2] += lift_noise
        keypoints = PersonKeypoints(
            _padded(noisy), _padded(lifted), _padded(seen.astype(float)), _LAYOUT
        )
        return _Sighting(index, self._box(noisy[seen]), keypoints)

    def _is_outside(self, box_odom_m: FloatArray, T_odom_camera: FloatArray) -> bool:
        """True only when all of a box (2, 3) lies beyond one side of the picture."""
        normals = self._sides @ T_odom_camera[:3, :3].T
        middle = 0.5 * (box_odom_m[0] + box_odom_m[1]) - T_odom_camera[:3, 3]
        half = 0.5 * (box_odom_m[1] - box_odom_m[0])
        return bool((normals @ middle + np.abs(normals) @ half < 0.0).any())

    def _box(self, pixels: FloatArray) -> PersonDetection:
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        # Keypoints lie inside the outline: hair, hands and shoes reach about a twelfth further.
        margin = 0.08 * float((high - low).max())
        corners = np.array([low - margin, high + margin])
        limit = np.array([self._camera.width_px, self._camera.height_px])
        box = np.minimum(np.maximum(corners, 0.0), limit).ravel()
        return PersonDetection(box, 0.9)

    def _unhidden(
        self, points: FloatArray, points_odom: FloatArray, inside: Any, eye_odom_m: FloatArray
    ) -> Any:
        """Which of the keypoints inside the image nothing hides."""
        unhidden = np.zeros(len(points), dtype=bool)
        rows = np.flatnonzero(inside)
        face = rows < FACE_KEYPOINTS
        # A line ends where the surface may lie before the keypoint, along the optical axis.
        tolerance = np.where(face, FACE_DEPTH_M, JOINT_DEPTH_M)
        share = np.maximum(1.0 - tolerance / points[rows, 2], 0.0)[:, None]
        ends = eye_odom_m + share * (points_odom[rows] - eye_odom_m)
        detail = np.where(face, _FACE_DETAIL, _BODY_DETAIL)
        unhidden[rows] = ~self._lines.blocked(eye_odom_m, ends, detail)
        return unhidden


def _frustum(camera: Camera) -> FloatArray:
    """(M, 3) normals, pointing inwards, of the planes that bound what a camera sees."""
    ahead = np.array([[0.0, 0.0, 1.0]])
    if camera.distortion is not None:  # whose picture is bounded by no planes
        return ahead
    left, top = (-0.5 - camera.cx_px) / camera.fx_px, (-0.5 - camera.cy_px) / camera.fy_px
    right = (camera.width_px - 0.5 - camera.cx_px) / camera.fx_px
    bottom = (camera.height_px - 0.5 - camera.cy_px) / camera.fy_px
    sides = [(1.0, 0.0, -left), (-1.0, 0.0, right), (0.0, 1.0, -top), (0.0, -1.0, bottom)]
    return np.concatenate([ahead, np.array(sides)])


def _padded(values: FloatArray) -> FloatArray:
    """Rows of the 23 body and foot keypoints in the 133 of COCO-WholeBody; the rest is unseen."""
    out = np.zeros((_LAYOUT_SIZE, *values.shape[1:]))
    out[: len(values)] = values
    return out
