"""The sensors of a tracker: what each one can see, and how surely it reports a person."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from pydantic import Field, field_validator

from perception.arrays import FloatArray

from ._association import Gates
from ._clocks import FrameClock
from ._config import TrackerConfig, TrackingConfig
from ._errors import TrackingError
from ._existence import tentative_gap_s
from ._table import BoolArray, TrackTable
from ._views import View

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

    detection_probability: float = Field(default=0.9, ge=0.01, le=0.999)
    """P_D, the share of frames that report a person in sight."""

    miss_cost: float = Field(default=10.0, ge=-1e3, le=1e3)
    """As in :class:`~tracking.TrackerConfig`; lower for a sensor with more clutter."""

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
        index: its column in the table of tracks.
        settings: as given.
        config: the tracker's, with the detection probability and the miss cost of this sensor.
        gates: of its measurements.
    """

    name: str
    index: int
    settings: SensorConfig
    config: TrackerConfig
    gates: Gates

    @property
    def view(self) -> View | None:
        """The view of the sensor; None if unknown."""
        view: View | None = self.settings.view
        return view

    @property
    def pose_covariance(self) -> FloatArray | None:
        """(3, 3) of the sensor's x, y and yaw on the robot; None if it is exact."""
        std = self.settings.alignment_std_rad
        return np.diag([0.0, 0.0, std * std]) if std > 0.0 else None


@dataclass(frozen=True, slots=True, eq=False)
class Sensors:
    """All S sensors of a tracker, the camera first.

    Attributes:
        all: in the order of their columns.
        names: of the sensors.
        config: the tracker's settings.
        has_view: (S,) True where the view is known.
        faces: (S,) True for sensors that see faces.
        several_faces: whether more than one does.
        ranging: (S,) True for sensors that measure ranges.
        mixed: whether some measure ranges and others do not.
    """

    all: tuple[Sensor, ...]
    names: tuple[str, ...]
    config: TrackerConfig
    has_view: BoolArray
    faces: BoolArray
    several_faces: bool
    ranging: BoolArray
    mixed: bool

    def __len__(self) -> int:
        return len(self.all)

    def named(self, name: Any) -> Sensor:
        """Return the sensor of this name.

        Raises:
            TrackingError: for a name that is not among them.
        """
        if not isinstance(name, str) or name not in self.names:
            raise TrackingError(
                f"sensor must be one of {', '.join(map(repr, self.names))}, got {name!r:.80}"
            )
        return self.all[self.names.index(name)]

    def tentative_gaps_s(self, clocks: Sequence[FrameClock]) -> FloatArray:
        """Return (S,), the time after which each sensor gives up a tentative track."""
        return np.array(
            [
                tentative_gap_s(clock.period_s, sensor.config)
                for sensor, clock in zip(self.all, clocks, strict=True)
            ]
        )


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
            detection_probability=config.detection_probability,
            miss_cost=config.miss_cost,
            alignment_std_rad=max((one.alignment_std_rad for one in others.values()), default=0.0),
        ),
        **others,
    }
    found = []
    for index, (name, one) in enumerate(settings.items()):
        own = config
        if name != CAMERA:
            changes = {
                "detection_probability": one.detection_probability,
                "miss_cost": one.miss_cost,
            }
            own = config.model_copy(update=changes)
        found.append(Sensor(name, index, one, own, gates_of(own)))
    faces = _flags(one.sees_faces for one in settings.values())
    ranging = _flags(one.measures_range for one in settings.values())
    return Sensors(
        all=tuple(found),
        names=tuple(settings),
        config=config,
        has_view=_flags(one.view is not None for one in settings.values()),
        faces=faces,
        several_faces=int(np.count_nonzero(faces)) > 1,
        ranging=ranging,
        mixed=bool(ranging.any() and not ranging.all()),
    )


def gates_of(config: TrackerConfig) -> Gates:
    """Return the gates that a config describes."""
    return Gates(
        # χ² with two degrees of freedom.
        mahalanobis2=-2.0 * math.log1p(-config.gate_probability),
        distance_m=config.gate_distance_m,
        miss_cost=config.miss_cost,
        ambiguity_margin=config.ambiguity_margin,
        ambiguity_distance_m=config.ambiguity_distance_m,
    )


def seen_lately(tracks: TrackTable, which: BoolArray, stamp_s: float, within_s: float) -> BoolArray:
    """Return (N,) True for tracks seen within this time by one of the sensors of ``which`` (S,)."""
    return np.asarray((stamp_s - tracks.seen_stamps_s[:, which] <= within_s).any(axis=1))


def _flags(values: Iterable[bool]) -> BoolArray:
    return np.array(list(values), dtype=np.bool_)
