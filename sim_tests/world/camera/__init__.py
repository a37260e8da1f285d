"""Cameras in the simulated warehouse: renderer, image sensor and frame timing."""

from __future__ import annotations

from ._coarse_scenery import FINE_PX_PER_M, CoarseSceneryRenderer
from ._renderer import CameraRenderer, RenderedView
from ._sensor import SensorConfig, expose, to_linear, to_srgb
from ._timing import CameraTiming, FrameClock, FrameQueue

__all__ = [
    "FINE_PX_PER_M",
    "CameraRenderer",
    "CameraTiming",
    "CoarseSceneryRenderer",
    "FrameClock",
    "FrameQueue",
    "RenderedView",
    "SensorConfig",
    "expose",
    "to_linear",
    "to_srgb",
]
