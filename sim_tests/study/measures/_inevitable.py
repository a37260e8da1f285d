"""The speed from which a robot could have stopped before a contact that anybody saw come.

A bound from geometry and braking alone. It knows neither policy nor perception.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ...world.floor_plan import crosses_boxes
from ._conflict import Outline
from ._step_out import STEP_OUT

if TYPE_CHECKING:
    from ...crossing import ContactEvent, CrossingResult

# Somebody who keeps their velocity and then passes the robot at this gap at most is on the way to
# the contact.
_NEAR_M: Final = 0.1
# A change of velocity is over where it is slower than this, averaged over the window; one that
# ended longer than this before was another.
_CHANGES_MPS2: Final = 0.3
_WINDOW_S: Final = 0.2
_TAIL_S: Final = 1.0


def stoppable_mps(log: CrossingResult, contact: ContactEvent) -> float:
    """Return the highest speed from which a robot could have stood before a contact, ≥ 0.

    The robot has from when the motion that led to the contact could first be seen: the person had
    begun it, and a straight line from the robot's outline to their body crossed no rack, wall or
    prop on the floor plan. It takes 0.2 s until a start is seen, then its reaction time, and then
    brakes.

    The motion begins with the last change of the person's velocity without which they would not
    have come to where the robot is at the contact. Who never changed it was on the way from the
    beginning. Motion that varies all the time begins early, which blames the robot.
    """
    t_s, outline = log.t_s, Outline(log.robot.footprint_m)
    end = max(int(np.searchsorted(t_s, contact.t_s, "right")) - 1, 0)
    row = _begun(log, outline, end, contact)
    while row < end and not _in_sight(log, row, contact.worker):
        row += 1
    braking_s = contact.t_s - float(t_s[row]) - STEP_OUT.noticed_after_s
    braking_s -= log.robot.reaction_time_s
    return max(braking_s, 0.0) * log.robot.max_deceleration_mps2


def _begun(log: CrossingResult, outline: Outline, end: int, contact: ContactEvent) -> int:
    """Return the instant at which a person began the motion that led to a contact after ``end``."""
    rows, person = np.arange(end + 1), contact.worker
    # Between two instants of the log both may come nearer by more than what counts as near.
    robot = [np.interp(contact.t_s, log.t_s, each) for each in log.robot_odom_m.T]
    at_s = min(contact.t_s, float(log.t_s[-1]))
    place, velocity = log.people_odom_m[rows, person], log.people_odom_mps[rows, person]
    left_s = at_s - log.t_s[rows]
    relative = place + velocity * left_s[:, None] - np.array(robot)
    cos, sin = np.cos(log.heading_odom_rad[end]), np.sin(log.heading_odom_rad[end])
    met = outline.distance(np.nan_to_num(relative @ np.array([[cos, -sin], [sin, cos]]), nan=1e6))
    elsewhere = np.flatnonzero(met[:end] > BODY_RADIUS_M + _NEAR_M)
    if not len(elsewhere):
        return 0
    row = int(elsewhere[-1])
    changes = _changes(log.t_s[rows], velocity)
    recent = np.flatnonzero(changes[: row + 1] & (log.t_s[row] - log.t_s[: row + 1] <= _TAIL_S))
    if len(recent):
        steady = np.flatnonzero(~changes[: recent[-1]])
        from_s = log.t_s[steady[-1]] + _WINDOW_S if len(steady) else 0.0
        row = min(row, int(np.searchsorted(log.t_s, from_s - 1e-9)))
    return row


def _changes(t_s: FloatArray, velocity_mps: FloatArray) -> NDArray[np.bool_]:
    """Return (N,) whether a velocity changes until a window later."""
    later = np.minimum(np.searchsorted(t_s, t_s + _WINDOW_S - 1e-9), len(t_s) - 1)
    change_mps = np.hypot(*(velocity_mps[later] - velocity_mps).T)
    return np.asarray(change_mps > _CHANGES_MPS2 * np.maximum(t_s[later] - t_s, 1e-9))


def _in_sight(log: CrossingResult, row: int, person: int) -> bool:
    """Return whether a sensor anywhere on the robot could see some of a person's body."""
    place = log.people_odom_m[row, person]
    if not np.isfinite(place).all():
        return False
    cos, sin = np.cos(log.heading_odom_rad[row]), np.sin(log.heading_odom_rad[row])
    corners = log.robot.footprint_m @ np.array([[cos, sin], [-sin, cos]])
    across = place - log.robot_odom_m[row]
    across = np.array([-across[1], across[0]]) / max(float(np.hypot(*across)), 1e-9)
    body = place + BODY_RADIUS_M * across * np.array([[-1.0], [0.0], [1.0]])
    boxes = log.obstacle_boxes_odom_m
    return not all(
        crosses_boxes(boxes, log.robot_odom_m[row] + corner, body).all() for corner in corners
    )
