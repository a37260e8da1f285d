"""Choice of the people to warn, with a limit on how often."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from tracking.prediction import PredictionModel

from ._people import Person, Vector2
from ._predicted import predicted_sigmas_m
from ._robot import RobotProfile, RobotState
from .alerts import Alert, AlertKind
from .limit import STANDING_MPS
from .policies import AlertRules

# Below this relative speed there is no closest approach.
_SAME_VELOCITY_MPS: Final = 1e-3
# Below this value of −(r · v), whether they approach is a matter of rounding.
_CLOSING_M2PS: Final = 1e-9
# The prediction is known to hold so far ahead.
_PREDICTED_S: Final = 2.0
# The lower bound of α below which a person is warned.
_UNAWARE_BELOW: Final = 0.3
# Shortest time until the same person gets the same alert again, and between two sounds.
_REPEAT_AFTER_S: Final = 3.0
_QUIET_S: Final = 1.0
_SOUNDS: Final[frozenset[AlertKind]] = frozenset(("horn", "voice"))


@dataclass(frozen=True, slots=True)
class AlertHistory:
    """The stamps of the latest alerts.

    Attributes:
        alert_stamps_s: stamp of the latest alert of each person and kind.
        sound_stamp_s: stamp of the latest sound.
    """

    alert_stamps_s: Mapping[tuple[int, AlertKind], float] = field(default_factory=dict)
    sound_stamp_s: float = -math.inf


def alerts_due(
    rules: AlertRules,
    robot: RobotProfile,
    people: Mapping[int, Person],
    robot_state: RobotState,
    now: float,
    sigmas: float,
    history: AlertHistory,
    prediction: PredictionModel | None = None,
) -> tuple[tuple[Alert, ...], AlertHistory]:
    """Return the alerts to give now, the most urgent first, and the history with them.

    Tentative tracks may be clutter and are not warned. Robot and people are predicted with their
    present velocities, the robot straight ahead. The robot counts as its circumscribed circle, and
    a body is enlarged by ``sigmas`` standard deviations of its position: the present one, or with a
    ``prediction`` the one at the closest approach, at most 2 s ahead.
    """
    candidates = _candidates(rules, robot, people, robot_state, now, sigmas, prediction)
    candidates.sort(key=lambda alert: (alert.time_to_closest_s, alert.track_id))
    latest = {
        key: stamp for key, stamp in history.alert_stamps_s.items() if now - stamp < _REPEAT_AFTER_S
    }
    sound_stamp_s, alerts = history.sound_stamp_s, []
    for alert in candidates:
        key = (alert.track_id, alert.kind)
        if now - latest.get(key, -math.inf) < _REPEAT_AFTER_S:
            continue
        if alert.kind in _SOUNDS:
            if now - sound_stamp_s < _QUIET_S:
                continue
            sound_stamp_s = now
        latest[key] = now
        alerts.append(alert)
    return tuple(alerts), AlertHistory(latest, sound_stamp_s)


def is_quiet(history: AlertHistory, now: float) -> bool:
    """Return whether no warning has sounded in the last second."""
    return now - history.sound_stamp_s >= _QUIET_S


def _candidates(
    rules: AlertRules,
    robot: RobotProfile,
    people: Mapping[int, Person],
    robot_state: RobotState,
    now: float,
    sigmas: float,
    prediction: PredictionModel | None,
) -> list[Alert]:
    """Return the alert for each person to warn, without the limit on how often."""
    if robot_state.travel_mps <= STANDING_MPS:
        return []
    # The robot's state is ``age_s`` old; it has driven straight on since.
    age_s, position = now - robot_state.stamp_s, robot_state.position_odom_m.tolist()
    velocity = robot_state.velocity_odom_mps
    reach_m = robot.circumscribed_radius_m + BODY_RADIUS_M
    candidates = []
    for track_id, memory in people.items():
        if memory.track.status == "tentative" or memory.awareness_lower >= _UNAWARE_BELOW:
            continue
        time_s, gap_m = closest_approach(
            memory, position, velocity, age_s, reach_m + sigmas * memory.sigma_m
        )
        if prediction is not None and math.isfinite(time_s):
            horizon_s = np.array([max(now - memory.track.stamp_s, 0.0) + min(time_s, _PREDICTED_S)])
            sigma_m = float(predicted_sigmas_m(memory.track, horizon_s, prediction)[0])
            gap_m = max(gap_m - sigmas * max(0.0, sigma_m - memory.sigma_m), 0.0)
        kind = _kind(rules, time_s) if gap_m <= rules.miss_within_m else None
        if kind is not None:
            reason = (
                f"track {track_id}: unaware (lower bound {memory.awareness_lower:.2f}), "
                f"closest approach of {gap_m:.1f} m in {time_s:.1f} s"
            )
            candidates.append(Alert(track_id, kind, time_s, gap_m, reason))
    return candidates


def _kind(rules: AlertRules, time_s: float) -> AlertKind | None:
    """Return the loudest alert whose time is reached."""
    if time_s < rules.horn_within_s:
        return "horn"
    if time_s < rules.voice_within_s:
        return "voice"
    return "light" if time_s < rules.light_within_s else None


def closest_approach(
    memory: Person, robot_m: Vector2, robot_mps: Vector2, age_s: float, reach_m: float
) -> tuple[float, float]:
    """Return time (s) and gap (m) of the closest approach; the time is infinite if they move apart.

    The robot was at ``robot_m`` ``age_s`` ago.
    """
    (x, y), (vx, vy) = memory.position_odom_m, memory.velocity_odom_mps
    x, y = x - robot_m[0] - age_s * robot_mps[0], y - robot_m[1] - age_s * robot_mps[1]
    vx, vy = vx - robot_mps[0], vy - robot_mps[1]
    speed2 = vx * vx + vy * vy
    closing = -(x * vx + y * vy)
    if speed2 < _SAME_VELOCITY_MPS**2 or closing <= _CLOSING_M2PS:
        return math.inf, max(math.hypot(x, y) - reach_m, 0.0)
    time_s = closing / speed2
    return time_s, max(math.hypot(x + time_s * vx, y + time_s * vy) - reach_m, 0.0)
