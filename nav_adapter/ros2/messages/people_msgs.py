"""ROS package people_msgs."""

from __future__ import annotations

from dataclasses import dataclass

from .._message import Float64, Message, String
from .geometry_msgs import Point
from .std_msgs import Header


@dataclass(frozen=True)
class Person(Message):
    """A person; ``tagnames`` holds the names of ``tags``, and the velocity is a Point."""

    name: String = ""
    position: Point = Point()
    velocity: Point = Point()
    reliability: Float64 = 0.0
    tagnames: tuple[String, ...] = ()
    tags: tuple[String, ...] = ()


@dataclass(frozen=True)
class People(Message):
    """All people at one time."""

    header: Header = Header()
    people: tuple[Person, ...] = ()
