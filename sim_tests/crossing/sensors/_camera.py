"""A camera as a sensor: its views, timing and faults, whatever perceives its pictures."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import Any, ClassVar, Final

import numpy as np

from perception import Camera
from perception.anthropometry import UNUSUAL_SIZE_PROBABILITY
from perception.arrays import ImageRgb
from perception.no_view import why_no_view
from perception.surround import FlatView, merge_views
from tracking import CameraView, SurroundView, View

from ...scenario import CameraSpec, Scenario
from ...world.camera import FrameClock, FrameQueue
from .._messages import Change, Delivery, Sighting, WorkerObservations
from .._stage import Stage
from ._sensor import STREAMS, MapView, Sensor, SensorSetup, World

#: Images a second of a camera that renders, where the scenario gives none.
PIXEL_RATE_HZ: Final = 10.0
# An image without a person is no evidence about people farther away than this.
_DETECTION_RANGE_M: Final = 10.0
# Statures of adults: within two and a half standard deviations of the mean.
_LEAST_ADULT_M: Final = 1.5
# A picture that stands for the missing one of a camera without pictures, for their faults.
_PLAIN: Final[ImageRgb] = np.tile(np.linspace(0.0, 255.0, 64).astype(np.uint8)[:, None], (48, 1, 3))


class CameraSensor(Sensor):
    """A camera with the frame rate, losses and delays of the scenario's, and with faults.

    A subclass perceives the people in one view at one instant (:meth:`observe`).

    Attributes:
        costly: whether it renders, so that it takes 10 images a second where the scenario gives no
            rate.
        has_pictures: whether it makes pictures, of which it passes on the faults itself.
        views: the flat views of its pictures.
    """

    costly: ClassVar[bool] = False
    has_pictures: ClassVar[bool] = False
    camera: Camera

    def __init__(self, setup: SensorSetup) -> None:
        self.stage = setup.stage
        spec = setup.stage.scenario.camera
        self.camera = spec.camera(self.scale(spec))
        self.views: tuple[FlatView, ...] = spec.flat_views(self.camera)
        _, self._rng, timing_rng, _ = np.random.default_rng(setup.seed).spawn(STREAMS)
        self._pictures, self._change = setup.faults.pictures(), setup.faults.images()
        timing = spec.timing
        if self.costly:
            timing = timing.model_copy(update={"rate_hz": timing.rate_hz or PIXEL_RATE_HZ})
        self._clock = FrameClock(timing, timing_rng)
        self._queue: FrameQueue[Sighting] = FrameQueue()

    @property
    def view(self) -> View | None:
        """Places where it can see people, for the tracker; None for everywhere."""
        return view_of(self.stage, self.camera)

    @staticmethod
    def scale(spec: CameraSpec) -> float:
        """Return the size of its images over that of the scenario's camera."""
        return 1.0

    @abstractmethod
    def observe(self, view: int, world: World) -> WorkerObservations | None:
        """Return the observations of people in a view of the image; None if it shows nothing.

        A picture that shows nothing is no view of nobody. It does not arrive at the tracker.
        """

    def look(self, world: World) -> tuple[Sighting, ...]:
        """Take an image if one is due; return what has arrived by now, in order of arrival."""
        t_s = world.t_s
        _, arrives_s = self._clock.tick(t_s)
        if arrives_s is not None and (observations := self._observed(world)) is not None:
            sighting = Sighting(t_s, world.T_odom_camera_known, observations)
            sent: Delivery[Sighting] | None = Delivery(
                sighting, t_s, arrives_s, world.T_odom_camera
            )
            if sent is not None and self._change is not None:
                sent = self._change(sent)
            if sent is not None:
                self._queue.put(sent.message.stamp_s, sent.arrives_s, sent.message)
        return self._queue.take(t_s)

    def _observed(self, world: World) -> WorkerObservations | None:
        """Return the observations of all views, merged as on a robot.

        The views are cut from one image, which shows nothing only if none of them does. Only
        observations of the first view keep their boxes.
        """
        pictures = None if self.has_pictures else self._pictures
        if pictures is not None and delivered(pictures, _PLAIN, world) is None:
            return None
        if len(self.views) == 1:
            return self.observe(0, world)
        seen = [self.observe(n, world.through(view)) for n, view in enumerate(self.views)]
        if all(each is None for each in seen):
            return None
        observed = [each or () for each in seen]
        merged = merge_views(self.views, [[each for each, _ in rows] for rows in observed])
        return tuple(
            (
                each.observation if each.view == 0 else replace(each.observation, box_xyxy_px=None),
                observed[each.view][each.row][1],
            )
            for each in merged
        )


def view_of(stage: Stage, camera: Camera) -> MapView:
    """Return where a robot in this hall sees people with the scenario's camera of this model."""
    views = stage.scenario.camera.flat_views(camera)
    flat = CameraView(camera, max_range_m=_DETECTION_RANGE_M)
    around = SurroundView((flat,) * len(views), tuple(each.rotation_camera_view for each in views))
    return MapView.of(stage.warehouse, flat if len(views) == 1 else around)


def delivered(change: Change[ImageRgb] | None, picture: ImageRgb, world: World) -> ImageRgb | None:
    """Return the picture (H, W, 3) that arrives instead of one; None if it shows nothing."""
    if change is not None:
        changed = change(Delivery(picture, world.t_s, world.t_s, world.T_odom_camera))
        if changed is None:
            return None
        picture = changed.message
    # Not compared with the picture before: a sensor without noise sees the same thing twice.
    return None if why_no_view(picture) is not None else picture


def pipeline_settings(setup: SensorSetup) -> dict[str, Any]:
    """Return the settings of a pipeline that a robot of this scenario would have."""
    return {
        "cone": setup.cone,
        # Workers in a crossing turn their heads; their eyes follow.
        "eye_in_head_std_rad": 0.0,
        "unusual_size_probability": unusual_size_probability(setup.stage.scenario),
    }


def unusual_size_probability(scenario: Scenario) -> float:
    """Return what a robot may assume: 0 where all people are adults who stand, else the default."""
    if all(each.stature_m >= _LEAST_ADULT_M and not each.stays for each in scenario.people):
        return 0.0
    return UNUSUAL_SIZE_PROBABILITY
