"""Cameras in the simulated warehouse: renderer, image sensor and frame timing."""

from __future__ import annotations

from ._renderer import FINE_PX_PER_M, CameraRenderer, CoarseSceneryRenderer, RenderedView
from ._sensor import CameraTiming, FrameClock, FrameQueue, SensorConfig, expose, to_linear, to_srgb
