"""Topics over DDS, with the names and the encoding of ROS 2; imports ``cyclonedds``."""

from __future__ import annotations

from typing import Any, Final

from .._errors import NavError
from ._cdr import decode, encode, sample, topic_type
from ._topics import Topic
from .messages import Message

# isort: split
from cyclonedds.core import (
    DDSException,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic

_BLOCKING_NS: Final = 100_000_000
_ANY: Final = SampleState.Any | ViewState.Any | InstanceState.Any


class DdsNode:
    """Publishes and reads ROS 2 topics of one domain, without ROS.

    In DDS the topics are named ``rt/…`` and have types such as
    ``nav2_msgs::msg::dds_::SpeedLimit_``. The environment variable ``CYCLONEDDS_URI`` selects the
    network interface, as with ``rmw_cyclonedds_cpp``.

    Args:
        domain_id: ``ROS_DOMAIN_ID`` of the other nodes, 0 to 232.

    Raises:
        NavError: for a domain that cannot be joined.
    """

    def __init__(self, domain_id: int = 0) -> None:
        if not 0 <= domain_id <= 232:
            raise NavError(f"domain_id must be 0 to 232, got {domain_id}")
        try:
            self._participant = DomainParticipant(domain_id)
        except DDSException as cause:
            raise NavError(f"DDS domain {domain_id} cannot be joined: {cause}") from cause
        self._topics: dict[str, tuple[Topic, Any]] = {}
        self._writers: dict[str, tuple[Topic, Any]] = {}
        self._readers: dict[str, tuple[Topic, Any]] = {}
        self._waitset = WaitSet(self._participant)

    def advertise(self, topic: Topic) -> None:
        """Create a publisher."""
        if topic.name not in self._writers:
            writer = DataWriter(self._participant, self._topic(topic), qos=_qos(topic))
            self._writers[topic.name] = topic, writer

    def subscribe(self, topic: Topic, *, wakes: bool = True) -> None:
        """Create a subscriber, for :meth:`take`, and for :meth:`wait` if it ``wakes``."""
        if topic.name not in self._readers:
            reader = DataReader(self._participant, self._topic(topic), qos=_qos(topic))
            if wakes:
                self._waitset.attach(ReadCondition(reader, _ANY))
            self._readers[topic.name] = topic, reader

    def publish(self, topic: Topic, message: Message) -> bytes:
        """Send a message on an advertised topic and return its CDR bytes.

        Raises:
            NavError: for a message of another type, or one that DDS refuses.
        """
        cdr = encode(message)
        self.publish_cdr(topic, cdr)
        return cdr

    def publish_cdr(self, topic: Topic, cdr: bytes) -> None:
        """Send a message that is already encoded."""
        declared, writer = self._writers[topic.name]
        try:
            writer.write(sample(declared.message, cdr))
        except DDSException as cause:
            raise NavError(f"{topic.name}: cannot publish: {cause}") from cause

    def take(self, topic: Topic) -> list[Message]:
        """Return the messages since the last call.

        Raises:
            NavError: for a message that cannot be decoded.
        """
        return [decode(topic.message, cdr) for cdr in self.take_cdr(topic)]

    def take_cdr(self, topic: Topic) -> list[bytes]:
        """Return the messages since the last call as CDR bytes."""
        declared, reader = self._readers[topic.name]
        kind = topic_type(declared.message)
        return [each.cdr for each in reader.take(N=topic.depth) if isinstance(each, kind)]

    def wait(self, timeout_s: float) -> bool:
        """Wait for a message on a topic that wakes; return False if none came in time."""
        return bool(self._waitset.wait(timeout=max(0, round(timeout_s * 1e9))))

    def readers_of(self, topic: Topic) -> int:
        """Return the number of matched subscribers."""
        return len(self._writers[topic.name][1].get_matched_subscriptions())

    def has_unfit_publisher(self, topic: Topic) -> bool:
        """Return whether a publisher was found whose quality of service lets nothing through."""
        status = self._readers[topic.name][1].get_requested_incompatible_qos_status()
        return bool(status.total_count)

    def close(self) -> None:
        """Leave the domain."""
        self._readers.clear()
        self._writers.clear()
        self._topics.clear()
        del self._waitset
        del self._participant

    def _topic(self, topic: Topic) -> Any:
        """Return the DDS topic, created at first use."""
        known = self._topics.get(topic.name)
        if known is None:
            kind = topic_type(topic.message)
            known = topic, DdsTopic(self._participant, f"rt/{topic.name}", kind)
            self._topics[topic.name] = known
        elif known[0].message is not topic.message:
            raise NavError(
                f"{topic.name} is {known[0].message.__name__} here, not {topic.message.__name__}"
            )
        return known[1]


def _qos(topic: Topic) -> Qos:
    reliability = (
        Policy.Reliability.Reliable(max_blocking_time=_BLOCKING_NS)
        if topic.reliable
        else Policy.Reliability.BestEffort
    )
    durability = (
        Policy.Durability.TransientLocal if topic.transient_local else Policy.Durability.Volatile
    )
    return Qos(
        reliability,
        durability,
        Policy.History.KeepLast(depth=topic.depth),
        # ROS 2 reads the first version of CDR.
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
