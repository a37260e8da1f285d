"""Updates of the adapter that never fail: whatever goes wrong, the robot gets a stop."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from tracking import PersonTrack

from .._adapter import NavAdapter
from .._constraints import NavConstraints
from .._errors import NavError
from .._robot import RobotState

_LOG = logging.getLogger("nav_adapter")


def guarded_update(
    adapter: NavAdapter,
    tracks: tuple[PersonTrack, ...],
    robot_state: RobotState,
    now_s: float,
    perception_stamp_s: float,
    warn: Callable[[str], bool],
) -> NavConstraints:
    """Return the adapter's constraints, or a stop with the reason if it refuses or fails.

    Args:
        adapter: is updated.
        tracks: the latest.
        robot_state: the latest.
        now_s: the present time.
        perception_stamp_s: time from which perception is.
        warn: called with the problem; returns whether it is a new one.
    """
    try:
        return adapter.update(tracks, robot_state, now_s, perception_stamp_s=perception_stamp_s)
    except NavError as problem:
        warn(str(problem))
        reason = f"refused: {problem}"
    except Exception as problem:
        # Publishing must go on, whatever is wrong with these data.
        reason = f"the adapter failed: {type(problem).__name__}: {problem}"
        if warn(reason):
            _LOG.error("the adapter failed", exc_info=problem)
    try:
        # A stop that keeps the people of the last good data, grown older.
        older = adapter.watchdog(now_s)
    except Exception:
        return stopped(now_s, reason)
    return replace(
        older,
        speed_limit_mps=0.0,
        reachable_speed_limit_mps=0.0,
        limited_by=reason,
        stale=True,
    )


def explained(constraints: NavConstraints, blind: str) -> NavConstraints:
    """Return constraints whose reason says which scanners are blind, where data are stale."""
    if not blind or not constraints.stale:
        return constraints
    return replace(constraints, limited_by=f"{constraints.limited_by}; {blind}")


def stopped(now_s: float, reason: str) -> NavConstraints:
    """Return constraints without people that stop the robot."""
    return NavConstraints(now_s, (), 0.0, reason, True)
