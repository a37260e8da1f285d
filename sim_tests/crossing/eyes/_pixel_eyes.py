"""Eyes that pass rendered images through the awareness pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception import AwarenessPipeline, Camera, FloorPlane, PersonObservation
from perception.arrays import FloatArray, ImageRgb

from ...world.camera import CameraTiming, CoarseSceneryRenderer, SensorConfig, expose
from ...world.errors import SimError
from .._stage import Stage, TrueView
from ._camera_eyes import Exposure, delivered_picture
from ._messages import NOBODY, Change, WorkerObservations

#: Frame rate of rendered cameras whose scenario gives none: images are costly to render.
PIXEL_RATE_HZ: Final = 10.0
# An observation shows a worker if the boxes overlap this much, or the positions are this close.
_MIN_IOU: Final = 0.3
_MAX_DISTANCE_M: Final = 0.5


class PixelEyes:
    """Eyes with a rendered camera and an awareness pipeline.

    The pipeline gets the image, its stamp and the floor, which a robot knows from its own pose and
    the mounting of its camera. Nothing else of the simulation reaches it. The worker of each
    observation is found afterwards, for metrics and drawings only.

    Raises:
        SimError: for a pipeline with another camera.
    """

    def __init__(
        self,
        stage: Stage,
        camera: Camera,
        sensor: SensorConfig,
        rng: np.random.Generator,
        pipeline: AwarenessPipeline,
        renderer: CoarseSceneryRenderer | None = None,
        change: Change[ImageRgb] | None = None,
    ) -> None:
        self._stage = stage
        self._pipeline = pipeline
        theirs = self._pipeline.camera
        # Rendered images have no distortion.
        if (theirs.width_px, theirs.height_px) != (camera.width_px, camera.height_px) or not (
            theirs.distortion is None and np.allclose(theirs.matrix, camera.matrix)
        ):
            raise SimError(
                f"the pipeline must have the scenario's camera ({camera.width_px} x "
                f"{camera.height_px} px, focal length {camera.fx_px:.1f} px, no distortion), got "
                f"{theirs.width_px} x {theirs.height_px} px, {theirs.fx_px:.1f} px"
            )
        self._change = change
        self._camera, self._sensor = camera, sensor
        (self._noise_rng,) = rng.spawn(1)
        self._renderer = CoarseSceneryRenderer(stage.warehouse, 1) if renderer is None else renderer

    def observe(self, exposure: Exposure) -> WorkerObservations | None:
        """Render an image; return the observations of the pipeline, each with its worker.

        None for an image that is no view, such as a black one.
        """
        view = self._renderer.render(self._camera, exposure.T_odom_camera)
        taken = expose(view.rgb, self._sensor, self._noise_rng)
        rgb = delivered_picture(self._change, taken, exposure)
        if rgb is None:
            return None
        floor = FloorPlane.from_pose(exposure.T_odom_camera_known)
        observations = self._pipeline.process(rgb, exposure.stamp_s, floor=floor)
        boxes = [_box_of(view.actors == worker.actor) for worker in self._stage.workers]
        workers = match_to_workers(observations, exposure.truth, boxes)
        return tuple(zip(observations, workers, strict=True))


def pixel_timing(timing: CameraTiming) -> CameraTiming:
    """Return the timing with :data:`PIXEL_RATE_HZ` where the scenario gives no rate."""
    return timing.model_copy(update={"rate_hz": timing.rate_hz or PIXEL_RATE_HZ})


def match_to_workers(
    observations: Sequence[PersonObservation],
    truth: Sequence[TrueView],
    boxes: Sequence[FloatArray | None],
) -> tuple[int, ...]:
    """Return the worker of each observation, one to one, or :data:`NOBODY`.

    Args:
        observations: the observations of one image.
        truth: the truth about each worker.
        boxes: (4,) box of the pixels that show each worker; None for an invisible worker.
    """
    matched = [NOBODY] * len(observations)
    if not observations or not truth:
        return tuple(matched)
    affinity = np.zeros((len(observations), len(truth)))
    for row, observation in enumerate(observations):
        for column, (view, box) in enumerate(zip(truth, boxes, strict=True)):
            if box is None:
                continue
            distance = float(np.linalg.norm(observation.position_camera_m - view.position_camera_m))
            close = distance <= _MAX_DISTANCE_M
            overlap = 0.0 if observation.box_xyxy_px is None else _iou(observation.box_xyxy_px, box)
            if close or overlap >= _MIN_IOU:
                affinity[row, column] = overlap + 1.0 / (1.0 + distance)
    for row, column in zip(*linear_sum_assignment(affinity, maximize=True), strict=True):
        if affinity[row, column] > 0.0:
            matched[row] = int(column)
    return tuple(matched)


def _box_of(mask: NDArray[np.bool_]) -> FloatArray | None:
    """Return the box (4,) of the true pixels, maxima exclusive; None without any."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return None
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=float)


def _iou(first: Any, second: Any) -> float:
    low, high = np.maximum(first[:2], second[:2]), np.minimum(first[2:], second[2:])
    shared = float(np.prod(np.clip(high - low, 0.0, None)))
    union = sum(float(np.prod(box[2:] - box[:2])) for box in (first, second)) - shared
    return shared / union if union > 0.0 else 0.0
