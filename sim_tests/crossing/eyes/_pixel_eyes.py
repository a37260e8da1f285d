"""The robot's own camera and networks: rendered pixels through the whole pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception import AwarenessPipeline, Camera, FloorPlane, PersonObservation
from perception.arrays import FloatArray

from ...world.camera import CameraTiming, PictureRenderer, SensorConfig, SimulatedCamera
from ...world.errors import SimError
from .._stage import Stage, TrueView

#: Index of an observation that shows none of the workers.
NOBODY: Final = -1
#: Frames a second of a camera whose scenario does not say: pictures are costly to render.
PIXEL_RATE_HZ: Final = 10.0
# A box shows a worker when it and the worker's pixels overlap so much, or stand as near.
_SAME_IOU: Final = 0.3
_SAME_PLACE_M: Final = 0.5


class PixelEyes:
    """Renders what the robot's camera sees and hands it to an awareness pipeline.

    The pipeline gets the picture, its stamp and the floor, which a robot knows from its own pose
    and the mounting of its camera. Nothing else of the simulation reaches it; which worker an
    observation shows is found out afterwards, for metrics and pictures only.

    Args:
        stage: what is seen.
        camera: of the robot.
        sensor: noise, exposure and blur.
        rng: of the sensor's noise.
        pipeline: what the pictures go through.
        renderer: of the pictures; None is a :class:`~sim_tests.CameraRenderer`.
        T_camera_assumed: (4, 4) the camera as the robot believes it to be mounted, in the true
            camera's frame; None where it is mounted as believed.

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
        renderer: PictureRenderer | None = None,
        T_camera_assumed: FloatArray | None = None,
    ) -> None:
        self._stage = stage
        self._pipeline = pipeline
        theirs = self._pipeline.camera
        # The renderer draws without distortion, whatever the pipeline believes.
        if (theirs.width_px, theirs.height_px) != (camera.width_px, camera.height_px) or not (
            theirs.distortion is None and np.allclose(theirs.matrix, camera.matrix)
        ):
            raise SimError(
                f"the pipeline must have the scenario's camera ({camera.width_px} x "
                f"{camera.height_px} px, focal length {camera.fx_px:.1f} px, no distortion), got "
                f"{theirs.width_px} x {theirs.height_px} px, {theirs.fx_px:.1f} px"
            )
        self._T_camera_assumed = T_camera_assumed
        self._camera = SimulatedCamera(
            stage.warehouse,
            camera,
            sensor=sensor,
            rng=rng,
            renderer=renderer,
        )

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Take a picture; return what the pipeline makes of it, each with its worker.

        An observation that shows none of the workers has the index :data:`NOBODY`.
        """
        frame = self._camera.capture(stamp_s, T_odom_camera)
        assumed = frame.T_odom_camera
        if self._T_camera_assumed is not None:
            assumed = assumed @ self._T_camera_assumed
        seen = self._pipeline.process(frame.rgb, stamp_s, floor=FloorPlane.from_pose(assumed))
        boxes = [_box_of(frame.actors == worker.actor) for worker in self._stage.workers]
        return tuple(zip(seen, who_is_who(seen, truth, boxes), strict=True))


def pixel_timing(timing: CameraTiming) -> CameraTiming:
    """The timing of a rendered camera: :data:`PIXEL_RATE_HZ` where the scenario names no rate."""
    return timing.model_copy(update={"rate_hz": timing.rate_hz or PIXEL_RATE_HZ})


def who_is_who(
    seen: Sequence[PersonObservation],
    truth: Sequence[TrueView],
    boxes: Sequence[FloatArray | None],
) -> tuple[int, ...]:
    """Which worker each observation shows, one to one, or :data:`NOBODY`.

    Args:
        seen: the observations.
        truth: of every worker.
        boxes: (4,) of the pixels that show each worker; None for one of whom nothing shows.
    """
    found = [NOBODY] * len(seen)
    if not seen or not truth:
        return tuple(found)
    affinity = np.zeros((len(seen), len(truth)))
    for row, observation in enumerate(seen):
        for column, (view, box) in enumerate(zip(truth, boxes, strict=True)):
            if box is None:  # nobody can have been seen who does not show
                continue
            distance = float(np.linalg.norm(observation.position_camera_m - view.position_camera_m))
            near = distance <= _SAME_PLACE_M
            overlap = 0.0 if observation.box_xyxy_px is None else _iou(observation.box_xyxy_px, box)
            if near or overlap >= _SAME_IOU:
                affinity[row, column] = overlap + 1.0 / (1.0 + distance)
    for row, column in zip(*linear_sum_assignment(affinity, maximize=True), strict=True):
        if affinity[row, column] > 0.0:
            found[row] = int(column)
    return tuple(found)


def _box_of(mask: NDArray[np.bool_]) -> FloatArray | None:
    """(4,) left, top, right, bottom of the true pixels, maxima exclusive."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return None
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=float)


def _iou(first: Any, second: Any) -> float:
    low, high = np.maximum(first[:2], second[:2]), np.minimum(first[2:], second[2:])
    shared = float(np.prod(np.clip(high - low, 0.0, None)))
    union = sum(float(np.prod(box[2:] - box[:2])) for box in (first, second)) - shared
    return shared / union if union > 0.0 else 0.0
