"""Our messages and those that rclpy takes, one in the form of the other."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from ._message import FieldType, Message, field_types, ros_type

_AnyMessage = TypeVar("_AnyMessage", bound=Message)


def ros_class(kind: type[Message]) -> Any:
    """The class that ROS made of a message type; raises ImportError where it is not installed."""
    package, _, name = ros_type(kind).split("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except AttributeError as cause:
        raise ImportError(f"{package}.msg has no {name}: another version of it") from cause


def to_ros(message: Message, find: Callable[[type[Message]], Any] = ros_class) -> Any:
    """A message for ``Publisher.publish``.

    Args:
        message: ours.
        find: gives the class of a message type.
    """
    made = find(type(message))()
    for name, kind in field_types(type(message)).items():
        setattr(made, name, _to_ros(getattr(message, name), kind, find))
    return made


def from_ros(kind: type[_AnyMessage], message: Any) -> _AnyMessage:
    """Our message of one that a subscription has brought."""
    fields = field_types(kind)
    return kind(**{name: _from_ros(getattr(message, name), fields[name]) for name in fields})


def _to_ros(value: Any, kind: FieldType, find: Callable[[type[Message]], Any]) -> Any:
    if kind.message is not None:
        return to_ros(value, find) if kind.count is None else [to_ros(each, find) for each in value]
    if kind.name == "byte":
        return bytes([value])
    if kind.count is None:
        return value
    if kind.name in ("int8", "uint8"):
        # rosidl takes arrays for sequences, and any sequence of the right length for arrays.
        return array("b" if kind.name == "int8" else "B", value) if kind.count == 0 else list(value)
    return list(value)


def _from_ros(value: Any, kind: FieldType) -> Any:
    if kind.message is not None:
        if kind.count is None:
            return from_ros(kind.message, value)
        return tuple(from_ros(kind.message, each) for each in value)
    if kind.name == "byte":
        return value[0] if isinstance(value, bytes) else value
    if kind.count is None:
        return value
    if kind.name in ("int8", "uint8"):
        return bytes(memoryview(value).cast("B")) if not isinstance(value, list) else bytes(value)
    return tuple(value.tolist()) if hasattr(value, "tolist") else tuple(value)
