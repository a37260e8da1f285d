"""ROS package tf2_msgs."""

from __future__ import annotations

from .._message import Message
from .geometry_msgs import TransformStamped


class TFMessage(Message):
    """Transforms of the topics /tf and /tf_static."""

    transforms: tuple[TransformStamped, ...] = ()
