"""A camera of which rendered images pass through the awareness pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception import AwarenessPipeline, FloorPlane, PersonObservation
from perception.arrays import FloatArray
from perception.documents import yaml_text
from perception.networks import OnnxSettings

from ...scenario import CameraSpec, load_networks
from ...world.camera import CoarseSceneryRenderer, expose
from ...world.errors import SimError
from .._messages import NOBODY, WorkerObservations
from .._stage import TrueView
from ._camera import CameraSensor, delivered, pipeline_settings
from ._sensor import SensorSetup, World

# An episode runs on one core, often beside others, and is the same on every computer.
_ONE_CORE: Final = OnnxSettings(intra_op_threads=1)
# An observation shows a worker if the boxes overlap this much, or the positions are this close.
_MIN_IOU: Final = 0.3
_MAX_DISTANCE_M: Final = 0.5


class Pixels(CameraSensor, name="pixels"):
    """A rendered camera and an awareness pipeline.

    The pipeline gets the image, its stamp and the floor, which a robot knows from its own pose and
    the mounting of its camera. Nothing else of the simulation reaches it. The worker of each
    observation is found afterwards, for metrics and drawings only.

    Raises:
        SimError: for a pipeline with another camera.
    """

    costly = has_pictures = True

    @staticmethod
    def scale(spec: CameraSpec) -> float:
        """Return the scenario's scale of pictures."""
        return spec.picture_scale

    def __init__(self, setup: SensorSetup) -> None:
        super().__init__(setup)
        spec, count = setup.stage.scenario.camera, len(self.views)
        # The views share networks and renderer, but no image.
        self._pipelines = [setup.pipeline or _pipeline(setup) for _ in range(count)]
        camera = self.camera
        theirs = self._pipelines[0].camera
        # Rendered images have no distortion.
        if (theirs.width_px, theirs.height_px) != (camera.width_px, camera.height_px) or not (
            theirs.distortion is None and np.allclose(theirs.matrix, camera.matrix)
        ):
            raise SimError(
                f"the pipeline must have the scenario's camera ({camera.width_px} x "
                f"{camera.height_px} px, focal length {camera.fx_px:.1f} px, no distortion), got "
                f"{theirs.width_px} x {theirs.height_px} px, {theirs.fx_px:.1f} px"
            )
        self._noise = spec.sensor
        generators = [self._rng] if count == 1 else self._rng.spawn(count)
        self._noise_rngs = [rng for each in generators for rng in each.spawn(1)]
        self._renderer = CoarseSceneryRenderer(self.stage.warehouse, spec.scenery_divisor)

    def observe(self, view: int, world: World) -> WorkerObservations | None:
        """Render an image; return the observations of the pipeline, each with its worker.

        None for an image that is no view, such as a black one.
        """
        seen = self._renderer.render(self.camera, world.T_odom_camera)
        taken = expose(seen.rgb, self._noise, self._noise_rngs[view])
        rgb = delivered(self._pictures, taken, world)
        if rgb is None:
            return None
        floor = FloorPlane.from_pose(world.T_odom_camera_known)
        observations = self._pipelines[view].process(rgb, world.t_s, floor=floor)
        boxes = [_box_of(seen.actors == worker.actor) for worker in self.stage.workers]
        workers = match_to_workers(observations, world.truth, boxes)
        return tuple(zip(observations, workers, strict=True))


def _pipeline(setup: SensorSetup) -> AwarenessPipeline:
    """Return a pipeline that has seen no image, with the scenario's or the shipped networks."""
    scenario, settings = setup.stage.scenario, tuple(pipeline_settings(setup).items())
    networks = yaml_text(scenario.networks) if scenario.networks else ""
    return _shared_pipeline(scenario.camera, settings, networks).for_another_view()


# Scenarios with the same camera and the same people share one, because networks load slowly.
@lru_cache(maxsize=4)
def _shared_pipeline(
    spec: CameraSpec, of_people: tuple[tuple[str, Any], ...], networks: str
) -> AwarenessPipeline:
    camera, settings = spec.camera(spec.picture_scale), dict(of_people)
    if not networks:
        return AwarenessPipeline(
            camera, onnx_settings=_ONE_CORE, simulator_networks=True, **settings
        )
    own = load_networks(networks)
    own = replace(own, settings={**own.settings, **settings})
    return AwarenessPipeline.of(own, camera)


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
