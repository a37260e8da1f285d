"""A planner with a costmap, as of today's AMR."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.arrays import FloatArray

from ._drives import Tick
from ._geometry import FootprintBox, Poses
from ._sampling import CLEARANCE_M
from ._scene import Aim, Scene
from ._window import DynamicWindow

# Defaults of Nav2's inflation layer (docs.nav2.org, "Inflation Layer Parameters"):
# inflation_radius 0.55 m and cost_scaling_factor 10.0. The cost of a cell is
# 252 exp(-10 (d - r)), at d from an obstacle and with r the robot's inscribed radius, and 0
# beyond 0.55 m. So it is a cost over the gap d - r between outline and obstacle.
_INFLATION_RADIUS_M: Final = 0.55
# Nav2 asks for a radius above the inscribed one; of a wider robot, one cell of the map remains.
_CELL_M: Final = 0.05
_STANDING_MPS: Final[FloatArray] = np.zeros(2)
# Margin of the way past people, beyond half the robot's width and the clearance.
_PAST_M: Final = 0.10
# The robot passes on the left only if that turn is smaller by this much; else it keeps right.
_KEEP_RIGHT_RAD: Final = 0.1


class CostmapPlanner(DynamicWindow):
    """A planner with a costmap, as most sites have: it knows places, not velocities.

    It is the dynamic window for which every person stands, with costs near obstacles as by the
    defaults of Nav2's inflation layer (``inflation_radius`` 0.55 m, ``cost_scaling_factor`` 10).
    Their exponential is replaced by a parabola of the same width, which for a robot 0.5 m wide
    differs from it by less than 0.1 of the cost at contact. If somebody is in front of the goal,
    the robot heads for the tangent past them. It keeps the speed limit of its policy.

    Args:
        robot: footprint and limits; the footprint counts with its bounding rectangle.
        static_boxes_odom_m: (N, 4) fixed obstacles x_min, y_min, x_max, y_max; None for none.

    Raises:
        SimError: if the boxes are not finite or a minimum is not below its maximum.
    """

    def __init__(self, robot: RobotProfile, static_boxes_odom_m: ArrayLike | None = None) -> None:
        super().__init__(robot, static_boxes_odom_m)
        inscribed_m = np.abs([robot.footprint_m.min(axis=0), robot.footprint_m.max(axis=0)]).min()
        gap_m = max(_INFLATION_RADIUS_M - float(inscribed_m), _CELL_M)
        self.person_comfort_m = self.box_comfort_m = gap_m

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: ArrayLike,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Choose the command for the next tick, as if everybody stood; see the base class."""
        people = tuple(
            replace(person, velocity_odom_mps=_STANDING_MPS) for person in constraints.obstacles
        )
        return super().plan(robot_state, goal_odom_m, replace(constraints, obstacles=people), dt_s)

    def _headed(self, tick: Tick, goal_odom_m: FloatArray, constraints: NavConstraints) -> Tick:
        return tick._replace(aim=past_people(tick.aim, tick.scene, self._footprint))


def past_people(goal: Aim, scene: Scene, footprint: FootprintBox) -> Aim:
    """Return the goal, or the tangent past the nearest person who stands in front of it.

    Sampled motions of a few seconds do not find the way around an obstacle right ahead; the tangent
    of a visibility graph does. If boxes block both sides, the aim stays the goal, and the robot
    waits.
    """
    margin_m = footprint.half_size_m[1] + CLEARANCE_M + _PAST_M
    discs = ((each.x_m, each.y_m, each.radius_m + margin_m) for each in scene.people)
    c, s = math.cos(goal.bearing_rad), math.sin(goal.bearing_rad)
    for x, y, radius in sorted(discs, key=lambda disc: math.hypot(disc[0], disc[1]) - disc[2]):
        distance = math.hypot(x, y)
        if distance >= goal.distance_m or distance < 1e-9:
            continue
        # Inside a disc the direction out is perpendicular to its centre.
        half_angle = math.asin(min(1.0, radius / distance))
        to_left = math.remainder(math.atan2(y, x) - goal.bearing_rad, math.tau) + half_angle
        to_right = 2.0 * half_angle - to_left
        if to_left <= 0.0 or to_right <= 0.0:
            continue
        # The narrowest place is beside the person, perpendicular to the direction of the goal.
        left = goal.bearing_rad + to_left, (x - radius * s, y + radius * c)
        right = goal.bearing_rad - to_right, (x + radius * s, y - radius * c)
        for bearing_rad, place in (
            (left, right) if to_left < to_right - _KEEP_RIGHT_RAD else (right, left)
        ):
            pose = Poses(*(np.asarray(value) for value in (*place, c, s)))
            if scene.box_gap_m(footprint.at(pose)) >= CLEARANCE_M:
                return Aim(goal.distance_m, bearing_rad)
        return goal
    return goal
