"""Range of people of any size: ``python -m benchmarks.how_far``.

Simulated people of 1.0 to 1.9 m stand, sit or bend before a camera, whole, behind a shelf that
hides their legs, or cut off by the lower border of the image. Keypoints of their bodies pass
through the awareness pipeline: alone, with the floor, and with a depth image. Then somebody walks
before a robot with a camera and a scanner, and goes on before the camera alone.
"""

from ._cli import BOUND_2D_95, BOUND_95
from ._people import CAMERA, STATURES_M, T_ODOM_CAMERA, Case, HowFar, Result, cases
from ._tracks import Tracked, tracked

__all__ = [
    "BOUND_2D_95",
    "BOUND_95",
    "CAMERA",
    "STATURES_M",
    "T_ODOM_CAMERA",
    "Case",
    "HowFar",
    "Result",
    "Tracked",
    "cases",
    "tracked",
]
