"""ROS package visualization_msgs (ROS 2 Humble and later)."""

from __future__ import annotations

from typing import ClassVar

from .._message import Bool, Float32, Int32, Message, String, UInt8s
from .builtin_interfaces import Duration
from .geometry_msgs import Point, Pose, Vector3
from .sensor_msgs import CompressedImage
from .std_msgs import ColorRGBA, Header


class UVCoordinate(Message):
    """A position in a texture."""

    u: Float32 = 0.0
    v: Float32 = 0.0


class MeshFile(Message):
    """A mesh file."""

    filename: String = ""
    data: UInt8s = b""


class Marker(Message):
    """One shape for RViz."""

    ARROW: ClassVar[int] = 0
    CYLINDER: ClassVar[int] = 3
    LINE_STRIP: ClassVar[int] = 4
    TEXT_VIEW_FACING: ClassVar[int] = 9
    ADD: ClassVar[int] = 0
    DELETE: ClassVar[int] = 2
    DELETEALL: ClassVar[int] = 3

    header: Header = Header()
    ns: String = ""
    id: Int32 = 0
    type: Int32 = 0
    action: Int32 = 0
    pose: Pose = Pose()
    scale: Vector3 = Vector3()
    color: ColorRGBA = ColorRGBA()
    lifetime: Duration = Duration()
    frame_locked: Bool = False
    points: tuple[Point, ...] = ()
    colors: tuple[ColorRGBA, ...] = ()
    texture_resource: String = ""
    texture: CompressedImage = CompressedImage()
    uv_coordinates: tuple[UVCoordinate, ...] = ()
    text: String = ""
    mesh_resource: String = ""
    mesh_file: MeshFile = MeshFile()
    mesh_use_embedded_materials: Bool = False


class MarkerArray(Message):
    """The shapes at one time."""

    markers: tuple[Marker, ...] = ()
