"""Messages as CDR bytes and as DDS types; with ``_dds.py`` all that imports ``cyclonedds``."""

from __future__ import annotations

from typing import Any, Final, TypeVar, cast

from .._errors import NavError
from ._encoder import REFUSALS, encoded
from ._message import FieldType, Message, field_types, ros_type

try:
    from cyclonedds.idl import Buffer, IdlStruct
    from cyclonedds.idl._main import IdlMeta
    from cyclonedds.idl.types import (
        array,
        byte,
        float32,
        float64,
        int8,
        int32,
        int64,
        sequence,
        uint8,
        uint32,
    )
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise NavError(
        "ROS 2 messages need the package cyclonedds, which is not installed; it is part of the "
        "extra 'ros2': pip install 'awarenav[ros2]'"
    ) from cause

_AnyMessage = TypeVar("_AnyMessage", bound=Message)

_HEADER_BYTES: Final = 4
# By ROS name, and whether sequences of bytes are bytes.
_IDL_TYPES: Final[dict[tuple[str, bool], Any]] = {}
_PRIMITIVES: Final[dict[str, Any]] = {
    "bool": bool,
    "byte": byte,
    "int8": int8,
    "uint8": uint8,
    "int32": int32,
    "uint32": uint32,
    "int64": int64,
    "float32": float32,
    "float64": float64,
    "string": str,
}


def encode(message: Message) -> bytes:
    """A message in CDR (XCDR1, little-endian, with its four-byte header), as ROS 2 sends it."""
    try:
        return encoded(message)
    except REFUSALS as cause:
        raise NavError(f"{ros_type(type(message))} cannot be encoded: {cause}") from cause


def decode(kind: type[_AnyMessage], data: bytes) -> _AnyMessage:
    """A message from CDR bytes, header included, of either byte order.

    Raises:
        NavError: the bytes are cut off or are those of something else.
    """
    buffer = Buffer(data, align_offset=_HEADER_BYTES)
    try:
        message = _idl_type(kind, True).__idl__.deserialize(buffer)
        if buffer.tell() > len(data):  # slices of bytes end early without a word
            raise ValueError(f"{buffer.tell()} bytes are needed, got {len(data)}")
        return cast(_AnyMessage, message)
    except Exception as cause:  # the library raises what struct, str and it itself raise
        raise NavError(f"received bytes are no {ros_type(kind)}: {cause}") from cause


def topic_type(kind: type[Message]) -> Any:
    """The DDS type of a message: an IDL structure with the name that ROS 2 gives it.

    Samples of it carry CDR bytes (attribute ``cdr``) and are not decoded on the way.
    """
    exact = _idl_type(kind, False)
    if hasattr(exact, "cdr"):
        return exact

    def serialize(self: Any, *_: Any, **__: Any) -> bytes:
        return cast(bytes, self.cdr)

    def deserialize(cls: Any, data: bytes, *_: Any, **__: Any) -> Any:
        sample = object.__new__(cls)
        sample.cdr = bytes(data)
        return sample

    exact.cdr = b""
    exact.serialize = serialize
    exact.deserialize = classmethod(deserialize)
    return exact


def sample(message_type: type[Message], cdr: bytes) -> Any:
    """A sample of :func:`topic_type` with these bytes."""
    return topic_type(message_type).deserialize(cdr)


def _idl_type(kind: type[Message], fast: bool) -> Any:
    """The IDL structure of a message, read and written as the message itself.

    ``fast`` takes sequences of bytes as bytes: the same wire format a hundred times faster, but
    another type by name, so that topics do not use it.
    """
    known = _IDL_TYPES.get((ros_type(kind), fast))
    if known is not None:
        return known
    # rosidl_generator_dds_idl mangles package/msg/Name so.
    name = ros_type(kind).replace("/", "::").replace("::msg::", "::msg::dds_::") + "_"
    namespace: Any = IdlMeta.__prepare__(kind.__name__, (IdlStruct,), typename=name)
    for field, field_type in field_types(kind).items():
        namespace["__annotations__"][field] = _idl_field(field_type, fast)
    # The library makes what it has read by calling the type.
    namespace["__new__"] = lambda cls, **values: kind(
        **{key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    )
    namespace["__module__"] = __name__
    made = IdlMeta(kind.__name__, (IdlStruct,), namespace)
    return _IDL_TYPES.setdefault((ros_type(kind), fast), made)


def _idl_field(kind: FieldType, fast: bool) -> Any:
    if fast and kind.count == 0 and kind.name in ("int8", "uint8"):
        return bytes
    one = _PRIMITIVES[kind.name] if kind.message is None else _idl_type(kind.message, fast)
    if kind.count is None:
        return one
    maker: Any = array if kind.count else sequence
    return maker[(one, kind.count) if kind.count else one]
