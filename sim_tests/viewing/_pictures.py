"""Pictures of the robot's camera as JPEG, with boxes, gazes and radii drawn into them."""

from __future__ import annotations

import base64
import time
from typing import Final

import cv2

from perception import AttentionCone

from ..crossing import CrossingFrame, Stage, draw_camera_view
from ..world.camera import CameraRenderer

_WIDTH_PX: Final = 480
_JPEG_QUALITY: Final = 75


class CameraPictures:
    """Renders the robot's camera while a crossing runs.

    A renderer that fails ends the pictures and not the crossing; ``trouble`` then says why.

    Args:
        pictures_hz: most pictures per second of simulated time.
        box_scale: as for :func:`~sim_tests.crossing.draw_camera_view`.
        share: most of the elapsed time that rendering may take, > 0; 1 for no limit.

    Attributes:
        trouble: why there are no more pictures; empty without trouble.
    """

    def __init__(
        self, pictures_hz: float = 5.0, *, box_scale: float = 1.0, share: float = 1.0
    ) -> None:
        self._period_s = 1.0 / pictures_hz
        self._box_scale = box_scale
        self._share = share
        self._due_s = 0.0
        self._not_before = 0.0
        self._renderer: CameraRenderer | None = None
        self.trouble = ""

    def take(self, frame: CrossingFrame, stage: Stage) -> str | None:
        """Return the picture of a frame, a JPEG in base64; None if none is due."""
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
        drawn = draw_camera_view(
            image,
            camera,
            frame,
            stage,
            AttentionCone(),
            box_scale=self._box_scale,
            captions=False,
        )
        _, data = cv2.imencode(
            ".jpg",
            cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR),
            [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY],
        )
        self._due_s = max(self._due_s + self._period_s, frame.t_s)
        if self._share < 1.0:
            self._not_before = begun + (time.monotonic() - begun) / self._share
        return base64.b64encode(data.tobytes()).decode("ascii")
