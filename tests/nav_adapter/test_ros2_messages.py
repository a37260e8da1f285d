"""Messages: fields, schemas and CDR bytes, against the .msg files and cyclonedds' encoder."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

import pytest
from cyclonedds.idl import Endianness
from hypothesis import given, settings
from hypothesis import strategies as st
from ros2_receiver import made
from ros2_scenes import typestore
from rosbags.typesys import get_types_from_msg

from nav_adapter import NavError
from nav_adapter.ros2 import decode, encode, messages
from nav_adapter.ros2._message import FieldType, field_types
from nav_adapter.ros2.messages import Message, definition, ros_type
from nav_adapter.ros2.messages.builtin_interfaces import Time
from nav_adapter.ros2.messages.nav2_msgs import CircleObject, SpeedLimit
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid, Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image, LaserScan
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


def by_cyclonedds(message: Message, endianness: Endianness = Endianness.Little) -> bytes:
    """Return the bytes of cyclonedds' own encoder, with types made from the .msg files."""
    kind = made(ros_type(type(message)), STORE)
    return bytes(kind.__idl__.serialize(message, use_version_2=False, endianness=endianness))


def text_of(node: tuple) -> str:
    """Return a type of rosbags' registry in the notation of a .msg file."""
    tag, content = int(node[0]), node[1]
    if tag == 1:
        return str(content[0])
    if tag == 2:
        return str(content).replace("/msg/", "/")
    inner, count = content
    return f"{text_of(inner)}[{count or ''}]"


@pytest.mark.parametrize("kind", KINDS, ids=ros_type)
def test_fields_and_schemas_agree_with_the_msg_files(kind: type[Message]) -> None:
    ours = [(name, field.text) for name, field in field_types(kind).items()]
    assert ours == [(name, text_of(node)) for name, node in STORE.fielddefs[ros_type(kind)][1]]
    text = definition(kind)
    for name, content in get_types_from_msg(text, ros_type(kind)).items():
        assert content[1] == STORE.fielddefs[name][1]
    heads = [line for line in text.splitlines() if line.startswith("MSG: ")]
    assert len(heads) == len(set(heads))


def value_of(kind: FieldType) -> st.SearchStrategy:
    """Return a strategy for any value of a field, in single precision where the wire has it."""
    # rosbags packs an octet as a signed number.
    integers = {"byte": (0, 127), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}
    integers |= {"int8": (-128, 127), "uint8": (0, 255), "int64": (-(2**63), 2**63 - 1)}
    if kind.message is not None:
        one = filled(kind.message)
    elif kind.name in ("int8", "uint8") and kind.count is not None:
        # cyclonedds takes no negative int8 from bytes.
        each = st.integers(0, 127 if kind.name == "int8" else 255)
        return st.lists(each, min_size=kind.count, max_size=kind.count or 9).map(bytes)
    elif kind.name == "bool":
        one = st.booleans()
    elif kind.name == "string":
        one = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=9)
    elif kind.name in integers:
        one = st.integers(*integers[kind.name])
    else:
        one = st.floats(width=32 if kind.name == "float32" else 64, allow_nan=False)
    if kind.count is None:
        return one
    return st.lists(one, min_size=kind.count, max_size=kind.count or 3).map(tuple)


@cache
def filled(kind: type[Message]) -> st.SearchStrategy[Message]:
    return st.builds(kind, **{name: value_of(each) for name, each in field_types(kind).items()})


@pytest.mark.parametrize("kind", KINDS, ids=ros_type)
@settings(max_examples=10)
@given(data=st.data())
def test_bytes_are_those_of_cyclonedds(kind: type[Message], data: st.DataObject) -> None:
    """For any values, and so any alignments; either byte order is read."""
    message = data.draw(filled(kind))
    assert encode(message) == by_cyclonedds(message)
    for order in (Endianness.Little, Endianness.Big):
        assert decode(kind, by_cyclonedds(message, order)) == message


@pytest.mark.parametrize("kind", [Image, LaserScan, Odometry, SpeedLimit, CameraInfo], ids=ros_type)
@settings(max_examples=10)
@given(data=st.data())
def test_the_second_version_of_cdr_is_read_where_it_is_the_same(kind, data: st.DataObject) -> None:
    message = data.draw(filled(kind))
    for order, head in ((Endianness.Little, b"\0\7"), (Endianness.Big, b"\0\6")):
        sent = head + by_cyclonedds(message, order)[2:]
        if kind in (Image, LaserScan):
            assert decode(kind, sent) == message
        else:
            with pytest.raises(NavError, match="comes in the second version of CDR"):
                decode(kind, sent)


def test_negative_cells_are_read_as_bytes() -> None:
    grid = OccupancyGrid(data=b"\xff\x00\x64")
    assert STORE.deserialize_cdr(encode(grid), ros_type(OccupancyGrid)).data.tolist() == [
        -1,
        0,
        100,
    ]
    assert decode(OccupancyGrid, encode(grid)) == grid


@given(st.binary(max_size=40))
def test_any_bytes_are_decoded_or_refused(data: bytes) -> None:
    try:
        read = decode(SpeedLimit, data)
    except NavError:
        return
    assert isinstance(read, SpeedLimit)


def test_every_truncated_message_is_refused() -> None:
    for message in (
        Image(Header(Time(1, 2), "camera"), 2, 3, "rgb8", 0, 9, bytes(18)),
        Header(Time(1, 2), "camera"),
    ):
        whole = encode(message)
        for length in range(len(whole)):
            with pytest.raises(NavError, match=ros_type(type(message))):
                decode(type(message), whole[:length])


@pytest.mark.parametrize(
    "message",
    [
        SpeedLimit(speed_limit="fast"),  # type: ignore[arg-type]
        SpeedLimit(Header(Time(sec=2**31))),
        CameraInfo(k=(1.0,)),
        CircleObject(uuid=UUID(b"short")),
        CircleObject(radius=1e300),
        Header(frame_id="\ud800"),
    ],
    ids=["text", "late", "array", "bytes", "overflow", "surrogate"],
)
def test_values_that_do_not_fit_are_refused(message: Message) -> None:
    with pytest.raises(NavError, match=f"{ros_type(type(message))} cannot be encoded"):
        encode(message)
