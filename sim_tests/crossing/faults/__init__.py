"""Faults of camera, detections, odometry and scanners, as data and in an episode."""

from __future__ import annotations

from ._fault import FAULT_KINDS, EpisodeFaults, Fault, shipped_faults
from ._sensor_fault import SensorFault, Start
