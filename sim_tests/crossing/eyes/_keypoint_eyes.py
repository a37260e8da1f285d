"""Eyes that pass noisy keypoints through the awareness pipeline."""

from __future__ import annotations

import numpy as np

from perception import AttentionCone, AwarenessPipeline, Camera
from perception.anthropometry import UNUSUAL_SIZE_PROBABILITY
from perception.arrays import FloatArray

from ...world.sightlines import SightLines
from .._stage import Stage, TrueView
from ._eyes import WorkerObservations
from ._keypoint_camera import KeypointCamera, KeypointNoise


class KeypointEyes:
    """Eyes with a keypoint camera and the awareness pipeline.

    Args:
        stage: the stage of the crossing.
        camera: camera model.
        cone: attention cone of the pipeline.
        noise: noise of the keypoints.
        rng: random generator of the noise.
        sight: occlusion test of the hall.
        unusual_size_probability: as the pipeline takes it.
    """

    def __init__(
        self,
        stage: Stage,
        camera: Camera,
        cone: AttentionCone,
        noise: KeypointNoise,
        rng: np.random.Generator,
        sight: SightLines,
        unusual_size_probability: float = UNUSUAL_SIZE_PROBABILITY,
    ) -> None:
        self._stage = stage
        self._keypoints = KeypointCamera(camera, sight, noise, rng)
        self._pipeline = AwarenessPipeline(
            camera,
            self._keypoints,
            self._keypoints,
            cone=cone,
            keypoint_std_px=max(noise.pixel_std_px, 0.1),
            # Workers in a crossing turn their heads; their eyes follow.
            eye_in_head_std_rad=0.0,
            unusual_size_probability=unusual_size_probability,
        )
        self._blank = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> WorkerObservations:
        """Return the observations of the pipeline from the visible keypoints."""
        workers = self._keypoints.look(T_odom_camera, self._stage.workers)
        worker_of = {
            detection.box_xyxy_px.tobytes(): worker
            for detection, worker in zip(self._keypoints.detect(None), workers, strict=True)
        }
        return tuple(
            (observation, worker_of[observation.box_xyxy_px.tobytes()])
            for observation in self._pipeline.process(self._blank, stamp_s)
            if observation.box_xyxy_px is not None
        )
