"""Cameras in the simulated warehouse: renderer, image sensor, motion blur and frame timing."""

from __future__ import annotations

from ._coarse_scenery import FINE_PX_PER_M, CoarseSceneryRenderer
from ._motion_blur import motion_blur, motion_field
from ._renderer import CameraRenderer, RenderedView
from ._sensor import SensorConfig, collected_electrons, expose, to_linear, to_srgb
from ._simulated_camera import CameraFrame, ImageRenderer, SimulatedCamera
from ._timing import CameraTiming, FrameClock, FrameQueue

__all__ = [
    "FINE_PX_PER_M",
    "CameraFrame",
    "CameraRenderer",
    "CameraTiming",
    "CoarseSceneryRenderer",
    "FrameClock",
    "FrameQueue",
    "ImageRenderer",
    "RenderedView",
    "SensorConfig",
    "SimulatedCamera",
    "collected_electrons",
    "expose",
    "motion_blur",
    "motion_field",
    "to_linear",
    "to_srgb",
]
