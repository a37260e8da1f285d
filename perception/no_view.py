"""Frames that show nothing: of a covered or dead camera, or of any sensor that is frozen."""

from __future__ import annotations

import math
import zlib
from typing import Any, Final, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray, ImageRgb
from .errors import PerceptionError

#: Why a picture is no view: it is …
NoView: TypeAlias = Literal["black", "of one colour", "the same picture as before"]
#: The reason of a frozen camera.
FROZEN: Final = "the same picture as before"

# A frozen driver may send the frames of its buffers in turn. Video4Linux has no more buffers.
_BUFFERS: Final = 32
# A robot that has moved so far sees another frame than before, also without noise.
_MOVED_M: Final = 0.05
_TURNED_RAD: Final = math.radians(2.0)

# A picture is looked at in blocks of so many pixels a side: the noise of a covered sensor averages
# out in them, and what a scene shows does not.
_BLOCK_PX: Final = 8
# A picture without a block brighter than this is black: in it, no network finds anybody. A picture
# taken at night has lamps.
_BLACK_LEVEL: Final = 8
# A codec rounds one colour to levels this near to their median. Averages of noise are as near.
_COLOUR_LEVELS: Final = 3
# Most pictures are told by their blocks before hot pixels are taken out: in a larger share of them
# something is to be seen.
_SEEN_SHARE: Final = 0.01


# A camera that counts in 16 bits, and uses few of them, such as a thermal one, shows less than this
# many levels in 8 bits, without its hundred brightest and darkest in ten thousand.
_FEWEST_LEVELS: Final = 12.0
_WITHOUT: Final = (0.01, 99.99)


def eight_bits(samples: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return 16-bit values scaled to 8 bits over their full range.

    Raises:
        PerceptionError: for values that use so little of it that nothing would be left to see.
    """
    low, high = np.percentile(samples[::3, ::3], _WITHOUT).tolist()
    if (high - low) * 255.0 / 65535.0 < _FEWEST_LEVELS:
        raise PerceptionError(
            f"its 16-bit values lie between {low:.0f} and {high:.0f}, {(high - low) / 655.35:.1f} "
            "% of their range: scale them to 8 bits first, as thermal and infrared cameras need "
            "it, or is the lens covered?"
        )
    return np.asarray(cv2.convertScaleAbs(samples, alpha=255.0 / 65535.0), dtype=np.uint8)


class LastFrames:
    """The last 32 different frames of one sensor, by which it is seen whether it is frozen.

    A live sensor has noise, so that no two of its frames are equal to the bit. A driver whose
    sensor is frozen sends the last one again and again, or those in its buffers in turn.
    """

    def __init__(self) -> None:
        # The robot's pose at the first of the frames that are equal, by their checksum.
        self._first: dict[tuple[Any, ...], FloatArray | None] = {}

    def repeats(self, frame: NDArray[Any], T_odom_robot: FloatArray | None = None) -> bool:
        """Note a frame, and return whether it is one of the last ones again.

        Args:
            frame: a picture, a depth image, or the ranges of a scan.
            T_odom_robot: (4, 4) pose of the robot, of a sensor that may have no noise, as in a
                simulator. A frame then repeats another only if the robot has moved in between.
        """
        key = frame.shape, frame.dtype.str, zlib.crc32(np.ascontiguousarray(frame).data)
        if key not in self._first:
            self._first[key] = T_odom_robot
            if len(self._first) > _BUFFERS:
                del self._first[next(iter(self._first))]
            return False
        first = self._first[key]
        if first is None or T_odom_robot is None:
            return True
        step = np.linalg.inv(first) @ T_odom_robot
        turned_rad = abs(math.atan2(step[1, 0], step[0, 0]))
        return math.hypot(*step[:2, 3].tolist()) > _MOVED_M or turned_rad > _TURNED_RAD


def why_no_view(image_rgb: ImageRgb, last: LastFrames | None = None) -> NoView | None:
    """Return why a picture is no view of the scene; None for a view.

    A camera that is covered, dead or frozen goes on sending pictures. That nobody is seen in them
    does not mean that nobody is there, so they must not reach a tracker:

        if why_no_view(image_rgb, last) is None:
            tracker.update(pipeline.process(image_rgb, stamp_s), stamp_s, T_odom_camera)

    A live camera has noise, so no two of its pictures are equal to the bit. Noise alone is no view,
    nor are single hot pixels. Frozen pictures into which a clock is drawn count as views.

    Args:
        image_rgb: (H, W, 3) uint8.
        last: the last pictures of the camera, to which this one is added; None to compare none.

    Raises:
        PerceptionError: for a ``last`` that is neither, such as the picture before.
    """
    if not isinstance(last, LastFrames | None):
        raise PerceptionError(
            "last must be the camera's LastFrames(), made once and given with every picture, or "
            f"None, got {type(last).__name__}"
        )
    repeats = last is not None and last.repeats(image_rgb)
    blocks = _blocks(image_rgb)
    level = np.median(blocks.reshape(-1, 3), axis=0).round()
    colours: tuple[tuple[NoView, FloatArray, FloatArray], ...] = (
        ("black", np.zeros(3), np.full(3, float(_BLACK_LEVEL))),
        ("of one colour", level - _COLOUR_LEVELS, level + _COLOUR_LEVELS),
    )
    for reason, low, high in colours:
        if _lie_within(blocks, low, high, _SEEN_SHARE):
            calm = np.asarray(cv2.medianBlur(np.ascontiguousarray(image_rgb), 3), np.uint8)
            if _lie_within(_blocks(calm), low, high, 0.0):
                return reason
    return FROZEN if repeats else None


def _blocks(image_rgb: ImageRgb) -> ImageRgb:
    """Return the mean colour of every block of a picture."""
    height, width = image_rgb.shape[:2]
    size = max(width // _BLOCK_PX, 1), max(height // _BLOCK_PX, 1)
    return np.asarray(cv2.resize(image_rgb, size, interpolation=cv2.INTER_AREA))


def _lie_within(blocks_rgb: ImageRgb, low: FloatArray, high: FloatArray, others: float) -> bool:
    """Return whether all blocks but a share of others lie between two colours (3,)."""
    count = blocks_rgb.shape[0] * blocks_rgb.shape[1]
    within = cv2.countNonZero(cv2.inRange(blocks_rgb, low, high))
    return bool(count - within <= others * count)
