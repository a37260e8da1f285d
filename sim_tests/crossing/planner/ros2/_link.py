"""The DDS side of a seat: the robot's topics in one domain of ROS 2."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

from nav_adapter.ros2 import MASK_TOPICS, PUBLISHED, READ, DdsNode, Topic, renamed
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.geometry_msgs import PoseStamped, Twist, TwistStamped
from nav_adapter.ros2.messages.nav2_msgs import SpeedLimit
from nav_adapter.ros2.messages.people_msgs import People
from nav_adapter.ros2.messages.rosgraph_msgs import Clock

_CLOCK: Final = Topic("clock", Clock)
_GOAL: Final = Topic("goal_pose", PoseStamped)
_COMMANDS: Final = (Topic("cmd_vel", Twist), Topic("cmd_vel", TwistStamped))
# Of a robot these are sent reliably, which matches every subscriber.
_ROBOT: Final = {
    name: Topic(READ[name].name, READ[name].message, depth=10) for name in ("odom", "tf")
}
# Of an adapter outside.
_HEARD: Final = (PUBLISHED["speed_limit"], PUBLISHED["people"])
_AS_READ: Final = {name: READ[name] for name in ("map", "tf_static", "image", "camera_info")}


class Link:
    """Publishes a robot's topics, and reads the commands of a stack.

    Args:
        domain: ``ROS_DOMAIN_ID``.
        scans: names of the topics of scans.

    Attributes:
        latest_s: the latest stamp of the domain's clock, which may run ahead of the computer's and
            never goes back.

    Raises:
        NavError: no cyclonedds, a domain that cannot be joined, or a name that ROS refuses.
    """

    def __init__(self, domain: int, scans: Sequence[str]) -> None:
        self.domain, self.latest_s = domain, 0.0
        own = {"clock": _CLOCK, "goal_pose": _GOAL, **_ROBOT, **_AS_READ}
        laser = Topic("scan", READ["scan"].message, depth=5)
        own |= {f"scan {number}": renamed(laser, name) for number, name in enumerate(scans)}
        self._topics: dict[str, Topic] = {**own, **PUBLISHED, **MASK_TOPICS}
        # One participant knows a topic's name with one type.
        self._nodes = DdsNode(domain), DdsNode(domain)
        for topic in self._topics.values():
            self._nodes[0].advertise(topic)
        for node, topic in zip(self._nodes, _COMMANDS, strict=True):
            node.subscribe(topic)

    def publish(self, key: str, message: Message) -> None:
        """Publish a message on the topic of a key."""
        self._nodes[0].publish(self._topics[key], message)

    def read_by(self, key: str) -> bool:
        """Return whether somebody reads a topic."""
        return self._nodes[0].readers_of(self._topics[key]) > 0

    @property
    def is_driven(self) -> bool:
        """True if somebody publishes commands."""
        pairs = zip(self._nodes, _COMMANDS, strict=True)
        return any(node.publishers_of(topic) > 0 for node, topic in pairs)

    def command(self) -> Twist | None:
        """Return the newest command since the last call; None without one."""
        newest: Twist | None = None
        for node, topic in zip(self._nodes, _COMMANDS, strict=True):
            for message in node.take(topic):
                newest = message.twist if isinstance(message, TwistStamped) else message  # type: ignore[assignment]
        return newest

    def heard(self) -> tuple[SpeedLimit | None, People | None]:
        """Return the newest limit and people since the last call, of an adapter outside."""
        node = self._nodes[1]
        for topic in _HEARD:
            node.subscribe(topic, wakes=False)
        limit, people = (next(iter(node.take(topic)[::-1]), None) for topic in _HEARD)
        return limit, people  # type: ignore[return-value]


@lru_cache(maxsize=4)
def link_to(domain: int, scans: tuple[str, ...]) -> Link:
    """Return the link of this process: finding others takes a second, so it is kept."""
    return Link(domain, scans)
