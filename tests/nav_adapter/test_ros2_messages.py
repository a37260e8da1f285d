"""Messages: fields, schemas and CDR bytes, against other libraries."""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cyclonedds.idl import Endianness
from ros2_scenes import everything, plain, typestore
from rosbags.typesys import get_types_from_msg

from nav_adapter import NavError
from nav_adapter.ros2 import PUBLISHED, READ, decode, encode, messages
from nav_adapter.ros2._cdr import _idl_type, topic_type
from nav_adapter.ros2._message import FieldType, field_types
from nav_adapter.ros2.messages import Message, definition, ros_type
from nav_adapter.ros2.messages.builtin_interfaces import Time
from nav_adapter.ros2.messages.nav2_msgs import CircleObject, SpeedLimit
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.unique_identifier_msgs import UUID

STORE = typestore()
KINDS = sorted(
    (
        value
        for module in pkgutil.iter_modules(messages.__path__)
        for value in vars(importlib.import_module(f"{messages.__name__}.{module.name}")).values()
        if isinstance(value, type)
        and issubclass(value, Message)
        and value.__module__.endswith(module.name)
    ),
    key=ros_type,
)


def _as_rosbags_writes(kind: type[Message]) -> list[tuple[str, str]]:
    """Return the fields of a type in rosbags' registry, in the notation of this library."""

    def text(node: tuple) -> str:
        tag, content = int(node[0]), node[1]
        if tag == 1:
            return str(content[0])
        if tag == 2:
            return str(content).replace("/msg/", "/")
        inner, count = content
        return f"{text(inner)}[{count or ''}]"

    return [(name, text(node)) for name, node in STORE.fielddefs[ros_type(kind)][1]]


@pytest.mark.parametrize("kind", KINDS, ids=ros_type)
def test_fields_agree_with_the_msg_files(kind: type[Message]) -> None:
    ours = [(name, field.text) for name, field in field_types(kind).items()]
    assert ours == _as_rosbags_writes(kind)


@pytest.mark.parametrize("kind", KINDS, ids=ros_type)
def test_a_schema_holds_every_nested_message_once(kind: type[Message]) -> None:
    text = definition(kind)
    registered = get_types_from_msg(text, ros_type(kind))
    for name, content in registered.items():
        assert content[1] == STORE.fielddefs[name][1]
    heads = [line for line in text.splitlines() if line.startswith("MSG: ")]
    assert len(heads) == len(set(heads))


@pytest.mark.parametrize(("key", "message"), everything(), ids=lambda value: str(value)[:20])
def test_an_independent_decoder_reads_every_message(key: str, message: Message) -> None:
    cdr = encode(message)
    assert PUBLISHED[key].message is type(message)
    read = STORE.deserialize_cdr(cdr, ros_type(type(message)))
    # Both sides are rounded to single precision on the wire, so they must be equal.
    assert plain(read) == plain(decode(type(message), cdr))
    again = decode(type(message), cdr)
    assert encode(again) == cdr
    assert bytes(STORE.serialize_cdr(read, ros_type(type(message)))) == cdr


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.booleans(),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")),
    st.integers(0, 2**31 - 1),
    st.integers(0, 999_999_999),
)
def test_any_speed_limit_is_encoded_and_decoded(
    limit: float, percentage: bool, frame: str, sec: int, nanosec: int
) -> None:
    message = SpeedLimit(Header(Time(sec, nanosec), frame), percentage, limit)
    assert decode(SpeedLimit, encode(message)) == message
    assert plain(STORE.deserialize_cdr(encode(message), "nav2_msgs/msg/SpeedLimit")) == plain(
        message
    )


@given(st.binary(max_size=40))
def test_any_bytes_are_decoded_or_refused(data: bytes) -> None:
    try:
        read = decode(SpeedLimit, data)
    except NavError:
        return
    assert isinstance(read, SpeedLimit)


def test_every_truncated_message_is_refused() -> None:
    whole = encode(Image(Header(Time(1, 2), "camera"), 2, 3, "rgb8", 0, 9, bytes(18)))
    for length in range(len(whole)):
        with pytest.raises(NavError, match="sensor_msgs/msg/Image"):
            decode(Image, whole[:length])


def test_messages_encoded_by_rosbags_are_decoded() -> None:
    kind = STORE.types["sensor_msgs/msg/CameraInfo"]
    blank = decode(CameraInfo, encode(CameraInfo()))
    theirs = STORE.deserialize_cdr(encode(CameraInfo()), "sensor_msgs/msg/CameraInfo")
    assert isinstance(theirs, kind)
    theirs.k = np.arange(9.0)
    theirs.d = np.array([0.1, 0.2])
    theirs.distortion_model = "plumb_bob"
    for little in (True, False):
        raw = bytes(STORE.serialize_cdr(theirs, "sensor_msgs/msg/CameraInfo", little_endian=little))
        read = decode(CameraInfo, raw)
        assert read == replace(blank, k=tuple(range(9)), d=(0.1, 0.2), distortion_model="plumb_bob")


@pytest.mark.parametrize("topic", [*PUBLISHED.values(), *READ.values()], ids=lambda each: each.name)
def test_type_names_are_mangled_as_ros_2_does(topic) -> None:
    package, _, name = ros_type(topic.message).split("/")
    assert topic_type(topic.message).__idl_typename__ == f"{package}::msg::dds_::{name}_"


def test_messages_are_immutable_values() -> None:
    first, second = OccupancyGrid(data=b"\x01"), OccupancyGrid(data=b"\x01")
    assert first == second
    assert hash(first) == hash(second)
    assert all(field.default is not None for field in fields(OccupancyGrid))
    with pytest.raises(AttributeError):
        first.data = b""  # type: ignore[misc]


def test_a_value_of_the_wrong_type_is_refused() -> None:
    with pytest.raises(NavError, match="nav2_msgs/msg/SpeedLimit cannot be encoded"):
        encode(SpeedLimit(speed_limit="fast"))  # type: ignore[arg-type]


def value_of(kind: FieldType) -> st.SearchStrategy:
    """Return a strategy for any value of a field."""
    integers = {"byte": (0, 255), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}
    integers |= {"int8": (-128, 127), "uint8": (0, 255), "int64": (-(2**63), 2**63 - 1)}
    if kind.message is not None:
        one = filled(kind.message)
    elif kind.name in ("int8", "uint8") and kind.count is not None:
        return st.binary(min_size=kind.count, max_size=kind.count or 9)
    elif kind.name == "bool":
        one = st.booleans()
    elif kind.name == "string":
        one = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=9)
    elif kind.name in integers:
        one = st.integers(*integers[kind.name])
    else:
        one = st.floats(width=32 if kind.name == "float32" else 64)
    if kind.count is None:
        return one
    return st.lists(one, min_size=kind.count, max_size=kind.count or 3).map(tuple)


@cache
def filled(kind: type[Message]) -> st.SearchStrategy[Message]:
    return st.builds(kind, **{name: value_of(each) for name, each in field_types(kind).items()})


@pytest.mark.parametrize("kind", KINDS, ids=ros_type)
@settings(max_examples=15)
@given(data=st.data())
def test_the_encoder_agrees_with_cyclonedds(kind: type[Message], data: st.DataObject) -> None:
    """For any values, and so any alignments, the bytes are equal."""
    message = data.draw(filled(kind))
    theirs = _idl_type(kind, True).__idl__.serialize(
        message, use_version_2=False, endianness=Endianness.Little
    )
    assert encode(message) == bytes(theirs)


@pytest.mark.parametrize(
    "message",
    [
        SpeedLimit(Header(frame_id="no\0end")),
        SpeedLimit(Header(Time(sec=2**31))),
        CameraInfo(k=(1.0,)),
        CircleObject(uuid=UUID(b"short")),
        CircleObject(radius=1e300),
        Header(frame_id="\ud800"),
    ],
    ids=["zero", "late", "array", "bytes", "overflow", "surrogate"],
)
def test_values_that_do_not_fit_are_refused(message: Message) -> None:
    with pytest.raises(NavError, match=f"{ros_type(type(message))} cannot be encoded"):
        encode(message)
