"""Messages of the sensors: images, scans and odometry on their way to the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, TypeAlias, TypeVar

from nav_adapter import RobotState
from perception import PersonObservation
from perception.arrays import FloatArray
from perception.laser import LaserScan, Scanner, ScannerSight
from tracking import View

#: Index of an observation that shows none of the workers.
NOBODY: Final = -1

#: Observations, each with the index of the worker that it shows, or :data:`NOBODY`.
WorkerObservations: TypeAlias = tuple[tuple[PersonObservation, int], ...]

MessageT = TypeVar("MessageT")


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """The observations of one image or scan, as they arrive at the robot.

    Attributes:
        stamp_s: time of the image or scan.
        T_odom_camera: (4, 4) pose of the camera or scanner then, as the robot knows it.
        observations: observations of people, each with the index of its worker.
        sensor: the tracker's name of the sensor.
        points_odom_m: (N, 2) points of a scan; None for an image.
        view: where a scan could have shown people; None for an image.
        sight: where a scan shows what is there; None for an image.
    """

    stamp_s: float
    T_odom_camera: FloatArray
    observations: WorkerObservations
    sensor: str = "camera"
    points_odom_m: FloatArray | None = None
    view: View | None = None
    sight: ScannerSight | None = None


@dataclass(frozen=True, slots=True, eq=False)
class MountedScan:
    """A laser scan, and the mounting of its scanner as the robot assumes it."""

    scan: LaserScan
    mounting: Scanner


@dataclass(frozen=True, slots=True, eq=False)
class OdometryReading:
    """An odometry message: the robot's state, and the pose of its camera (4, 4)."""

    state: RobotState
    T_odom_camera: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Delivery(Generic[MessageT]):
    """A message of a sensor on its way to the robot.

    Attributes:
        message: a picture (H, W, 3), a :class:`Sighting` of the camera, a :class:`MountedScan`, or
            an :class:`OdometryReading`.
        taken_s: true time at which it was taken; its stamp may be wrong.
        arrives_s: time of its arrival.
        T_odom_sensor: (4, 4) true pose of the sensor when it was taken.
    """

    message: MessageT
    taken_s: float
    arrives_s: float
    T_odom_sensor: FloatArray


#: A change of what a sensor delivers; None for a message that never arrives.
Change: TypeAlias = Callable[[Delivery[MessageT]], "Delivery[MessageT] | None"]
