"""Where frames come from: the seam between image sources and the estimator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from perception import Camera
from perception.arrays import FloatArray

from ._picture_file import ImageRgb


@dataclass(frozen=True, slots=True, eq=False)
class SourceFrame:
    """One picture of a source.

    Attributes:
        name: of the frame in the results: a file's name, or a number.
        stamp_s: when it was taken.
        image_rgb: (H, W, 3) uint8; None when it could not be read.
        T_odom_camera: (4, 4) where the camera was, or None when the source does not know.
        problem: why there is no picture.
    """

    name: str
    stamp_s: float
    image_rgb: ImageRgb | None
    T_odom_camera: FloatArray | None = None
    problem: str = ""


class ImageSource(Protocol):
    """Frames one after another, with what the source knows about the camera.

    Attributes:
        camera: its calibration, if the source brings one.
        count: how many frames there are, if that is known; a video's own claim may be wrong.
        rate_hz: frames a second, if the source has such a thing.
        live: frames come as time passes; one that is not taken is lost.
    """

    camera: Camera | None
    count: int | None
    rate_hz: float | None
    live: bool

    def frames(self) -> Iterator[SourceFrame]:
        """Yield the frames; one that cannot be read has a ``problem`` instead of a picture.

        A source that ends before its time yields such a frame last.
        """
        ...

    def close(self) -> None:
        """Give back the device or file."""
        ...
