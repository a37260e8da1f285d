"""Messages as CDR bytes, by rosbags; only this module imports it."""

from __future__ import annotations

import struct
import threading
from types import SimpleNamespace
from typing import Any, Final, TypeVar

import numpy as np

from perception.installation import install_command

from .._errors import NavError
from ._message import FieldType, Message, definition, field_types, once_per_kind, ros_type
from .conversions import from_ros

try:
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise NavError(
        "ROS 2 messages need the package rosbags, which is not installed; it is part of the "
        f"extra 'ros2': {install_command('ros2')}"
    ) from cause

_AnyMessage = TypeVar("_AnyMessage", bound=Message)

_STORE: Final = get_typestore(Stores.EMPTY)
# Headers of plain XCDR2, and those of the first version in the same byte order.
_XCDR2: Final = {b"\0\6": b"\0\0", b"\0\7": b"\0\1"}
_REGISTERING: Final = threading.Lock()
# What rosbags raises for a value that does not fit its field.
_ERRORS: Final = (
    SerdeError,
    struct.error,
    TypeError,
    ValueError,
    AttributeError,
    OverflowError,
)


def encode(message: Message) -> bytes:
    """Return a message as CDR bytes (XCDR1, little-endian, with four-byte header), as in ROS 2.

    Raises:
        NavError: for a value that does not fit its field.
    """
    name = _registered(type(message))
    try:
        return bytes(_STORE.serialize_cdr(_with_arrays(message), name, little_endian=True))
    except _ERRORS as cause:
        raise NavError(f"{name} cannot be encoded: {cause}") from cause


def decode(kind: type[_AnyMessage], data: bytes) -> _AnyMessage:
    """Return a message from CDR bytes, header included, in either byte order.

    The second version of CDR (XCDR2) is read where it has the bytes of the first: it aligns numbers
    of 8 bytes in another way.

    Raises:
        NavError: for bytes that are cut off or of another type, and for other messages in XCDR2.
    """
    name = _registered(kind)
    if data[:2] in _XCDR2:
        if _has_long_numbers(kind):
            raise NavError(
                f"{name} comes in the second version of CDR, which is not read: let its publisher "
                "use the first (data representation XCDR, as ROS 2 does)"
            )
        data = _XCDR2[data[:2]] + data[2:]
    try:
        return from_ros(kind, _STORE.deserialize_cdr(data, name))
    except _ERRORS as cause:
        raise NavError(f"received bytes are not a {name}: {cause}") from cause


@once_per_kind
def _registered(kind: type[Message]) -> str:
    """Return the ROS name of a message class, which rosbags knows from then on."""
    name = ros_type(kind)
    with _REGISTERING:
        _STORE.register(get_types_from_msg(definition(kind), name))
    return name


@once_per_kind
def _has_long_numbers(kind: type[Message]) -> bool:
    """Return whether a message has numbers of 8 bytes."""
    return any(
        field.name in ("float64", "int64", "uint64")
        if field.message is None
        else _has_long_numbers(field.message)
        for field in field_types(kind).values()
    )


def _with_arrays(message: Message) -> Any:
    """Return a message, or a copy whose numbers are in arrays, which rosbags takes."""
    found = _fields_with_numbers(type(message))
    if not found:
        return message
    values = dict(vars(message))
    for name, field in found:
        value = values[name]
        if field.message is None:
            kind = np.dtype(field.name)
            is_bytes = isinstance(value, bytes)
            values[name] = np.frombuffer(value, kind) if is_bytes else np.array(value, kind)
        else:
            one = field.count is None
            values[name] = _with_arrays(value) if one else [_with_arrays(each) for each in value]
    return SimpleNamespace(**values)


@once_per_kind
def _fields_with_numbers(kind: type[Message]) -> tuple[tuple[str, FieldType], ...]:
    """Return the fields that are sequences of numbers, or messages that hold some."""

    def has_numbers(field: FieldType) -> bool:
        if field.message is not None:
            return bool(_fields_with_numbers(field.message))
        return field.count is not None and field.name != "string"

    return tuple((name, field) for name, field in field_types(kind).items() if has_numbers(field))
