"""The sensors of a robot in a crossing, each a class in the module of its name."""

from __future__ import annotations

from .._messages import (
    NOBODY,
    Change,
    Delivery,
    MountedScan,
    OdometryReading,
    Sighting,
    WorkerObservations,
)
from ._camera import PIXEL_RATE_HZ, CameraSensor, view_of
from ._keypoints import KeypointCamera, KeypointNoise
from ._pixels import match_to_workers
from ._scanner import hall_grid, motion_of
from ._sensor import STREAMS, MapView, Sensor, SensorSetup, World, sensor_class
