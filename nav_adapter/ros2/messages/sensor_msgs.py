"""ROS package sensor_msgs."""

from __future__ import annotations

from .._message import (
    Bool,
    Float32,
    Float64,
    Float64x9,
    Float64x12,
    Message,
    String,
    UInt8,
    UInt8s,
    UInt32,
)
from .std_msgs import Header


class Image(Message):
    """Raw pixels, with ``step`` bytes per row."""

    header: Header = Header()
    height: UInt32 = 0
    width: UInt32 = 0
    encoding: String = ""
    is_bigendian: UInt8 = 0
    step: UInt32 = 0
    data: UInt8s = b""


class CompressedImage(Message):
    """An image as the bytes of a JPEG or PNG file."""

    header: Header = Header()
    format: String = ""
    data: UInt8s = b""


class RegionOfInterest(Message):
    """A part of an image; all zeros for the whole image."""

    x_offset: UInt32 = 0
    y_offset: UInt32 = 0
    height: UInt32 = 0
    width: UInt32 = 0
    do_rectify: Bool = False


class CameraInfo(Message):
    """A calibration: k is the camera matrix, d the distortion."""

    header: Header = Header()
    height: UInt32 = 0
    width: UInt32 = 0
    distortion_model: String = ""
    d: tuple[Float64, ...] = ()
    k: Float64x9 = (0.0,) * 9
    r: Float64x9 = (0.0,) * 9
    p: Float64x12 = (0.0,) * 12
    binning_x: UInt32 = 0
    binning_y: UInt32 = 0
    roi: RegionOfInterest = RegionOfInterest()


class LaserScan(Message):
    """One sweep of a laser scanner. The header's stamp is the time of the first ray."""

    header: Header = Header()
    angle_min: Float32 = 0.0
    angle_max: Float32 = 0.0
    angle_increment: Float32 = 0.0
    time_increment: Float32 = 0.0
    scan_time: Float32 = 0.0
    range_min: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: tuple[Float32, ...] = ()
    intensities: tuple[Float32, ...] = ()
