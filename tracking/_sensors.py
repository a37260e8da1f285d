"""The sensors of a tracker: what each one can see, and how surely it reports a person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from pydantic import Field, field_validator

from perception.arrays import FloatArray

from ._config import TrackerConfig, TrackingConfig
from ._errors import TrackingError
from ._views import View
from .clock import FrameClock

#: The name of the sensor that every tracker has.
CAMERA: Final = "camera"


class SensorConfig(TrackingConfig):
    """One sensor of a :class:`~tracking.PersonTracker`; the defaults are those of a laser scanner.

    Raises:
        TrackingError: for settings that are unknown, out of range or not finite.
    """

    view: Any = Field(default=None, exclude=True)
    """A :class:`~tracking.View` that tells where the sensor can see people; None if unknown.
    It is not part of a YAML file."""

    sees_faces: bool = False
    """True if an observation says something about awareness. If not, the frames of this sensor
    leave awareness as it is, except that an ambiguous match takes it."""

    measures_range: bool = True
    """True if ranges are measured. If not, they follow from the size that people are assumed to
    have, and yield to a measured range of the same person."""

    alignment_std_rad: float = Field(default=0.015, ge=0.0, le=0.5)
    """Standard deviation of the angle by which the calibrations of this sensor and of the camera
    disagree. It moves people sideways in proportion to their range, and is added to the noise of
    both."""

    @field_validator("view")
    @classmethod
    def _check_view(cls, view: Any) -> Any:
        if view is not None and not isinstance(view, View):
            raise ValueError(
                "view must have a method visibility(positions_odom_m, T_odom_camera), "
                f"got {type(view).__name__}"
            )
        return view


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """A sensor as the steps of the tracker use it.

    Attributes:
        name: as in ``update(sensor=…)``.
        index: its place in the lists of a track.
        settings: as given.
        pose_covariance: (3, 3) of the sensor's x, y and yaw on the robot; None if it is exact.
    """

    name: str
    index: int
    settings: SensorConfig
    pose_covariance: FloatArray | None

    @property
    def view(self) -> View | None:
        """The view of the sensor; None if unknown."""
        view: View | None = self.settings.view
        return view


@dataclass(frozen=True, slots=True, eq=False)
class Sensors:
    """All sensors of a tracker, the camera first.

    Attributes:
        all: in the order of a track's lists.
        config: the tracker's settings.
        faces: indices of the sensors that see faces.
        ranging: indices of the sensors that measure ranges.
        sizing: indices of those that do not.
    """

    all: tuple[Sensor, ...]
    config: TrackerConfig
    faces: tuple[int, ...]
    ranging: tuple[int, ...]
    sizing: tuple[int, ...]

    @property
    def mixed(self) -> bool:
        """Whether some measure ranges and others do not."""
        return bool(self.ranging and self.sizing)

    def named(self, name: Any) -> Sensor:
        """Return the sensor of this name.

        Raises:
            TrackingError: for a name that is not among them.
        """
        for sensor in self.all:
            if sensor.name == name:
                return sensor
        names = ", ".join(repr(sensor.name) for sensor in self.all)
        raise TrackingError(f"sensor must be one of {names}, got {name!r:.80}")


def longest_period_s(clocks: tuple[FrameClock, ...], which: tuple[int, ...]) -> float:
    """Return the longest usual time between frames of these sensors; 0 where none is known."""
    return max([clocks[index].known_period_s for index in which])


def sensors_of(
    config: TrackerConfig, view: View | None, others: Mapping[str, SensorConfig] | None
) -> Sensors:
    """Return the camera, with settings from the config, and the other sensors.

    Raises:
        TrackingError: for sensors that are not a mapping of names to :class:`SensorConfig`, or that
            have the camera among them.
    """
    others = {} if others is None else others
    if not isinstance(others, Mapping):
        raise TrackingError(
            f"sensors must be a mapping of names to SensorConfig, got {type(others).__name__}"
        )
    for name, one in others.items():
        if not isinstance(name, str) or not name or name == CAMERA:
            raise TrackingError(
                f"sensors must have names of their own, got {name!r}; the settings of "
                f"{CAMERA!r} are those of TrackerConfig, and its view is view"
            )
        if not isinstance(one, SensorConfig):
            raise TrackingError(
                f"sensors[{name!r}] must be a SensorConfig, got {type(one).__name__}"
            )
    settings = {
        CAMERA: SensorConfig(
            view=view,
            sees_faces=True,
            measures_range=False,
            alignment_std_rad=max((one.alignment_std_rad for one in others.values()), default=0.0),
        ),
        **others,
    }
    found = [_sensor(name, index, one) for index, (name, one) in enumerate(settings.items())]
    return Sensors(
        all=tuple(found),
        config=config,
        faces=tuple(one.index for one in found if one.settings.sees_faces),
        ranging=tuple(one.index for one in found if one.settings.measures_range),
        sizing=tuple(one.index for one in found if not one.settings.measures_range),
    )


def _sensor(name: str, index: int, settings: SensorConfig) -> Sensor:
    std = settings.alignment_std_rad
    return Sensor(name, index, settings, np.diag([0.0, 0.0, std * std]) if std > 0.0 else None)
