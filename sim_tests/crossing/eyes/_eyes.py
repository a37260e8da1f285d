"""What a robot that knows its hall expects to see: its camera's view less what racks hide.

What every kind of eyes offers.

Eyes all around: several views of one camera, and everybody once.

How the robot sees in a crossing: the truth itself, keypoints, or pixels through the pipeline.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, Protocol, get_args

import numpy as np

from perception import AttentionCone, AwarenessPipeline, Camera, PersonObservation
from perception.arrays import FloatArray
from perception.surround import FlatView, merge_views
from tracking import View

from ...world import Warehouse, crosses_boxes
from ...world.camera import CameraTiming, CoarseSceneryRenderer, FrameClock, FrameQueue
from ...world.errors import SimError
from ...world.sightlines import SightLines
from .._stage import Stage, TrueView
from ._keypoint_camera import KeypointCamera, KeypointNoise
from ._pixel_eyes import PixelEyes

# Lower things hide legs at most.
_HIDING_HEIGHT_M = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class MapView:
    """A view for the tracker: in the camera's field, in range, and with no rack in between.

    Attributes:
        camera: field and range of the camera; None looks all around and as far as may be.
        boxes_odom_m: (N, 4) what is high enough to hide a person.
    """

    camera: View | None
    boxes_odom_m: FloatArray

    @classmethod
    def of(cls, warehouse: Warehouse, camera: View | None = None) -> MapView:
        """The view in a hall whose racks and walls the robot knows."""
        high = warehouse.layout.obstacle_heights_m >= _HIDING_HEIGHT_M
        return cls(camera, warehouse.obstacle_boxes_odom[high])

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        """Return (N,) in [0, 1]; see :class:`tracking.View`."""
        hidden = crosses_boxes(self.boxes_odom_m, T_odom_camera[:2, 3], positions_odom_m)
        if self.camera is None:
            return np.where(hidden, 0.0, 1.0)
        return np.where(hidden, 0.0, self.camera.visibility(positions_odom_m, T_odom_camera))


class Eyes(Protocol):
    """Makes the observations of one frame."""

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Return each observation with the index of the worker that it shows, −1 for none."""
        ...


class SurroundEyes:
    """What several views of one wide camera see, merged as on a robot.

    Args:
        views: of the camera, the first one straight ahead.
        eyes: of each view.
    """

    def __init__(self, views: Sequence[FlatView], eyes: Sequence[Eyes]) -> None:
        self._views = tuple(views)
        self._eyes = tuple(eyes)

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Look into every view; boxes are those of the first view, None for people in others."""
        seen = [
            eyes.observe(
                stamp_s,
                T_odom_camera @ view.T_camera_view,
                tuple(_in_view(each, view) for each in truth),
            )
            for view, eyes in zip(self._views, self._eyes, strict=True)
        ]
        merged = merge_views(self._views, [[found for found, _ in rows] for rows in seen])
        return tuple(
            (
                each.observation if each.view == 0 else replace(each.observation, box_xyxy_px=None),
                seen[each.view][each.row][1],
            )
            for each in merged
        )


def _in_view(truth: TrueView, view: FlatView) -> TrueView:
    """The truth about a person in the view's frame."""
    rotation = view.rotation_camera_view
    return replace(
        truth,
        position_camera_m=truth.position_camera_m @ rotation,
        gaze_camera=truth.gaze_camera @ rotation,
    )


PerceptionKind = Literal["truth", "keypoints", "pixels"]
#: One more, for comparison: the truth about everybody, all around, whom no rack hides.
ORACLE: Final = "oracle"

# The truth is handed on with a spread small enough to be believed and large enough to be a number.
_TRUE_POSITION_STD_M: Final = 0.01
_TRUE_AWARENESS_STD: Final = 0.02
_TRUE_RANGE_M: Final = 20.0


class TrueEyes:
    """α and position straight from the simulator.

    Args:
        view: whom these eyes can see; None looks all around and through walls.
    """

    def __init__(self, view: View | None = None) -> None:
        self._view = view

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Return every worker within 20 m who can be seen as it is."""
        seen = self._seen(T_odom_camera, truth)
        return tuple(
            (
                PersonObservation(
                    stamp_s=stamp_s,
                    position_camera_m=view.position_camera_m,
                    position_covariance_m2=_TRUE_POSITION_STD_M**2 * np.eye(3),
                    gaze_camera=view.gaze_camera,
                    awareness=view.awareness,
                    awareness_std=_TRUE_AWARENESS_STD,
                    score=1.0,
                    box_xyxy_px=None,
                ),
                index,
            )
            for index, view in enumerate(truth)
            if seen[index] and float(np.linalg.norm(view.position_camera_m)) <= _TRUE_RANGE_M
        )

    def _seen(self, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]) -> list[bool]:
        if self._view is None or not truth:
            return [True] * len(truth)
        positions_camera = np.array([view.position_camera_m for view in truth])
        positions_odom = positions_camera @ T_odom_camera[:2, :3].T + T_odom_camera[:2, 3]
        visible: list[bool] = (self._view.visibility(positions_odom, T_odom_camera) > 0.0).tolist()
        return visible


class KeypointEyes:
    """A keypoint camera and the whole of the perception package behind it."""

    def __init__(
        self,
        stage: Stage,
        camera: Camera,
        cone: AttentionCone,
        noise: KeypointNoise,
        rng: np.random.Generator,
        sight: SightLines,
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
        )
        self._blank = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)

    def observe(
        self, stamp_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[tuple[PersonObservation, int], ...]:
        """Return what the pipeline makes of the keypoints seen now."""
        seen = self._keypoints.look(T_odom_camera, self._stage.workers)
        worker_of = {
            detection.box_xyxy_px.tobytes(): worker
            for detection, worker in zip(self._keypoints.detect(None), seen, strict=True)
        }
        return tuple(
            (observation, worker_of[observation.box_xyxy_px.tobytes()])
            for observation in self._pipeline.process(self._blank, stamp_s)
            if observation.box_xyxy_px is not None
        )


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """What the robot learns from one frame, when it learns it.

    Attributes:
        stamp_s: when the frame was taken.
        T_odom_camera: (4, 4) where the camera was then.
        seen: each observation with the index of the worker that it shows.
    """

    stamp_s: float
    T_odom_camera: FloatArray
    seen: tuple[tuple[PersonObservation, int], ...]


class TimedEyes:
    """Eyes behind a camera with a frame rate, losses and delays.

    Args:
        eyes: what sees a frame that was taken.
        timing: of the camera.
        rng: of losses and delays.
    """

    def __init__(self, eyes: Eyes, timing: CameraTiming, rng: np.random.Generator) -> None:
        self._eyes = eyes
        self._clock = FrameClock(timing, rng)
        self._queue: FrameQueue[Sighting] = FrameQueue()

    def look(
        self, now_s: float, T_odom_camera: FloatArray, truth: tuple[TrueView, ...]
    ) -> tuple[Sighting, ...]:
        """Take a frame if one is due; return what has arrived by now, in order of arrival."""
        due, delivery_s = self._clock.tick(now_s)
        if due and delivery_s is not None:
            seen = self._eyes.observe(now_s, T_odom_camera, truth)
            self._queue.put(now_s, delivery_s, Sighting(now_s, T_odom_camera, seen))
        return self._queue.take(now_s)


def make_eyes(
    kind: str,
    stage: Stage,
    camera: Camera,
    cone: AttentionCone,
    noise: KeypointNoise,
    rng: np.random.Generator,
    pipeline: AwarenessPipeline | None = None,
    T_camera_assumed: FloatArray | None = None,
) -> Eyes:
    """Return the eyes called ``kind``; raises SimError for others.

    ``noise`` is of the keypoint camera; ``pipeline`` works on pixels, default the shipped networks;
    ``T_camera_assumed`` is as for :class:`~sim_tests.crossing.eyes._pixel_eyes.PixelEyes`.
    """
    if kind == "truth":
        return TrueEyes()
    if kind == ORACLE:
        return TrueEyes(MapView.of(stage.warehouse))
    views = stage.scenario.camera.flat_views(camera)
    if kind == "keypoints":
        warehouse = stage.warehouse
        sight = SightLines(warehouse.layout, warehouse.variant, warehouse.actors)
        eyes: list[Eyes] = [KeypointEyes(stage, camera, cone, noise, rng, sight) for _ in views]
    elif kind == "pixels":
        eyes = _pixel_eyes(stage, views, cone, rng, pipeline, T_camera_assumed)
    else:
        valid = ", ".join(map(repr, get_args(PerceptionKind)))
        raise SimError(f"perception must be one of {valid}, got {kind!r}")
    return eyes[0] if len(views) == 1 else SurroundEyes(views, eyes)


def _pixel_eyes(
    stage: Stage,
    views: tuple[FlatView, ...],
    cone: AttentionCone,
    rng: np.random.Generator,
    pipeline: AwarenessPipeline | None,
    T_camera_assumed: FloatArray | None,
) -> list[Eyes]:
    """Eyes for every view; they share networks and renderer."""
    spec, camera = stage.scenario.camera, views[0].camera
    renderer = CoarseSceneryRenderer(stage.warehouse, spec.scenery_divisor)
    if pipeline is None:
        # Workers in a crossing turn their heads; their eyes follow.
        pipeline = AwarenessPipeline(camera, cone=cone, eye_in_head_std_rad=0.0)
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
        )
        for view, view_rng in zip(
            views, [rng] if len(views) == 1 else rng.spawn(len(views)), strict=True
        )
    ]
