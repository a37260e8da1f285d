"""The interface of image sources, and the frames that they yield."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from perception import Camera
from perception.arrays import FloatArray, ImageRgb


@dataclass(frozen=True, slots=True, eq=False)
class SourceFrame:
    """A frame of a source.

    Attributes:
        name: of the frame in the results: the name of a file, or a number.
        stamp_s: time of the image.
        image_rgb: (H, W, 3) uint8; None if it could not be read.
        T_odom_camera: (4, 4) pose of the camera; None if the source does not know it.
        problem: why there is no image.
        orientation: EXIF's number of the turn that the file asked for and the image has got; 1 for
            none.
    """

    name: str
    stamp_s: float
    image_rgb: ImageRgb | None
    T_odom_camera: FloatArray | None = None
    problem: str = ""
    orientation: int = 1


class ImageSource(Protocol):
    """A sequence of frames, with what the source knows about the camera.

    Attributes:
        camera: its calibration, if the source has one; reading it raises an AwarenavError for one
            that cannot be used.
        rectified: whether the images are rectified: P of a calibration counts, without distortion.
        notes: what is wrong with the frame of the images.
        count: number of frames, if known; the number that a video states may be wrong.
        rate_hz: frames per second, if the source has a rate.
        live: whether frames come in real time; a frame that is not taken in time is lost.
        rendered: whether all frames are renders of this package.
    """

    @property
    def camera(self) -> Camera | None: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    rectified: bool
    count: int | None
    rate_hz: float | None
    live: bool
    rendered: bool

    def frames(self) -> Iterator[SourceFrame]:
        """Yield the frames; one that cannot be read has a ``problem`` and no image.

        If a source ends too early, its last frame is one with a ``problem``.
        """
        ...

    def close(self) -> None:
        """Release the device or file."""
        ...
