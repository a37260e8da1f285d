"""A check that the frame of images is an optical one: z ahead, x right, y down (REP 103)."""

from __future__ import annotations

import math
from typing import Final

from perception.arrays import FloatArray

# A camera on a robot that looks for people never looks further up.
_STEEPEST_RAD: Final = math.radians(60.0)
# A body frame (x ahead, y left, z up) that is tilted down looks like an optical one that is rolled
# by a quarter turn and looks up. No camera that is mounted so looks further up than this.
_STEEPEST_ROLLED_RAD: Final = math.radians(30.0)


def optical_problem(T_level_camera: FloatArray, frame: str, level_frame: str) -> str:
    """Return why a frame cannot be the optical frame of images; empty if it can.

    Cameras that are upside down or rolled by a quarter turn are in order.

    Args:
        T_level_camera: (4, 4) pose of the frame in one whose z axis points up.
        frame: its name.
        level_frame: name of the other frame.
    """
    right, down, ahead = T_level_camera[2, :3].tolist()
    up_rad = math.asin(max(-1.0, min(1.0, ahead)))
    highest_rad = _STEEPEST_ROLLED_RAD if abs(down) <= abs(right) else _STEEPEST_RAD
    # A camera may look straight down, if at least the name is right.
    lowest_rad = -math.pi if "optical" in frame.lower() else -_STEEPEST_RAD
    if lowest_rad <= up_rad <= highest_rad:
        return ""
    where = "up" if up_rad > 0.0 else "down"
    optical = f"{frame.removesuffix('_link').removesuffix('_frame')}_optical_frame"
    return (
        f"the frame {frame!r} of the images is not an optical frame: its z axis, the view, points "
        f"{abs(math.degrees(up_rad)):.0f} degrees {where} in {level_frame!r}; the driver must name "
        f"the frame with z ahead, x right and y down, often {optical!r}"
    )
