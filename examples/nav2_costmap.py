"""People in a costmap with Nav2's values, on top of its previous content.

``python examples/nav2_costmap.py [IMAGE.png]``: a person walks across a map with a rack. The
painter removes what it painted before, so the rack and the unknown cells come back.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState
from nav_adapter.exporters import CostmapPainter
from tracking import PersonTrack

_RESOLUTION_M = 0.05
_ORIGIN_ODOM_M = (-1.0, -5.0)


def track(stamp_s: float) -> PersonTrack:
    """Return a person who walks across and watches the robot after two seconds."""
    return PersonTrack(
        id=1,
        stamp_s=stamp_s,
        status="confirmed",
        position_odom_m=(4.0, -3.0 + 1.2 * stamp_s),
        velocity_odom_mps=(0.0, 1.2),
        covariance_odom=np.diag([0.01, 0.01, 0.04, 0.04]),
        awareness=0.8,
        awareness_std=0.1,
        awareness_lower=0.6 if stamp_s > 2.0 else 0.0,
        height_m=1.75,
        time_since_seen_s=0.0,
    )


def main() -> None:
    """Print the number of cells with a cost once per second; write an image if asked."""
    footprint = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
    robot = RobotProfile(footprint, 1.5, 1.0, 1.0, 0.3)
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), robot)

    costmap = np.zeros((200, 200), dtype=np.uint8)
    costmap[140:160, 60:120] = 254  # a rack
    costmap[:, 180:] = 255  # not seen yet
    static = costmap.copy()
    painter = CostmapPainter(costmap, _ORIGIN_ODOM_M, _RESOLUTION_M, inscribed_radius_m=0.25)
    images = []
    for tick in range(51):
        stamp_s = 0.1 * tick
        state = RobotState(stamp_s, np.zeros(2), 0.0, 0.0, 0.0)
        painter.update(adapter.update([track(stamp_s)], state, stamp_s))
        if tick % 10 == 0:
            lethal, costly = (int((costmap >= least).sum()) for least in (254, 1))
            print(f"{stamp_s:3.1f} s  {lethal} cells lethal or unknown, {costly} cost something")
            images.append(cv2.applyColorMap(costmap[::-1], cv2.COLORMAP_VIRIDIS))
    painter.clear()
    print(f"cells that differ from the map without people: {int((costmap != static).sum())}")
    if len(sys.argv) > 1:
        cv2.imwrite(str(Path(sys.argv[1])), np.hstack(images[::2]))


if __name__ == "__main__":
    main()
