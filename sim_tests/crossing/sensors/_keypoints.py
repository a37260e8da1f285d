"""A camera that detects keypoints: projected true keypoints with occlusion and noise.

It replaces person detector and pose network. Everything behind them runs as on a robot, at a
fraction of the cost of rendering and inference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception import AwarenessPipeline, Camera, PersonDetection, PersonKeypoints
from perception.anthropometry import MEAN_STATURE_M
from perception.arrays import FloatArray

from ...actors.body import Worker
from ...world import FACE_DEPTH_M, FACE_KEYPOINTS, JOINT_DEPTH_M
from ...world.errors import SimError
from ...world.sightlines import SightLines
from .._messages import WorkerObservations
from ._camera import CameraSensor, pipeline_settings
from ._sensor import KeypointNoise, SensorSetup, World

_LAYOUT: Final = "coco_wholebody"
_LAYOUT_SIZE: Final = 133
_KEYPOINTS: Final = 23
# Level of detail of the bodies that hide a keypoint; a face needs a finer head than a joint.
_FACE_DETAIL: Final = 1
_BODY_DETAIL: Final = 2
# A person with fewer visible keypoints (about a quarter of a body) is not detected.
_MIN_VISIBLE: Final = 5
_NEAR_M: Final = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class _InImage:
    """A person with enough keypoints inside the image, hidden or not.

    Attributes:
        worker: number of the person.
        stature_m: body height.
        points_odom_m: (23, 3) keypoints.
        points_m: (23, 3) in the camera frame.
        pixels_px: (23, 2) their projections, with noise.
        lift_noise_m: (23,) noise of their depths.
        rows: (K,) the keypoints inside the image.
    """

    worker: int
    stature_m: float
    points_odom_m: FloatArray
    points_m: FloatArray
    pixels_px: FloatArray
    lift_noise_m: FloatArray
    rows: NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class _VisiblePerson:
    worker: int
    detection: PersonDetection
    keypoints: PersonKeypoints


class KeypointCamera:
    """A :class:`perception.PersonDetector` and :class:`perception.PoseEstimator` in one.

    Call :meth:`look` once per frame, then run the pipeline with this camera.
    """

    def __init__(
        self, camera: Camera, sight: SightLines, noise: KeypointNoise, rng: np.random.Generator
    ) -> None:
        self._camera = camera
        self._sight = sight
        self._noise = noise
        self._rng = rng
        self._visible: tuple[_VisiblePerson, ...] = ()
        self._frustum_normals = _frustum_normals(camera)

    def look(self, T_odom_camera: FloatArray, workers: Sequence[Worker]) -> tuple[int, ...]:
        """Take a frame; return the visible workers' indices, in the order of the detections."""
        found = (
            self._in_image(index, worker, T_odom_camera) for index, worker in enumerate(workers)
        )
        inside = [person for person in found if person is not None]
        people = (
            self._visible_person(person, unhidden)
            for person, unhidden in zip(
                inside, self._unhidden(inside, T_odom_camera[:3, 3]), strict=True
            )
        )
        self._visible = tuple(person for person in people if person is not None)
        return tuple(person.worker for person in self._visible)

    def detect(self, image_rgb: Any) -> tuple[PersonDetection, ...]:
        """Return the people of the last frame; the image itself is not used."""
        return tuple(person.detection for person in self._visible)

    def estimate(
        self, image_rgb: Any, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        """Return the keypoints of detections, which must be those of the last frame."""
        by_detection = {id(person.detection): person.keypoints for person in self._visible}
        try:
            return tuple(by_detection[id(detection)] for detection in detections)
        except KeyError:
            raise SimError(
                "detections must be those that detect() returned for this frame"
            ) from None

    def _in_image(self, index: int, worker: Worker, T_odom_camera: FloatArray) -> _InImage | None:
        # Every worker draws the same amount of noise, visible or not, so that the noise of one
        # worker does not depend on another.
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
        rows = np.flatnonzero(inside)
        if len(rows) < _MIN_VISIBLE:
            return None
        return _InImage(
            index, worker.stature_m, points_odom, points, pixels + pixel_noise, lift_noise, rows
        )

    def _visible_person(
        self, person: _InImage, unhidden: NDArray[np.bool_]
    ) -> _VisiblePerson | None:
        """Return a person as detected; ``unhidden`` (K,) says which of their rows are seen."""
        if np.count_nonzero(unhidden) < _MIN_VISIBLE:
            return None
        visible = np.zeros(_KEYPOINTS, dtype=bool)
        visible[person.rows] = unhidden
        noisy = np.where(visible[:, None], person.pixels_px, 0.0)
        # A lifting network knows the proportions but not the stature: skeletons have average size.
        points = person.points_m
        root = points[11:13].mean(axis=0)
        lifted = (points - root) * (MEAN_STATURE_M / person.stature_m)
        lifted[:, 2] += person.lift_noise_m
        keypoints = PersonKeypoints(
            _padded(noisy), _padded(lifted), _padded(visible.astype(float)), _LAYOUT
        )
        return _VisiblePerson(person.worker, self._detection(noisy[visible]), keypoints)

    def _is_outside(self, box_odom_m: FloatArray, T_odom_camera: FloatArray) -> bool:
        """Return True only when all of a box (2, 3) lies beyond one side of the image."""
        normals = self._frustum_normals @ T_odom_camera[:3, :3].T
        middle = 0.5 * (box_odom_m[0] + box_odom_m[1]) - T_odom_camera[:3, 3]
        half = 0.5 * (box_odom_m[1] - box_odom_m[0])
        return bool((normals @ middle + np.abs(normals) @ half < 0.0).any())

    def _detection(self, pixels: FloatArray) -> PersonDetection:
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        # Keypoints lie inside the outline: hair, hands and shoes reach about a twelfth farther.
        margin = 0.08 * float((high - low).max())
        corners = np.array([low - margin, high + margin])
        limit = np.array([self._camera.width_px, self._camera.height_px])
        box = np.minimum(np.maximum(corners, 0.0), limit).ravel()
        return PersonDetection(box, 0.9)

    def _unhidden(
        self, people: Sequence[_InImage], eye_odom_m: FloatArray
    ) -> list[NDArray[np.bool_]]:
        """Return which of the keypoints inside the image are not hidden, person by person.

        The lines to all people are tested at once, which costs little more than those to one.
        """
        if not people:
            return []
        counts = [len(person.rows) for person in people]
        face = np.concatenate([person.rows for person in people]) < FACE_KEYPOINTS
        depth = np.concatenate([person.points_m[person.rows, 2] for person in people])
        points = np.concatenate([person.points_odom_m[person.rows] for person in people])
        # A line ends before the keypoint, where the surface of the body may be.
        tolerance = np.where(face, FACE_DEPTH_M, JOINT_DEPTH_M)
        share = np.maximum(1.0 - tolerance / depth, 0.0)[:, None]
        ends = eye_odom_m + share * (points - eye_odom_m)
        detail = np.where(face, _FACE_DETAIL, _BODY_DETAIL)
        unhidden = ~self._sight.blocked(eye_odom_m, ends, detail)
        return np.split(unhidden, np.cumsum(counts)[:-1])


class Keypoints(CameraSensor, name="keypoints"):
    """A keypoint camera and the awareness pipeline."""

    def __init__(self, setup: SensorSetup) -> None:
        super().__init__(setup)
        noise, warehouse = setup.noise, setup.stage.warehouse
        sight = SightLines(warehouse.layout, warehouse.variant, warehouse.actors)
        self._keypoints = [KeypointCamera(self.camera, sight, noise, self._rng) for _ in self.views]
        self._pipelines = [
            AwarenessPipeline(
                self.camera,
                each,
                each,
                keypoint_std_px=max(noise.pixel_std_px, 0.1),
                **pipeline_settings(setup),
            )
            for each in self._keypoints
        ]
        self._blank = np.zeros((self.camera.height_px, self.camera.width_px, 3), np.uint8)

    def observe(self, view: int, world: World) -> WorkerObservations:
        """Return the observations of the pipeline from the visible keypoints."""
        keypoints = self._keypoints[view]
        workers = keypoints.look(world.T_odom_camera, self.stage.workers)
        worker_of = {
            detection.box_xyxy_px.tobytes(): worker
            for detection, worker in zip(keypoints.detect(None), workers, strict=True)
        }
        depth_m = self.depth_m(world)
        return tuple(
            (observation, worker_of[observation.box_xyxy_px.tobytes()])
            for observation in self._pipelines[view].process(
                self._blank, world.t_s, depth_m=depth_m
            )
            if observation.box_xyxy_px is not None
        )

    def depth_m(self, world: World) -> FloatArray | None:
        """Return a depth picture (H, W) with the image; None for a camera that measures none."""
        return None


def _frustum_normals(camera: Camera) -> FloatArray:
    """Return the normals (M, 3), pointing inwards, of the planes that bound the field of view."""
    ahead = np.array([[0.0, 0.0, 1.0]])
    if camera.distortion is not None:  # an image with distortion is not bounded by planes
        return ahead
    left, top = (-0.5 - camera.cx_px) / camera.fx_px, (-0.5 - camera.cy_px) / camera.fy_px
    right = (camera.width_px - 0.5 - camera.cx_px) / camera.fx_px
    bottom = (camera.height_px - 0.5 - camera.cy_px) / camera.fy_px
    sides = [(1.0, 0.0, -left), (-1.0, 0.0, right), (0.0, 1.0, -top), (0.0, -1.0, bottom)]
    return np.concatenate([ahead, np.array(sides)])


def _padded(values: FloatArray) -> FloatArray:
    """Return the 23 body and foot keypoints as the first of 133 rows (COCO-WholeBody)."""
    out = np.zeros((_LAYOUT_SIZE, *values.shape[1:]))
    out[: len(values)] = values
    return out
