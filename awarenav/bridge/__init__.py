"""From a ROS 2 camera to obstacles and a speed limit for Nav2: ``awarenav bridge``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._loop import BridgeInputs, BridgeLoop, TopicPublisher
    from ._replay import BagReplay, ReplayPublisher, recorded_messages, static_transforms
    from ._rerun import RerunRecorder, cone_lines

__all__ = [
    "BagReplay",
    "BridgeInputs",
    "BridgeLoop",
    "ReplayPublisher",
    "RerunRecorder",
    "TopicPublisher",
    "cone_lines",
    "recorded_messages",
    "static_transforms",
]

__getattr__ = lazy_page(__name__, __file__)
