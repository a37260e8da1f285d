"""Cameras in the hall: rendered pictures, sensor noise, motion blur, frame timing."""

from __future__ import annotations

from ._coarse_scenery import CoarseSceneryRenderer
from ._renderer import CameraRenderer, RenderedView
from ._sensor import SensorConfig, expose
from ._simulated_camera import PictureRenderer, SimulatedCamera
from ._timing import CameraTiming, FrameClock, FrameQueue

__all__ = [
    "CameraRenderer",
    "CameraTiming",
    "CoarseSceneryRenderer",
    "FrameClock",
    "FrameQueue",
    "PictureRenderer",
    "RenderedView",
    "SensorConfig",
    "SimulatedCamera",
    "expose",
]
