"""A sensor of a robot, what it may look at, and what it is made of.

A new sensor is a module ``_NAME.py`` of this folder with a subclass of :class:`Sensor` of that
name, and the name in :data:`~sim_tests.conditions.CAMERAS` or ``OTHER_SENSORS``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from nav_adapter import RobotState
from perception import AttentionCone, AwarenessPipeline, Camera
from perception.arrays import FloatArray
from perception.surround import FlatView
from tracking import RangedView, SensorConfig, View

from ...world import Warehouse, crosses_boxes
from ...world.config import SimConfig
from .._messages import Sighting
from .._stage import Stage, TrueView
from ..faults import EpisodeFaults

#: Random streams of an episode: one that is spare, of the camera's noise, its losses and delays,
#: and the people.
STREAMS: Final = 4
# Boxes lower than this hide at most the legs of a person.
_HIDING_HEIGHT_M: Final = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """The world at one instant: the truth, and what the robot knows of itself.

    Attributes:
        t_s: the time.
        T_odom_camera: (4, 4) true pose of the camera.
        T_odom_camera_known: (4, 4) the pose that the robot takes it to have.
        truth: the truth about each person.
        known: the robot's state, as it knows it.
    """

    t_s: float
    T_odom_camera: FloatArray
    T_odom_camera_known: FloatArray
    truth: tuple[TrueView, ...]
    known: RobotState

    def through(self, view: FlatView) -> World:
        """Return the same instant as one view of the camera sees it."""
        rotation = view.rotation_camera_view
        truth = tuple(
            replace(
                each,
                position_camera_m=each.position_camera_m @ rotation,
                gaze_camera=each.gaze_camera @ rotation,
            )
            for each in self.truth
        )
        camera, known = (
            T @ view.T_camera_view for T in (self.T_odom_camera, self.T_odom_camera_known)
        )
        return replace(self, T_odom_camera=camera, T_odom_camera_known=known, truth=truth)


class KeypointNoise(SimConfig):
    """Noise of the keypoints.

    Attributes:
        pixel_std_px: standard deviation of each coordinate, independent between frames.
        lift_std_m: standard deviation of each keypoint's depth relative to the body's root; 45 mm
            is typical of a current whole-body network.
        miss_rate: share of the frames in which a visible person is not detected.
    """

    pixel_std_px: float = Field(default=1.0, ge=0.0)
    lift_std_m: float = Field(default=0.045, ge=0.0)
    miss_rate: float = Field(default=0.02, ge=0.0, le=1.0)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SensorSetup:
    """The parts that sensors are made of.

    Attributes:
        stage: hall, robot and people; its scenario has the settings of the sensors.
        seed: of the episode.
        faults: of the episode.
        cone: attention cone of the pipeline.
        noise: noise of keypoints.
        pipeline: for rendered pictures; None for the scenario's networks.
    """

    stage: Stage
    seed: int
    faults: EpisodeFaults
    noise: KeypointNoise
    cone: AttentionCone = field(default_factory=AttentionCone)
    pipeline: AwarenessPipeline | None = None


class Sensor(ABC):
    """A sensor of a robot; a subclass is registered by its ``name``.

    Attributes:
        camera: the model of its pictures, for a camera.
        tracked: settings of the tracker's sensors that it is, beside the camera.
        knows_all: whether it knows everybody in all directions.
    """

    _registered: ClassVar[dict[str, type[Sensor]]] = {}
    knows_all: ClassVar[bool] = False
    camera: Camera | None = None
    tracked: Mapping[str, SensorConfig] = {}

    def __init_subclass__(cls, *, name: str = "") -> None:
        if name:
            Sensor._registered[name] = cls

    @abstractmethod
    def __init__(self, setup: SensorSetup) -> None: ...

    @abstractmethod
    def look(self, world: World) -> tuple[Sighting, ...]:
        """Look at the world, whose time grows; return what has arrived by now, in that order."""


def sensor_class(name: str) -> type[Sensor]:
    """Return the sensor of one of the names of a :class:`~sim_tests.conditions.Perception`."""
    import_module(f"{__package__}._{name}")
    return Sensor._registered[name]


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
