"""People as discs, racks as boxes, a robot that drives exactly: what tests of planners share."""

from __future__ import annotations

import math

import numpy as np
import shapely
from hypothesis import strategies as st

from nav_adapter import NavConstraints, PersonObstacle, RobotProfile, RobotState

DT_S = 0.05
ROUNDING = 1e-9
HALF_LENGTH_M, HALF_WIDTH_M = 0.3625, 0.25
OUTLINE_M = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (HALF_LENGTH_M, HALF_WIDTH_M)
ROBOT = RobotProfile(OUTLINE_M, 1.5, 1.0, 1.0, 0.3)
AISLE = np.array([[-6.0, 1.5, 20.0, 2.5], [-6.0, -2.5, 20.0, -1.5]])

#: Centre (m), velocity (m/s) and radius (m) of a person.
Person = tuple[tuple[float, float], tuple[float, float], float]

coordinate = st.floats(-4.0, 4.0)
person_data = st.tuples(
    st.tuples(coordinate, coordinate),
    st.tuples(st.floats(-1.6, 1.6), st.floats(-1.6, 1.6)),
    st.floats(0.4, 1.2),
)


def constraints(
    people: list[Person], limit_mps: float = 1.5, fastest_mps: float | None = None
) -> NavConstraints:
    """Return discs of people and a speed limit, perhaps with one of the fastest point."""
    contour = shapely.box(0.0, 0.0, 1.0, 1.0)  # planners take the circle
    obstacles = tuple(
        PersonObstacle(i, center, velocity, radius, 1.75, 0.0, contour)
        for i, (center, velocity, radius) in enumerate(people)
    )
    limits = {} if fastest_mps is None else {"fastest_point_limit_mps": fastest_mps}
    return NavConstraints(0.0, obstacles, limit_mps, "test", False, **limits)


def at_rest(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> RobotState:
    """Return a robot that stands."""
    return RobotState(0.0, (x_m, y_m), heading_rad, 0.0, 0.0)


def outline(state: RobotState, corners_m: np.ndarray = OUTLINE_M) -> shapely.Polygon:
    """Return the hull of a robot's corners (N, 2) in odom."""
    c, s = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
    turned = corners_m @ np.array([[c, s], [-s, c]])
    return shapely.MultiPoint(turned + state.position_odom_m).convex_hull


def drive(state: RobotState, command: tuple[float, ...]) -> RobotState:
    """Return the state after a tick of a constant twist: forward, perhaps left, and yaw rate."""
    forward, left, yaw_rate = command if len(command) == 3 else (command[0], 0.0, command[1])
    turn = yaw_rate * DT_S
    middle = state.heading_odom_rad + 0.5 * turn
    c, s = math.cos(middle), math.sin(middle)
    step = DT_S * np.array([c * forward - s * left, s * forward + c * left])
    return RobotState(
        state.stamp_s + DT_S,
        state.position_odom_m + step,
        state.heading_odom_rad + turn,
        forward,
        yaw_rate,
        np.array([forward, left]) if len(command) == 3 else None,
    )
