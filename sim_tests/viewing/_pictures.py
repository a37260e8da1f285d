"""Pictures of the robot's camera as JPEG, with the outlines that a page draws over them."""

from __future__ import annotations

import base64
import math
import time
from typing import Any, Final

import cv2
import numpy as np

from perception import AttentionCone, Camera, PersonObservation
from perception.arrays import FloatArray

from ..crossing import CrossingFrame, Stage
from ..crossing.eyes import NOBODY
from ..world.camera import CameraRenderer

_WIDTH_PX: Final = 480
_JPEG_QUALITY: Final = 72
_CONE_LENGTH_M: Final = 0.45
_CONE_POINTS: Final = 16
_RING_POINTS: Final = 33
# Points farther outside the picture than this, in its widths, are not drawn.
_FAR: Final = 4.0


class CameraPictures:
    """Renders the robot's camera while a crossing runs.

    A renderer that fails ends the pictures and not the crossing; ``trouble`` then says why.

    Args:
        pictures_hz: most pictures per second of simulated time.
        boxes_are_scaled: observed boxes are in pixels of the scenario's ``picture_scale``, as with
            perception from pixels.
        share: most of the elapsed time that rendering may take, > 0; 1 for no limit.

    Attributes:
        trouble: why there are no more pictures; empty without trouble.
    """

    def __init__(
        self, pictures_hz: float = 5.0, *, boxes_are_scaled: bool = False, share: float = 1.0
    ) -> None:
        self._period_s = 1.0 / pictures_hz
        self._boxes_are_scaled = boxes_are_scaled
        self._share = share
        self._due_s = 0.0
        self._not_before = 0.0
        self._renderer: CameraRenderer | None = None
        self.trouble = ""

    def take(self, frame: CrossingFrame, stage: Stage) -> dict[str, Any] | None:
        """Return the picture of a frame with its outlines; None if none is due.

        Lengths are shares of the picture's width and height.
        """
        begun = time.monotonic()
        if self.trouble or frame.t_s < self._due_s or begun < self._not_before:
            return None
        spec = stage.scenario.camera
        camera = spec.camera(_WIDTH_PX / spec.width_px)
        try:
            if self._renderer is None:
                self._renderer = CameraRenderer(stage.warehouse)
            image = self._renderer.rgb(camera, frame.T_odom_camera)
        except Exception as error:  # drivers of graphics raise errors of every kind
            self.trouble = f"The camera cannot be rendered here: {error}"
            return None
        _, data = cv2.imencode(
            ".jpg",
            cv2.cvtColor(image, cv2.COLOR_RGB2BGR),
            [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY],
        )
        self._due_s = max(self._due_s + self._period_s, frame.t_s)
        took_s = time.monotonic() - begun
        if self._share < 1.0:
            self._not_before = begun + took_s / self._share
        view = _View(camera, frame)
        box_scale = spec.picture_scale if self._boxes_are_scaled else 1.0
        size_px = np.array([spec.width_px, spec.height_px]) * box_scale
        return {
            "jpeg": base64.b64encode(data.tobytes()).decode("ascii"),
            "rings": [
                {
                    "id": each.track_id,
                    "awareness_lower": round(each.awareness_lower, 3),
                    "outline": view.ring(each.center_odom_m, each.radius_m),
                }
                for each in frame.constraints.obstacles
            ],
            "seen": [
                view.seen(observation, worker, stage, size_px)
                for observation, worker in zip(
                    frame.observations, frame.observed_workers, strict=True
                )
            ],
        }


class _View:
    """Projects points of a frame into its picture."""

    def __init__(self, camera: Camera, frame: CrossingFrame) -> None:
        self._camera = camera
        self._rotation = frame.T_odom_camera[:3, :3]
        self._origin = frame.T_odom_camera[:3, 3]
        self._size_px = np.array([camera.width_px, camera.height_px])

    def ring(self, center_odom_m: FloatArray, radius_m: float) -> list[list[float]]:
        """Return the visible runs of a circle on the floor, each as u, v, u, v …."""
        angles = np.linspace(0.0, 2.0 * math.pi, _RING_POINTS)
        ring = np.zeros((_RING_POINTS, 3))
        ring[:, :2] = center_odom_m + radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        runs: list[list[float]] = [[]]
        for point in self._shares(ring):
            if _drawable(point):
                runs[-1] += point.round(4).tolist()
            elif runs[-1]:
                runs.append([])
        return [run for run in runs if len(run) > 2]

    def seen(
        self, observation: PersonObservation, worker: int, stage: Stage, size_px: FloatArray
    ) -> dict[str, Any]:
        """Return the box and the cone of an observation; what cannot be drawn is empty."""
        box: list[float] = []
        if observation.box_xyxy_px is not None:
            shares = np.asarray(observation.box_xyxy_px).reshape(2, 2) / size_px
            place = self._camera.project(observation.position_camera_m[None])[0] / self._size_px
            # A box of another view of a camera with several is not in this picture.
            if _drawable(shares) and (np.abs(place - shares.mean(axis=0)) < 0.5).all():
                box = shares.round(4).ravel().tolist()
        cone: list[float] = []
        if observation.gaze_camera is not None and worker != NOBODY:
            eyes = stage.workers[worker].eyes_odom_m
            gaze = self._rotation @ observation.gaze_camera
            points = self._shares(np.vstack([eyes, _cone_rim(eyes, gaze)]))
            if _drawable(points):
                hull = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2)
                cone = hull.round(4).astype(float).round(4).ravel().tolist()
        alpha, spread = observation.awareness, observation.awareness_std
        return {
            "box": box,
            "cone": cone,
            "awareness": None if alpha is None else round(alpha, 3),
            "awareness_std": None if spread is None else round(spread, 3),
        }

    def _shares(self, points_odom_m: FloatArray) -> FloatArray:
        """Return points (N, 3) as shares (N, 2) of the picture's size; NaN behind the camera."""
        inside = self._camera.project((points_odom_m - self._origin) @ self._rotation)
        return np.asarray(inside / self._size_px)


def _cone_rim(apex: FloatArray, gaze: FloatArray) -> FloatArray:
    """Return points (N, 3) on the rim of an attention cone of the drawn length."""
    side = np.cross(gaze, [0.0, 0.0, 1.0] if abs(gaze[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    angles = np.linspace(0.0, 2.0 * math.pi, _CONE_POINTS, endpoint=False)[:, None]
    ring = np.cos(angles) * side + np.sin(angles) * np.cross(gaze, side)
    radius_m = _CONE_LENGTH_M * math.tan(AttentionCone().half_angle_rad)
    return np.asarray(apex + _CONE_LENGTH_M * gaze + radius_m * ring)


def _drawable(shares: FloatArray) -> bool:
    return bool(np.isfinite(shares).all() and np.abs(shares).max() < _FAR)
