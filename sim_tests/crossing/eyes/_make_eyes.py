"""The eyes of a crossing by the name of the perception."""

from __future__ import annotations

from functools import lru_cache
from typing import Final, get_args

import numpy as np

from perception import AttentionCone, AwarenessPipeline, Camera
from perception.anthropometry import UNUSUAL_SIZE_PROBABILITY
from perception.arrays import FloatArray
from perception.networks import OnnxSettings
from perception.surround import FlatView

from ...conditions import ORACLE, PerceptionKind
from ...scenario import CameraSpec, Scenario
from ...world.camera import CoarseSceneryRenderer
from ...world.errors import SimError
from ...world.sightlines import SightLines
from .._stage import Stage
from ._eyes import Eyes, SurroundEyes
from ._keypoint_camera import KeypointNoise
from ._keypoint_eyes import KeypointEyes
from ._map_view import MapView
from ._pixel_eyes import PictureChange, PixelEyes
from ._true_eyes import TrueEyes

# Statures of adults: within two and a half standard deviations of the mean.
_LEAST_ADULT_M: Final = 1.5
# An episode runs on one core, often beside others, and is the same on every computer.
_ONE_CORE: Final = OnnxSettings(intra_op_threads=1)


def make_eyes(
    kind: str,
    stage: Stage,
    camera: Camera,
    cone: AttentionCone,
    noise: KeypointNoise,
    rng: np.random.Generator,
    pipeline: AwarenessPipeline | None = None,
    T_camera_assumed: FloatArray | None = None,
    change: PictureChange | None = None,
) -> Eyes:
    """Return the eyes of a perception.

    Args:
        kind: one of :data:`PerceptionKind`, or :data:`ORACLE`.
        stage: the stage of the crossing.
        camera: camera model of one view.
        cone: attention cone.
        noise: noise of the keypoint camera.
        rng: random generator of the noise.
        pipeline: pipeline for pixels; None for the shipped networks.
        T_camera_assumed: see :class:`PixelEyes`.
        change: a fault of the pictures, for pixels; None for none.

    Raises:
        SimError: for another kind.
    """
    if kind == "truth":
        return TrueEyes()
    if kind == ORACLE:
        return TrueEyes(MapView.of(stage.warehouse))
    views = stage.scenario.camera.flat_views(camera)
    if kind == "keypoints":
        warehouse = stage.warehouse
        sight = SightLines(warehouse.layout, warehouse.variant, warehouse.actors)
        unusual = unusual_size_probability(stage.scenario)
        eyes: list[Eyes] = [
            KeypointEyes(stage, camera, cone, noise, rng, sight, unusual) for _ in views
        ]
    elif kind == "pixels":
        eyes = _pixel_eyes(stage, views, cone, rng, pipeline, T_camera_assumed, change)
    else:
        valid = ", ".join(map(repr, get_args(PerceptionKind)))
        raise SimError(f"perception must be one of {valid}, got {kind!r}")
    return eyes[0] if len(views) == 1 else SurroundEyes(views, eyes)


def unusual_size_probability(scenario: Scenario) -> float:
    """Return what a robot may assume: 0 where all people are adults who stand, else the default."""
    if all(each.stature_m >= _LEAST_ADULT_M and not each.stays for each in scenario.people):
        return 0.0
    return UNUSUAL_SIZE_PROBABILITY


# Scenarios with the same camera and the same people share one, because networks load slowly.
@lru_cache(maxsize=4)
def _pipeline(camera: CameraSpec, unusual: float, cone: AttentionCone) -> AwarenessPipeline:
    """Return the pipeline with the shipped networks for rendered images.

    Args:
        camera: that of the scenario.
        unusual: probability of an unusual size that the robot may assume.
        cone: attention cone.

    Raises:
        PerceptionError: the shipped networks cannot be loaded.
    """
    return AwarenessPipeline(
        camera.camera(camera.picture_scale),
        cone=cone,
        # Workers in a crossing turn their heads; their eyes follow.
        eye_in_head_std_rad=0.0,
        unusual_size_probability=unusual,
        onnx_settings=_ONE_CORE,
    )


def _pixel_eyes(
    stage: Stage,
    views: tuple[FlatView, ...],
    cone: AttentionCone,
    rng: np.random.Generator,
    pipeline: AwarenessPipeline | None,
    T_camera_assumed: FloatArray | None,
    change: PictureChange | None,
) -> list[Eyes]:
    """Return the eyes of every view; they share networks and renderer."""
    spec, camera = stage.scenario.camera, views[0].camera
    renderer = CoarseSceneryRenderer(stage.warehouse, spec.scenery_divisor)
    if pipeline is None:
        pipeline = _pipeline(spec, unusual_size_probability(stage.scenario), cone)
    return [
        PixelEyes(
            stage,
            camera,
            spec.sensor,
            view_rng,
            pipeline,
            renderer,
            None
            if T_camera_assumed is None
            else view.T_camera_view.T @ T_camera_assumed @ view.T_camera_view,
            change,
        )
        for view, view_rng in zip(
            views, [rng] if len(views) == 1 else rng.spawn(len(views)), strict=True
        )
    ]
