"""A sensor that knows the truth about everybody."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from perception import PersonObservation
from tracking import SensorConfig

from .._messages import Sighting, WorkerObservations
from .._stage import TrueView
from ._camera import CameraSensor
from ._sensor import MapView, SensorSetup, World

# Standard deviations that are reported with the truth: small, but not zero.
_POSITION_COVARIANCE_M2: Final = 0.01**2 * np.eye(3)
_POSITION_COVARIANCE_M2.setflags(write=False)
_AWARENESS_STD: Final = 0.02
_RANGE_M: Final = 20.0
# The tracker's name of a sensor of true places, without faces: like a robot with scanners, the
# truth remembers who has noticed the robot.
_PLACES: Final = "places"


class Truth(CameraSensor, name="truth"):
    """True position, gaze and awareness of everybody within 20 m, through walls as well."""

    knows_all = True

    def __init__(self, setup: SensorSetup) -> None:
        super().__init__(setup)
        self.views = self.views[:1]  # it sees in all directions
        places = SensorConfig(view=self.view, measures_range=False, alignment_std_rad=0.0)
        self.tracked = {_PLACES: places}

    @property
    def view(self) -> MapView | None:
        """Places that are not hidden; None for all."""
        return None

    def look(self, world: World) -> tuple[Sighting, ...]:
        """Return the images of the camera, each also as a look at places."""
        images = super().look(world)
        return tuple(each for image in images for each in (image, replace(image, sensor=_PLACES)))

    def observe(self, view: int, world: World) -> WorkerObservations:
        """Return the truth about every visible person."""
        return tuple(
            (_true_observation(world.t_s, each), index)
            for index, (each, visible) in enumerate(
                zip(world.truth, self._visible(world), strict=True)
            )
            if visible and math.hypot(*each.position_camera_m.tolist()) <= _RANGE_M
        )

    def _visible(self, world: World) -> list[bool]:
        truth, T_odom_camera = world.truth, world.T_odom_camera
        view = self.tracked[_PLACES].view
        if view is None or not truth:
            return [True] * len(truth)
        positions_camera = np.array([each.position_camera_m for each in truth])
        positions_odom = positions_camera @ T_odom_camera[:2, :3].T + T_odom_camera[:2, 3]
        visible: list[bool] = (view.visibility(positions_odom, T_odom_camera) > 0.0).tolist()
        return visible


def _true_observation(stamp_s: float, view: TrueView) -> PersonObservation:
    """Return what a perception without errors says about a person."""
    position_m, gaze = view.position_camera_m, view.gaze_camera
    gaze = gaze / math.hypot(*gaze.tolist())
    for array in (position_m, gaze):
        array.setflags(write=False)
    return PersonObservation.true(
        stamp_s, position_m, _POSITION_COVARIANCE_M2, gaze, view.awareness, _AWARENESS_STD
    )
