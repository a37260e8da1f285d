"""Publishes the messages of the bridge, and records them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

from nav_adapter.ros2 import Topic
from nav_adapter.ros2.messages import Message

if TYPE_CHECKING:
    from nav_adapter.ros2 import DdsNode, McapRecorder


class TopicPublisher:
    """Publishes messages over DDS, and records what it publishes.

    Args:
        node: gets a publisher for each topic.
        topics: the topics that are published, by key.
        recorder: records every message, if there is one.
    """

    def __init__(
        self, node: DdsNode, topics: Mapping[str, Topic], recorder: McapRecorder | None
    ) -> None:
        self._node, self._topics, self._recorder = node, topics, recorder
        for topic in topics.values():
            node.advertise(topic)

    def wants(self, key: str) -> bool:
        """Return whether a message of this topic would be received or recorded.

        A message of a latched topic is always wanted, since later subscribers get the last one.
        """
        topic = self._topics.get(key)
        return topic is not None and (
            self._recorder is not None or topic.transient_local or self._node.readers_of(topic) > 0
        )

    def publish(self, key: str, message: Message) -> None:
        """Publish a message, unless its topic is left out."""
        topic = self._topics.get(key)
        if topic is not None:
            cdr = self._node.publish(topic, message)
            if self._recorder is not None:
                self._recorder.write(topic, cdr, time.time())
