"""ROS package people_msgs."""

from __future__ import annotations

from dataclasses import dataclass

from .._message import Float64, Message, String
from .geometry_msgs import Point
from .std_msgs import Header


@dataclass(frozen=True)
class Person(Message):
    """Velocity is a Point there; a tag's name stands at the same place in ``tagnames``."""

    name: String = ""
    position: Point = Point()
    velocity: Point = Point()
    reliability: Float64 = 0.0
    tagnames: tuple[String, ...] = ()
    tags: tuple[String, ...] = ()


@dataclass(frozen=True)
class People(Message):
    """Everybody at one instant."""

    header: Header = Header()
    people: tuple[Person, ...] = ()
