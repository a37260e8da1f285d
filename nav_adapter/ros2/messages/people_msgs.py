"""ROS package people_msgs."""

from __future__ import annotations

from .._message import Float64, Message, String
from .geometry_msgs import Point
from .std_msgs import Header


class Person(Message):
    """A person; ``tagnames`` holds the names of ``tags``, and the velocity is a Point."""

    name: String = ""
    position: Point = Point()
    velocity: Point = Point()
    reliability: Float64 = 0.0
    tagnames: tuple[String, ...] = ()
    tags: tuple[String, ...] = ()


class People(Message):
    """All people at one time."""

    header: Header = Header()
    people: tuple[Person, ...] = ()
