"""Decides who is to be warned, and not too often."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from perception.anthropometry import BODY_RADIUS_M

from ._alert import Alert, AlertKind
from ._memory import Pair, PersonMemory
from ._robot import RobotProfile, RobotState
from .policies import AlertRules

# A robot that hardly moves is nothing to be warned of.
_STANDING_MPS: Final = 0.05
# Two people who do not move against each other have no closest approach.
_SAME_VELOCITY_MPS: Final = 1e-3
# Nearer to zero than this, whether they approach is a matter of rounding.
_CLOSING_M2PS: Final = 1e-9
_SOUNDS: Final[frozenset[AlertKind]] = frozenset(("horn", "voice"))


@dataclass(frozen=True, slots=True)
class AlertBook:
    """What has been asked for so far: enough to ask not too often.

    Attributes:
        given_s: stamp of the latest alert of each person and kind.
        sounded_s: stamp of the latest sound.
    """

    given_s: Mapping[tuple[int, AlertKind], float] = field(default_factory=dict)
    sounded_s: float = -math.inf


def alerts_due(
    rules: AlertRules,
    robot: RobotProfile,
    people: Mapping[int, PersonMemory],
    robot_state: RobotState,
    now: float,
    sigmas: float,
    book: AlertBook,
) -> tuple[tuple[Alert, ...], AlertBook]:
    """The alerts to ask for now, the most urgent first, and the book after them.

    Tentative tracks may be clutter and are not warned. Robot and people go on at their present
    velocities, the robot straight on; the robot counts as its circumscribed circle, and
    ``sigmas`` standard deviations of a person's position count as part of their body.
    """
    due = []
    if abs(robot_state.speed_mps) > _STANDING_MPS:
        # Straight on from where the robot was ``age_s`` ago.
        heading, age_s = robot_state.heading_odom_rad, now - robot_state.stamp_s
        speed_mps, place = robot_state.speed_mps, robot_state.position_odom_m.tolist()
        velocity = speed_mps * math.cos(heading), speed_mps * math.sin(heading)
        reach_m = robot.circumscribed_radius_m + BODY_RADIUS_M
        for track_id, memory in people.items():
            if memory.track.status == "tentative" or memory.awareness_lower >= rules.unaware_below:
                continue
            time_s, gap_m = _closest_approach(
                memory, place, velocity, age_s, reach_m + sigmas * memory.sigma_m
            )
            kind = _kind(rules, time_s) if gap_m <= rules.miss_within_m else None
            if kind is not None:
                reason = (
                    f"track {track_id}: unaware (lower bound {memory.awareness_lower:.2f}), "
                    f"closest approach of {gap_m:.1f} m in {time_s:.1f} s"
                )
                due.append(Alert(track_id, kind, time_s, gap_m, reason))
    due.sort(key=lambda alert: (alert.time_to_closest_s, alert.track_id))
    kept_s = max(rules.repeat_after_s, rules.quiet_s)
    given = {key: stamp for key, stamp in book.given_s.items() if now - stamp < kept_s}
    sounded_s, asked = book.sounded_s, []
    for alert in due:
        key = (alert.track_id, alert.kind)
        if now - given.get(key, -math.inf) < rules.repeat_after_s:
            continue
        if alert.kind in _SOUNDS:
            if now - sounded_s < rules.quiet_s:
                continue
            sounded_s = now
        given[key] = now
        asked.append(alert)
    return tuple(asked), AlertBook(given, sounded_s)


def _kind(rules: AlertRules, time_s: float) -> AlertKind | None:
    """The loudest alert whose time is reached."""
    if time_s < rules.horn_within_s:
        return "horn"
    if time_s < rules.voice_within_s:
        return "voice"
    return "light" if time_s < rules.light_within_s else None


def _closest_approach(
    memory: PersonMemory, place: Pair, velocity: Pair, age_s: float, reach_m: float
) -> tuple[float, float]:
    """Time (s) and gap (m) of the closest approach; an infinite time when they move apart.

    The robot was at ``place`` ``age_s`` ago.
    """
    (x, y), (vx, vy) = memory.here_odom_m, memory.velocity_odom_mps
    x, y = x - place[0] - age_s * velocity[0], y - place[1] - age_s * velocity[1]
    vx, vy = vx - velocity[0], vy - velocity[1]
    speed2 = vx * vx + vy * vy
    closing = -(x * vx + y * vy)
    if speed2 < _SAME_VELOCITY_MPS**2 or closing <= _CLOSING_M2PS:
        return math.inf, max(math.hypot(x, y) - reach_m, 0.0)
    time_s = closing / speed2
    return time_s, max(math.hypot(x + time_s * vx, y + time_s * vy) - reach_m, 0.0)
