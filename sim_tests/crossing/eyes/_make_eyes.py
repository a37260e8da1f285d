"""The eyes of a crossing by the name of the perception."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any, Final, get_args

import numpy as np

from perception import AttentionCone, AwarenessPipeline, Camera
from perception.anthropometry import UNUSUAL_SIZE_PROBABILITY
from perception.arrays import ImageRgb
from perception.documents import yaml_text
from perception.networks import OnnxSettings
from perception.surround import FlatView

from ...conditions import ORACLE, PerceptionKind
from ...scenario import CameraSpec, Scenario, load_networks
from ...world.camera import CoarseSceneryRenderer
from ...world.errors import SimError
from ...world.sightlines import SightLines
from .._stage import Stage
from ._camera_eyes import Eyes, MapView, PicturelessEyes, SurroundEyes, TrueEyes
from ._keypoint_camera import KeypointEyes, KeypointNoise
from ._messages import Change
from ._pixel_eyes import PixelEyes

# Statures of adults: within two and a half standard deviations of the mean.
_LEAST_ADULT_M: Final = 1.5
# An episode runs on one core, often beside others, and is the same on every computer.
_ONE_CORE: Final = OnnxSettings(intra_op_threads=1)


def make_eyes(
    kind: str,
    stage: Stage,
    camera: Camera,
    rng: np.random.Generator,
    *,
    cone: AttentionCone,
    noise: KeypointNoise,
    pipeline: AwarenessPipeline | None = None,
    pictures: Change[ImageRgb] | None = None,
) -> Eyes:
    """Return the eyes of a perception."""
    views = stage.scenario.camera.flat_views(camera)
    eyes: list[Eyes]
    if kind == "truth":
        eyes = [TrueEyes()]
    elif kind == ORACLE:
        eyes = [TrueEyes(MapView.of(stage.warehouse))]
    elif kind == "keypoints":
        warehouse = stage.warehouse
        sight = SightLines(warehouse.layout, warehouse.variant, warehouse.actors)
        unusual = unusual_size_probability(stage.scenario)
        eyes = [KeypointEyes(stage, camera, cone, noise, rng, sight, unusual) for _ in views]
    elif kind == "pixels":
        eyes = _pixel_eyes(stage, views, cone, rng, pipeline, pictures)
    else:
        valid = ", ".join(map(repr, get_args(PerceptionKind)))
        raise SimError(f"perception must be one of {valid}, got {kind!r}")
    made = eyes[0] if len(eyes) == 1 else SurroundEyes(views, eyes)
    return made if pictures is None or kind == "pixels" else PicturelessEyes(made, pictures)


def unusual_size_probability(scenario: Scenario) -> float:
    """Return what a robot may assume: 0 where all people are adults who stand, else the default."""
    if all(each.stature_m >= _LEAST_ADULT_M and not each.stays for each in scenario.people):
        return 0.0
    return UNUSUAL_SIZE_PROBABILITY


def _pipeline(scenario: Scenario, cone: AttentionCone) -> AwarenessPipeline:
    """Return a pipeline that has seen no image, with the scenario's or the shipped networks."""
    unusual = unusual_size_probability(scenario)
    networks = yaml_text(scenario.networks) if scenario.networks else ""
    return _shared_pipeline(scenario.camera, unusual, cone, networks).for_another_view()


# Scenarios with the same camera and the same people share one, because networks load slowly.
@lru_cache(maxsize=4)
def _shared_pipeline(
    spec: CameraSpec, unusual: float, cone: AttentionCone, networks: str
) -> AwarenessPipeline:
    camera = spec.camera(spec.picture_scale)
    settings: dict[str, Any] = {
        "cone": cone,
        # Workers in a crossing turn their heads; their eyes follow.
        "eye_in_head_std_rad": 0.0,
        "unusual_size_probability": unusual,
    }
    if not networks:
        return AwarenessPipeline(
            camera, onnx_settings=_ONE_CORE, simulator_networks=True, **settings
        )
    own = load_networks(networks)
    own = replace(own, settings={**own.settings, **settings})
    return AwarenessPipeline.of(own, camera)


def _pixel_eyes(
    stage: Stage,
    views: tuple[FlatView, ...],
    cone: AttentionCone,
    rng: np.random.Generator,
    pipeline: AwarenessPipeline | None,
    pictures: Change[ImageRgb] | None,
) -> list[Eyes]:
    """Return the eyes of every view; they share networks and renderer, but no image."""
    spec, camera = stage.scenario.camera, views[0].camera
    renderer = CoarseSceneryRenderer(stage.warehouse, spec.scenery_divisor)
    return [
        PixelEyes(
            stage,
            camera,
            spec.sensor,
            view_rng,
            _pipeline(stage.scenario, cone) if pipeline is None else pipeline,
            renderer,
            pictures,
        )
        for view_rng in ([rng] if len(views) == 1 else rng.spawn(len(views)))
    ]
