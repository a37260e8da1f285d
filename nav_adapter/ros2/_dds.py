"""Topics over DDS, with the names and the encoding of ROS 2; imports ``cyclonedds``."""

from __future__ import annotations

from typing import Any, Final, cast

from perception.installation import install_command

from .._errors import NavError
from ._cdr import decode, encode
from ._message import FieldType, Message, field_types, once_per_kind, ros_type
from ._topics import Topic

try:
    from cyclonedds.core import (
        DDSException,
        InstanceState,
        ReadCondition,
        SampleState,
        ViewState,
        WaitSet,
    )
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct, types
    from cyclonedds.idl._main import IdlMeta
    from cyclonedds.pub import DataWriter
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic as DdsTopic
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise NavError(
        "topics over DDS need the package cyclonedds, which is not installed; it is part of the "
        f"extra 'ros2': {install_command('ros2')}"
    ) from cause

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
            sample = topic_type(declared.message).deserialize(cdr)
            writer.write(sample)
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
        # One more than the messages: the news that the last publisher has left.
        return [each.cdr for each in reader.take(N=topic.depth + 1) if isinstance(each, kind)]

    def wait(self, timeout_s: float) -> bool:
        """Wait for a message on a topic that wakes; return False if none came in time."""
        return bool(self._waitset.wait(timeout=max(0, round(timeout_s * 1e9))))

    def readers_of(self, topic: Topic) -> int:
        """Return the number of matched subscribers."""
        return len(self._writers[topic.name][1].get_matched_subscriptions())

    def publishers_of(self, topic: Topic) -> int:
        """Return the number of matched publishers."""
        return len(self._readers[topic.name][1].get_matched_publications())

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


@once_per_kind
def topic_type(kind: type[Message]) -> Any:
    """Return the DDS type of a message: an IDL structure with the name that ROS 2 gives it.

    Its samples hold CDR bytes (attribute ``cdr``), which DDS does not decode.
    """

    def serialize(self: Any, *_: Any, **__: Any) -> bytes:
        return cast(bytes, self.cdr)

    def deserialize(cls: Any, data: bytes, *_: Any, **__: Any) -> Any:
        sample = object.__new__(cls)
        sample.cdr = bytes(data)
        return sample

    made = _idl_type(kind)
    made.cdr = b""
    made.serialize = serialize
    made.deserialize = classmethod(deserialize)
    # When the last publisher leaves, DDS delivers a sample that is no message. Cyclone wraps it and
    # would first make a message of its keys, of which ROS has none.
    made.deserialize_key = classmethod(lambda cls, data: None)
    return made


@once_per_kind
def _idl_type(kind: type[Message]) -> Any:
    """Return the IDL structure of a message."""
    # rosidl_generator_dds_idl mangles package/msg/Name in this way.
    name = ros_type(kind).replace("/", "::").replace("::msg::", "::msg::dds_::") + "_"
    namespace: Any = IdlMeta.__prepare__(kind.__name__, (IdlStruct,), typename=name)
    for field, field_type in field_types(kind).items():
        namespace["__annotations__"][field] = _idl_field(field_type)
    namespace["__module__"] = __name__
    return IdlMeta(kind.__name__, (IdlStruct,), namespace)


def _idl_field(kind: FieldType) -> Any:
    if kind.message is not None:
        one = _idl_type(kind.message)
    else:
        one = {"bool": bool, "string": str}.get(kind.name) or getattr(types, kind.name)
    if kind.count is None:
        return one
    return types.array[one, kind.count] if kind.count else types.sequence[one]
