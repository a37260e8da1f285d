"""Messages as CDR bytes and as DDS types; only this module and ``_dds`` import ``cyclonedds``."""

from __future__ import annotations

from typing import Any, Final, TypeVar, cast

from perception.installation import install_command

from .._errors import NavError
from ._encoder import ENCODING_ERRORS, encoded
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
        f"extra 'ros2': {install_command('ros2')}"
    ) from cause

_AnyMessage = TypeVar("_AnyMessage", bound=Message)

_HEADER_BYTES: Final = 4
# By ROS name, and by whether sequences of bytes are read as ``bytes``.
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
    """Return a message as CDR bytes (XCDR1, little-endian, with four-byte header), as in ROS 2.

    Raises:
        NavError: for a value that does not fit its field.
    """
    try:
        return encoded(message)
    except ENCODING_ERRORS as cause:
        raise NavError(f"{ros_type(type(message))} cannot be encoded: {cause}") from cause


def decode(kind: type[_AnyMessage], data: bytes) -> _AnyMessage:
    """Return a message from CDR bytes, header included, in either byte order.

    Raises:
        NavError: for bytes that are cut off or of another type.
    """
    buffer = Buffer(data, align_offset=_HEADER_BYTES)
    try:
        message = _idl_type(kind, True).__idl__.deserialize(buffer)
        if buffer.tell() > len(data):  # reading past the end raises no error
            raise ValueError(f"{buffer.tell()} bytes are needed, got {len(data)}")
        return cast(_AnyMessage, message)
    except Exception as cause:  # the library raises its own errors and those of struct and str
        raise NavError(f"received bytes are not a {ros_type(kind)}: {cause}") from cause


def topic_type(kind: type[Message]) -> Any:
    """Return the DDS type of a message: an IDL structure with the name that ROS 2 gives it.

    Its samples hold CDR bytes (attribute ``cdr``), which DDS does not decode.
    """
    idl_type = _idl_type(kind, False)
    if hasattr(idl_type, "cdr"):
        return idl_type

    def serialize(self: Any, *_: Any, **__: Any) -> bytes:
        return cast(bytes, self.cdr)

    def deserialize(cls: Any, data: bytes, *_: Any, **__: Any) -> Any:
        sample = object.__new__(cls)
        sample.cdr = bytes(data)
        return sample

    idl_type.cdr = b""
    idl_type.serialize = serialize
    idl_type.deserialize = classmethod(deserialize)
    return idl_type


def sample(message_type: type[Message], cdr: bytes) -> Any:
    """Return a sample of :func:`topic_type` with these bytes."""
    return topic_type(message_type).deserialize(cdr)


def _idl_type(kind: type[Message], fast: bool) -> Any:
    """Return the IDL structure of a message, which reads and writes the message itself.

    With ``fast``, sequences of bytes are ``bytes``: the same wire format, a hundred times faster.
    The type differs, though, so topics do not use it.
    """
    known = _IDL_TYPES.get((ros_type(kind), fast))
    if known is not None:
        return known
    # rosidl_generator_dds_idl mangles package/msg/Name in this way.
    name = ros_type(kind).replace("/", "::").replace("::msg::", "::msg::dds_::") + "_"
    namespace: Any = IdlMeta.__prepare__(kind.__name__, (IdlStruct,), typename=name)
    for field, field_type in field_types(kind).items():
        namespace["__annotations__"][field] = _idl_field(field_type, fast)
    # The library calls the type to make a message from the fields that it has read.
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
