"""The adapter between a camera and a local planner, in a loop of your own.

Run it with ``python examples/plug_into_planner.py``. A person walks across the robot's path and
looks first elsewhere, then at the robot. Radius and speed limit follow.
"""

from __future__ import annotations

import math

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState, circles
from perception import PersonObservation
from tracking import PersonTracker, TrackerConfig

# The camera 1.4 m above the base, looking along odom x: optical axes in odom as columns.
T_ODOM_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)


def observed(stamp_s: float) -> tuple[PersonObservation, ...]:
    """Return the people in one frame: ``AwarenessPipeline.process`` on a robot, a script here."""
    looking = stamp_s > 1.5
    return (
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([1.5 - 0.8 * stamp_s, 0.2, 3.0]),
            position_covariance_m2=np.diag([0.03, 0.03, 0.08]) ** 2,
            gaze_camera=None,
            awareness=0.85 if looking else 0.0,
            awareness_std=0.05,
            score=0.9,
        ),
    )


def main() -> None:
    """Print the planner's input ten times per second."""
    footprint = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
    robot = RobotProfile(
        footprint_m=footprint,
        max_speed_mps=1.5,
        max_acceleration_mps2=1.0,
        max_deceleration_mps2=1.0,
        reaction_time_s=0.3,
    )
    policy = AwarenessPolicy.preset("balanced")
    tracker = PersonTracker(TrackerConfig.for_policy(policy))
    adapter = NavAdapter(policy, robot)
    for tick in range(41):
        stamp_s = 0.1 * tick
        state = RobotState(stamp_s, np.zeros(2), 0.0, 0.5, 0.0)
        tracks = tracker.update(observed(stamp_s), stamp_s, T_ODOM_CAMERA)
        constraints = adapter.update(tracks, state, stamp_s, perception_stamp_s=stamp_s)
        # Your planner goes here: obstacles as x, y, vx, vy, r and a speed limit. A circle may
        # contain the robot already: docs/planners.md, "Inside a circle".
        for x, y, vx, vy, radius in circles(constraints):
            print(
                f"{stamp_s:4.1f} s  person at ({x:5.2f}, {y:5.2f}) m moving "
                f"{math.hypot(vx, vy):4.2f} m/s, radius {radius:4.2f} m, "
                f"limit {constraints.speed_limit_mps:4.2f} m/s ({constraints.limited_by})"
            )


if __name__ == "__main__":
    main()
