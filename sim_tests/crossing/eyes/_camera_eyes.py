"""Eyes of a camera: what it could see, the truth, several views, timing and faults."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from perception import PersonObservation
from perception.arrays import FloatArray, ImageRgb
from perception.no_view import why_no_view
from perception.surround import FlatView, merge_views
from tracking import RangedView, View

from ...world import Warehouse, crosses_boxes
from ...world.camera import CameraTiming, FrameClock, FrameQueue
from .._stage import TrueView
from ._messages import Change, Delivery, Sighting, WorkerObservations

# Standard deviations that are reported with the truth: small, but not zero.
_TRUE_POSITION_COVARIANCE_M2: Final = 0.01**2 * np.eye(3)
_TRUE_POSITION_COVARIANCE_M2.setflags(write=False)
_TRUE_AWARENESS_STD: Final = 0.02
_TRUE_RANGE_M: Final = 20.0
# Boxes lower than this hide at most the legs of a person.
_HIDING_HEIGHT_M: Final = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class MapView:
    """A :class:`tracking.View` in which racks and walls hide people.

    Attributes:
        camera: field of view and range of the camera; None for all directions, without limit.
        boxes_odom_m: (N, 4) boxes that are high enough to hide a person.
    """

    camera: View | None
    boxes_odom_m: FloatArray

    @classmethod
    def of(cls, warehouse: Warehouse, camera: View | None = None) -> MapView:
        """Make the view of a robot in this hall."""
        high = warehouse.layout.obstacle_heights_m >= _HIDING_HEIGHT_M
        return cls(camera, warehouse.obstacle_boxes_odom[high])

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        """Return the visibility (N,) in [0, 1]; see :class:`tracking.View`."""
        hidden = crosses_boxes(self.boxes_odom_m, T_odom_camera[:2, 3], positions_odom_m)
        if self.camera is None:
            return np.where(hidden, 0.0, 1.0)
        return np.where(hidden, 0.0, self.camera.visibility(positions_odom_m, T_odom_camera))

    def passed(
        self, positions_odom_m: FloatArray, radii_m: FloatArray, T_odom_camera: FloatArray
    ) -> NDArray[np.bool_]:
        """Return (N,) whether each place was seen empty; see :class:`tracking.RangedView`."""
        if not isinstance(self.camera, RangedView):
            return np.zeros(len(positions_odom_m), dtype=np.bool_)
        return np.asarray(self.camera.passed(positions_odom_m, radii_m, T_odom_camera))


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """The instant at which an image is taken."""

    stamp_s: float
    T_odom_camera: FloatArray
    T_odom_camera_known: FloatArray
    truth: tuple[TrueView, ...]

    def through(self, view: FlatView) -> Exposure:
        """Return the same instant as one view of the camera sees it."""
        rotation = view.rotation_camera_view
        return Exposure(
            self.stamp_s,
            self.T_odom_camera @ view.T_camera_view,
            self.T_odom_camera_known @ view.T_camera_view,
            tuple(
                replace(
                    each,
                    position_camera_m=each.position_camera_m @ rotation,
                    gaze_camera=each.gaze_camera @ rotation,
                )
                for each in self.truth
            ),
        )


class Eyes(Protocol):
    """Perception in a crossing: makes the observations of one image."""

    def observe(self, exposure: Exposure) -> WorkerObservations | None:
        """Return the observations of people in the image taken now; None if it shows nothing.

        An image that shows nothing is no view of nobody. It does not arrive at the tracker.
        """
        ...


class TrueEyes:
    """Eyes that report true position, gaze and awareness.

    Args:
        view: field of view; None for all directions and through walls.
    """

    def __init__(self, view: View | None = None) -> None:
        self._view = view

    def observe(self, exposure: Exposure) -> WorkerObservations:
        """Return the truth about every visible person within 20 m."""
        truth = exposure.truth
        visible = self._visible(exposure)
        return tuple(
            (_true_observation(exposure.stamp_s, view), index)
            for index, view in enumerate(truth)
            if visible[index] and math.hypot(*view.position_camera_m.tolist()) <= _TRUE_RANGE_M
        )

    def _visible(self, exposure: Exposure) -> list[bool]:
        truth, T_odom_camera = exposure.truth, exposure.T_odom_camera
        if self._view is None or not truth:
            return [True] * len(truth)
        positions_camera = np.array([view.position_camera_m for view in truth])
        positions_odom = positions_camera @ T_odom_camera[:2, :3].T + T_odom_camera[:2, 3]
        visible: list[bool] = (self._view.visibility(positions_odom, T_odom_camera) > 0.0).tolist()
        return visible


def _true_observation(stamp_s: float, view: TrueView) -> PersonObservation:
    """Return what a perception without errors says about a person."""
    position_m, gaze = view.position_camera_m, view.gaze_camera
    gaze = gaze / math.hypot(*gaze.tolist())
    for array in (position_m, gaze):
        array.setflags(write=False)
    return PersonObservation.true(
        stamp_s,
        position_m,
        _TRUE_POSITION_COVARIANCE_M2,
        gaze,
        view.awareness,
        _TRUE_AWARENESS_STD,
    )


class SurroundEyes:
    """The eyes of a camera with several flat views, whose observations are merged as on a robot."""

    def __init__(self, views: Sequence[FlatView], eyes: Sequence[Eyes]) -> None:
        self._views = tuple(views)
        self._eyes = tuple(eyes)

    def observe(self, exposure: Exposure) -> WorkerObservations | None:
        """Return the merged observations; only those of the first view keep their boxes.

        The views are cut from one image, which shows nothing only if none of them does.
        """
        seen = [
            eyes.observe(exposure.through(view))
            for view, eyes in zip(self._views, self._eyes, strict=True)
        ]
        if all(each is None for each in seen):
            return None
        observed = [each or () for each in seen]
        merged = merge_views(self._views, [[each for each, _ in rows] for rows in observed])
        return tuple(
            (
                each.observation if each.view == 0 else replace(each.observation, box_xyxy_px=None),
                observed[each.view][each.row][1],
            )
            for each in merged
        )


class PicturelessEyes:
    """Eyes without pictures, of a camera whose pictures have a fault.

    The fault changes a picture that stands for the missing one. Where the result shows nothing, as
    the judgement of real pictures says, the eyes see nothing.
    """

    def __init__(self, eyes: Eyes, change: Change[ImageRgb]) -> None:
        self._eyes, self._change = eyes, change
        shades = np.linspace(0.0, 255.0, 64).astype(np.uint8)
        self._picture: ImageRgb = np.tile(shades[None, :, None], (48, 1, 3))

    def observe(self, exposure: Exposure) -> WorkerObservations | None:
        """Return the observations of the image; None where its picture would show nothing."""
        picture = delivered_picture(self._change, self._picture, exposure)
        return None if picture is None else self._eyes.observe(exposure)


def delivered_picture(
    change: Change[ImageRgb] | None, picture: ImageRgb, exposure: Exposure
) -> ImageRgb | None:
    """Return the picture (H, W, 3) that arrives instead of one; None if it shows nothing."""
    if change is not None:
        stamp_s = exposure.stamp_s
        changed = change(Delivery(picture, stamp_s, stamp_s, exposure.T_odom_camera))
        if changed is None:
            return None
        picture = changed.message
    # Not compared with the picture before: a sensor without noise sees the same thing twice.
    return None if why_no_view(picture) is not None else picture


class TimedEyes:
    """Eyes with the frame rate, losses and delays of a camera, and with faults."""

    def __init__(
        self,
        eyes: Eyes,
        timing: CameraTiming,
        rng: np.random.Generator,
        change: Change[Sighting] | None = None,
    ) -> None:
        self._eyes, self._change = eyes, change
        self._clock = FrameClock(timing, rng)
        self._queue: FrameQueue[Sighting] = FrameQueue()

    def look(
        self,
        now_s: float,
        T_odom_camera: FloatArray,
        T_odom_camera_known: FloatArray,
        truth: tuple[TrueView, ...],
    ) -> tuple[Sighting, ...]:
        """Take an image if one is due; return what has arrived by now, in order of arrival.

        Args:
            now_s: time; grows from call to call.
            T_odom_camera: (4, 4) true pose of the camera.
            T_odom_camera_known: (4, 4) the pose that the robot takes it to have.
            truth: the truth about each person.
        """
        _, arrives_s = self._clock.tick(now_s)
        if arrives_s is not None:
            exposure = Exposure(now_s, T_odom_camera, T_odom_camera_known, truth)
            observations = self._eyes.observe(exposure)
            if observations is not None:
                sighting = Sighting(now_s, T_odom_camera_known, observations)
                self._send(Delivery(sighting, now_s, arrives_s, T_odom_camera))
        return self._queue.take(now_s)

    def _send(self, taken: Delivery[Sighting]) -> None:
        delivery = taken if self._change is None else self._change(taken)
        if delivery is not None:
            sighting = delivery.message
            self._queue.put(sighting.stamp_s, delivery.arrives_s, sighting)
