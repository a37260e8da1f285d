"""ROS 2 messages as frozen dataclasses whose annotations are the fields of a .msg file."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, Final, TypeVar, cast, get_args, get_origin, get_type_hints

from typing_extensions import dataclass_transform

# The second argument is the ROS name of the type.
Bool = Annotated[bool, "bool"]
# An octet: bytes of length one in rclpy.
Byte = Annotated[int, "byte"]
Int8 = Annotated[int, "int8"]
UInt8 = Annotated[int, "uint8"]
Int32 = Annotated[int, "int32"]
UInt32 = Annotated[int, "uint32"]
Int64 = Annotated[int, "int64"]
Float32 = Annotated[float, "float32"]
Float64 = Annotated[float, "float64"]
String = Annotated[str, "string"]
# Sequences of bytes are bytes in Python; int8 ones in two's complement.
UInt8s = Annotated[bytes, "uint8[]"]
Int8s = Annotated[bytes, "int8[]"]
UInt8x16 = Annotated[bytes, "uint8[16]"]
Float64x9 = Annotated[tuple[float, ...], "float64[9]"]
Float64x12 = Annotated[tuple[float, ...], "float64[12]"]
Float64x36 = Annotated[tuple[float, ...], "float64[36]"]

_RULE: Final = "=" * 80
_Made = TypeVar("_Made")


@dataclass_transform(frozen_default=True)
class Message:
    """Base of the messages, frozen dataclasses. The name of their module is the ROS package."""

    def __init_subclass__(cls) -> None:
        dataclasses.dataclass(frozen=True)(cls)


@dataclasses.dataclass(frozen=True)
class FieldType:
    """The type of one field.

    Attributes:
        name: type of a value: a ROS primitive such as ``"float64"``, or a message such as
            ``"geometry_msgs/msg/Point"``.
        message: the class, if a value is a message.
        count: None for one value, 0 for a sequence of any length, n for an array of n.
    """

    name: str
    message: type[Message] | None = None
    count: int | None = None

    @property
    def text(self) -> str:
        """The type as in a .msg file, with the package of a message."""
        name = self.name.replace("/msg/", "/")
        return name if self.count is None else f"{name}[{self.count or ''}]"


def ros_type(message: type[Message]) -> str:
    """Return the ROS name of a message class, such as ``"nav2_msgs/msg/SpeedLimit"``."""
    return f"{message.__module__.rsplit('.', 1)[1]}/msg/{message.__name__}"


def once_per_kind(make: Callable[[type[Message]], _Made]) -> Callable[[type[Message]], _Made]:
    """Return a function that keeps what ``make`` returns for each message class."""
    # Classes of frozen dataclasses are hashable, which mypy denies.
    return cast(Callable[[type[Message]], _Made], cache(cast(Any, make)))


@once_per_kind
def field_types(message: type[Message]) -> dict[str, FieldType]:
    """Return name and type of each field, in the order of the wire."""
    hints = get_type_hints(message, include_extras=True)
    # Its subclasses are dataclasses, which mypy does not tell of their base.
    names = [field.name for field in dataclasses.fields(cast(Any, message))]
    return {name: _field_type(hints[name]) for name in names}


def definition(message: type[Message]) -> str:
    """Return the message definition with those of all nested messages, as in recordings.

    This is the encoding "ros2msg" of the MCAP specification: definitions separated by a line of 80
    equals signs and ``MSG: package/Name``.
    """
    text = _own_definition(message)
    for each in _dependencies(message):
        text += f"{_RULE}\nMSG: {ros_type(each).replace('/msg/', '/')}\n{_own_definition(each)}"
    return text


def _field_type(hint: Any) -> FieldType:
    if get_origin(hint) is Annotated:
        name, _, count = get_args(hint)[1].partition("[")
        return FieldType(name, None, int(count.rstrip("]") or 0) if count else None)
    if get_origin(hint) is tuple:
        return dataclasses.replace(_field_type(get_args(hint)[0]), count=0)
    return FieldType(ros_type(hint), hint)


def _own_definition(message: type[Message]) -> str:
    return "".join(f"{kind.text} {name}\n" for name, kind in field_types(message).items())


def _dependencies(message: type[Message]) -> list[type[Message]]:
    """Return every nested message once, each before those nested in it."""
    found: list[type[Message]] = []
    for kind in field_types(message).values():
        if kind.message is not None:
            found += [kind.message, *_dependencies(kind.message)]
    return list(dict.fromkeys(found))
