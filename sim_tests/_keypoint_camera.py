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

from ._errors import SimError
from ._sight import FACE_DEPTH_M, JOINT_DEPTH_M

_LAYOUT: Final = "coco_wholebody"
_LAYOUT_SIZE: Final = 133
_HEAD: Final = slice(0, 5)
# Of the bodies that hide: a face asks for a finer head than joints ask for limbs.
_HEAD_DETAIL: Final = 1
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


class Sight(Protocol):
    """What the camera asks of the world: what stands in the way."""

    def blocked(
        self, eye_odom_m: FloatArray, ends_odom_m: FloatArray, detail: int
    ) -> NDArray[np.bool_]:
        """(K,) whether anything lies between the eye (3,) and each of the points (K, 3).

        ``detail`` is of the bodies held against the lines: 0 the finest, 2 the coarsest.
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
        points_odom = worker.keypoints_odom_m
        rotation, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
        points = (points_odom - origin) @ rotation
        count = len(points)
        # Every worker draws the same amount of noise whether seen or not: what happens to one
        # never changes the luck of another.
        missed = self._rng.random() < self._noise.miss_rate
        pixel_noise = self._rng.normal(0.0, 1.0, (count, 2)) * self._noise.pixel_std_px
        lift_noise = self._rng.normal(0.0, 1.0, count) * self._noise.lift_std_m
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
        if missed or np.count_nonzero(seen) < _MIN_SEEN:
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

    def _box(self, pixels: FloatArray) -> PersonDetection:
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        # Keypoints lie inside the outline: hair, hands and shoes reach about a twelfth further.
        margin = 0.08 * float((high - low).max())
        limit = np.array([self._camera.width_px, self._camera.height_px])
        box = np.concatenate(
            [np.clip(low - margin, 0.0, limit), np.clip(high + margin, 0.0, limit)]
        )
        return PersonDetection(box, 0.9)

    def _unhidden(
        self, points: FloatArray, points_odom: FloatArray, inside: Any, eye_odom_m: FloatArray
    ) -> Any:
        """Which of the keypoints inside the image nothing hides."""
        rows = np.arange(len(points))
        unhidden = np.zeros(len(points), dtype=bool)
        for chosen, depth_m, detail in (
            (rows[_HEAD][inside[_HEAD]], FACE_DEPTH_M, _HEAD_DETAIL),
            (rows[5:][inside[5:]], JOINT_DEPTH_M, _BODY_DETAIL),
        ):
            if len(chosen):
                # What lies deeper under the surface than the tolerance along the optical axis.
                share = np.maximum(1.0 - depth_m / points[chosen, 2], 0.0)[:, None]
                ends = eye_odom_m + share * (points_odom[chosen] - eye_odom_m)
                unhidden[chosen] = ~self._lines.blocked(eye_odom_m, ends, detail)
        return unhidden


def _padded(values: FloatArray) -> FloatArray:
    """Rows of the 23 body and foot keypoints in the 133 of COCO-WholeBody; the rest is unseen."""
    out = np.zeros((_LAYOUT_SIZE, *values.shape[1:]))
    out[: len(values)] = values
    return out
