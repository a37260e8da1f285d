"""Choice of the people to warn, with a limit on how often."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

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
# Shortest time until the same person gets the same alert again, and between a sound and another
# that is no louder.
_REPEAT_AFTER_S: Final = 3.0
_QUIET_S: Final = 1.0
_LOUDNESS: Final[dict[AlertKind, int]] = {"voice": 1, "horn": 2}


class Sound(NamedTuple):
    """The latest warning that sounded: its stamp, and how loud it was."""

    stamp_s: float = -math.inf
    loudness: int = 0

    def holds_back(self, kind: AlertKind, now: float) -> bool:
        """Return whether an alert of this kind has to wait, so that people can tell the two."""
        return now - self.stamp_s < _QUIET_S and 0 < _LOUDNESS.get(kind, 0) <= self.loudness


def alerts_due(
    rules: AlertRules,
    robot: RobotProfile,
    people: dict[int, Person],
    robot_state: RobotState,
    now: float,
    sigmas: float,
    sound: Sound,
    prediction: PredictionModel | None = None,
) -> tuple[list[Alert], Sound]:
    """Return the alerts to give now, the most urgent first, and the latest sound with them.

    Tentative tracks may be clutter and are not warned. Robot and people are predicted with their
    present velocities, the robot straight ahead. The robot counts as its circumscribed circle, and
    a body is enlarged by ``sigmas`` standard deviations of its position: the present one, or with a
    ``prediction`` the one at the closest approach, at most 2 s ahead. Of ``people``, those who are
    warned are replaced.
    """
    candidates = _candidates(rules, robot, people.values(), robot_state, now, sigmas, prediction)
    candidates.sort(key=lambda alert: (alert.time_to_closest_s, alert.track_id))
    alerts = []
    for alert in candidates:
        person = people[alert.track_id]
        warned_s = dict(person.warned_s)
        repeats = now - warned_s.get(alert.kind, -math.inf) < _REPEAT_AFTER_S
        if repeats or sound.holds_back(alert.kind, now):
            continue
        if alert.kind in _LOUDNESS:
            sound = Sound(now, _LOUDNESS[alert.kind])
        warned_s[alert.kind] = now
        people[person.id] = person._replace(warned_s=tuple(warned_s.items()))
        alerts.append(alert)
    return alerts, sound


def _candidates(
    rules: AlertRules,
    robot: RobotProfile,
    people: Iterable[Person],
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
    for memory in people:
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
                f"track {memory.id}: unaware (lower bound {memory.awareness_lower:.2f}), "
                f"closest approach of {gap_m:.1f} m in {time_s:.1f} s"
            )
            candidates.append(Alert(memory.id, kind, time_s, gap_m, reason))
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
