"""Pictures of the robot's camera with the overlay of ``awarenav estimate``."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from awarenav.overlay import OverlaidPerson, draw_people
from perception import AttentionCone, Camera, PersonDetection, PersonKeypoints
from perception.arrays import ImageRgb

from ..crossing import CrossingFrame, Stage
from ..crossing.sensors import PIXEL_RATE_HZ, KeypointCamera, KeypointNoise
from ..world.camera import CameraRenderer
from ..world.sightlines import SightLines

#: Longest time between two images of the slowest camera, with a margin.
CAMERA_PERIOD_S: Final = 1.1 / PIXEL_RATE_HZ
#: Simulated time between two pictures of a film.
PICTURE_S: Final = 0.2
#: Width and height of the pictures of a film.
CAMERA_PX: Final = (358, 400)
# Height of a line of text in them.
_LABEL_PX: Final = 31
# Part of the robot's field of view that they show.
_FOV_RAD: Final = math.radians(54.0)
# Pixels rendered per pixel of the picture, in each direction.
_SUPERSAMPLING: Final = 2


@dataclass(frozen=True, slots=True, eq=False)
class CameraPicture:
    """A picture of the robot's camera with its overlay.

    Attributes:
        rgb: (H, W, 3) RGB.
        whole: numbers of the people who are observed and wholly in the picture.
    """

    rgb: ImageRgb
    whole: frozenset[int]


class OverlayCamera:
    """Draws what the robot's camera sees, with the robot's newest observations."""

    def __init__(self, camera: Camera, text_px: int | None = None) -> None:
        self._camera, self._text_px = camera, text_px
        self._cone = AttentionCone()
        self._last: CrossingFrame | None = None
        self._renderer: CameraRenderer | None = None
        self._bodies: KeypointCamera | None = None

    def watch(self, frame: CrossingFrame) -> None:
        """Remember the newest observations; this gets every control cycle."""
        if frame.observations:
            self._last = frame

    def draw(self, frame: CrossingFrame, stage: Stage) -> CameraPicture:
        """Draw the picture of a control cycle."""
        self.watch(frame)
        if self._renderer is None:
            self._renderer = CameraRenderer(stage.warehouse, supersampling=_SUPERSAMPLING)
        rgb = self._renderer.rgb(self._camera, frame.T_odom_camera)
        seen = self._last
        if seen is None or frame.t_s - seen.t_s > CAMERA_PERIOD_S:
            return CameraPicture(rgb, frozenset())
        visible = self._visible(frame, stage)
        size_px = (self._camera.width_px, self._camera.height_px)
        people, whole = [], []
        for observation, worker in zip(seen.observations, seen.observed_workers, strict=True):
            if worker not in visible:
                continue
            detection, keypoints = visible[worker]
            box = detection.box_xyxy_px
            people.append(OverlaidPerson(replace(observation, box_xyxy_px=box), keypoints))
            if (box[:2] > 0.0).all() and (box[2:] < size_px).all():
                whole.append(worker)
        drawn = draw_people(rgb, self._camera, people, self._cone, text_px=self._text_px)
        return CameraPicture(drawn, frozenset(whole))

    def _visible(
        self, frame: CrossingFrame, stage: Stage
    ) -> dict[int, tuple[PersonDetection, PersonKeypoints]]:
        """Return box and keypoints, without noise, of each person in the picture, by number."""
        if self._bodies is None:
            hall = stage.warehouse
            sight = SightLines(hall.layout, hall.variant, hall.actors)
            noise = KeypointNoise(pixel_std_px=0.0, lift_std_m=0.0, miss_rate=0.0)
            self._bodies = KeypointCamera(self._camera, sight, noise, np.random.default_rng(0))
        workers = self._bodies.look(frame.T_odom_camera, stage.workers)
        detections = self._bodies.detect(None)
        found = self._bodies.estimate(None, detections)
        return dict(zip(workers, zip(detections, found, strict=True), strict=True))


class CameraRecorder:
    """An observer of a crossing that takes the pictures of the robot's camera for the film."""

    def __init__(self) -> None:
        self._overlay = OverlayCamera(Camera.from_fov(*CAMERA_PX, _FOV_RAD), _LABEL_PX)
        self._pictures: list[CameraPicture] = []

    @property
    def pictures(self) -> tuple[CameraPicture, ...]:
        """The pictures, one every :data:`PICTURE_S`."""
        return tuple(self._pictures)

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        """Take a picture if it is time for the next one."""
        self._overlay.watch(frame)
        if frame.t_s >= PICTURE_S * len(self._pictures) - 1e-9:
            self._pictures.append(self._overlay.draw(frame, stage))
