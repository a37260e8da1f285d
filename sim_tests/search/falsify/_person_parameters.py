"""Parameters of a person, a mapping as the YAML of ``PersonSpec``, and limits of variations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import shapely

from perception.arrays import FloatArray

from ...actors.body import STAYING
from .._study import Range

#: Smallest distance of a person's centre line from racks and walls in a variation.
RACK_CLEARANCE_M: Final = 0.35
#: Smallest distance of a person's start from that of the robot in a variation.
ROBOT_CLEARANCE_M: Final = 1.5
#: Speeds of people who walk; a person who is faster in the scenario keeps that speed as the limit.
SLOWEST_MPS: Final = 0.5
FASTEST_WALK_MPS: Final = 2.0
# A shorter pause is none.
_SHORTEST_PAUSE_S: Final = 0.15
# A way on which a person sets off is none if it is shorter.
_SHORTEST_WAY_M: Final = 0.3
# A person walks no faster backwards.
_FASTEST_BACKWARDS_MPS: Final = 1.2
_EARLIER_S: Final = 4.0
# A person with this value or more never forgets the robot.
_NEVER_LAPSES_S: Final = 6.0
# A person with this value or more never gives up looking.
_LOOKS_ON_S: Final = 10.0
# The time from a request to the answer.
_ANSWERS_AFTER_S: Final = (0.2, 3.0)
_REACTIONS: Final = ("walk_on", "wait", "hurry", "pass_behind", "claim")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a variation.

    Attributes:
        range: range of its values, within human limits.
        neutral: its value in the scenario as written.
    """

    range: Range
    neutral: float

    @classmethod
    def of(cls, low: float, high: float, neutral: float) -> Parameter:
        """Return a parameter from ``low`` to ``high``, widened to include ``neutral``."""
        return cls(Range(low=min(low, neutral), high=max(high, neutral)), neutral)


# Shifts of both ends of a path to its left.
_ENDS: Final = {
    "aside_first_m": Parameter.of(-0.8, 0.8, 0.0),
    "aside_last_m": Parameter.of(-0.8, 0.8, 0.0),
}
# The shift halfway, and a pause on the way.
_ON_THE_WAY: Final = {
    "aside_middle_m": Parameter.of(-0.8, 0.8, 0.0),
    "pause_at": Parameter.of(0.05, 0.95, 0.5),
    "pause_s": Parameter.of(0.0, 3.0, 0.0),
}
#: Where somebody goes who sets off after standing.
SETS_OFF: Final = {
    "sets_off_x_m": Parameter.of(-3.0, 3.0, 0.0),
    "sets_off_y_m": Parameter.of(-3.0, 3.0, 0.0),
}


def person_parameters(
    person: Mapping[str, Any], fastest_mps: float = FASTEST_WALK_MPS
) -> dict[str, Parameter]:
    """Return the parameters of a person: start, speed, route, a pause, gaze, reaction, lapse.

    Args:
        person: the person in the scenario as written.
        fastest_mps: highest speed of somebody who walks ahead.
    """
    start_s, speed_mps = float(person["start_s"]), float(person["speed_mps"])
    walks = len(person["route"]) > 1
    parameters = dict(_ENDS)
    if walks:
        fastest = _FASTEST_BACKWARDS_MPS if person["backwards"] else fastest_mps
        # Of somebody who sets off near the robot, that distance is varied: a distribution.
        if person.get("sets_off_within_m") is None:
            earliest_s = max(start_s - _EARLIER_S, 0.0)
            parameters["start_s"] = Parameter.of(earliest_s, start_s + _EARLIER_S, start_s)
        parameters["speed_mps"] = Parameter.of(SLOWEST_MPS, fastest, speed_mps)
        parameters |= _ON_THE_WAY
    glances = person["glances"]
    # Somebody who never looks up, or looks as planned, keeps to that.
    if glances["notices_within_m"] > 0.0 and not person["gaze"]:
        parameters |= {
            "notices_within_m": Parameter.of(1.0, 15.0, glances["notices_within_m"]),
            "first_glance_delay_s": Parameter.of(0.0, 3.0, glances["first_glance_delay_s"]),
            "gives_up_after_s": Parameter.of(
                0.3, _LOOKS_ON_S, min(glances["gives_up_after_s"] or _LOOKS_ON_S, _LOOKS_ON_S)
            ),
            "away_yaw_deg": Parameter.of(-80.0, 80.0, glances["away_yaw_deg"]),
        }
        if person["activity"] not in STAYING:  # they look, but never move
            parameters |= _lapse_parameters(person)
        if not glances["watches"]:
            parameters |= {
                "glance_median_s": Parameter.of(0.3, 3.0, glances["glance_median_s"]),
                "away_median_s": Parameter.of(0.3, 4.0, glances["away_median_s"]),
            }
        if 0.0 < glances["looker_share"] < 1.0:
            parameters["looks"] = Parameter.of(0.0, 1.0, 1.0)
        if len(_possible_reactions(person)) > 1:
            parameters["reaction"] = Parameter.of(0.0, 1.0, 1.0)
    return parameters


def changed_person(person: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Return the person with the given values; parameters without a value stay."""
    changed: dict[str, Any] = {**person, "glances": dict(person["glances"])}
    for name in ("start_s", "speed_mps"):
        if name in values:
            changed[name] = values[name]
    points = _shifted_path(person_path(person), values)
    changed["route"] = [{"x_m": x, "y_m": y} for x, y in points.tolist()]
    if values.get("pause_s", 0.0) > _SHORTEST_PAUSE_S:
        length_m = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        stop = {"at_m": values["pause_at"] * length_m, "for_s": values["pause_s"]}
        changed["pauses"] = sorted([*person["pauses"], stop], key=lambda pause: pause["at_m"])
    _change_glances(changed["glances"], values)
    _add_lapse(changed, values)
    if "reaction" in values:
        possible = _possible_reactions(person)
        row = int(values["reaction"] * (len(possible) + 1))
        if row < len(possible):  # else the seed draws the reaction
            changed["reactions"] = {**dict.fromkeys(_REACTIONS, 0.0), possible[row]: 1.0}
    return changed


def person_path(person: Mapping[str, Any]) -> FloatArray:
    """Return the (N, 2) corners of the route."""
    return np.array([[point["x_m"], point["y_m"]] for point in person["route"]], dtype=np.float64)


def hearing_parameters(hearing: Mapping[str, Any]) -> dict[str, Parameter]:
    """Return the parameters of a person's hearing, the YAML of ``Hearing``.

    They are whether and when the person answers a robot that asks for attention, and a step into
    its path.
    """
    return {
        "answers": Parameter.of(0.0, 1.0, 0.5),
        "answer_delay_s": Parameter.of(*_ANSWERS_AFTER_S, float(hearing["delay_median_s"])),
        "startles_into_path": Parameter.of(0.0, 1.0, 0.0),
    }


def changed_hearing(
    own: Mapping[str, Any] | None, scenarios: Mapping[str, Any], values: Mapping[str, float]
) -> dict[str, Any] | None:
    """Return how a person hears with the given values: a change of their own or the scenario's.

    As written, which is None for the scenario's, where nothing changes.
    """
    hearing = scenarios if own is None else own
    changes: dict[str, float] = {}
    if not 1.0 / 3.0 <= values["answers"] <= 2.0 / 3.0:  # never or always; else the seed draws
        changes["answers"] = float(values["answers"] > 0.5)
    if values["answer_delay_s"] != hearing["delay_median_s"]:
        changes |= {"delay_median_s": values["answer_delay_s"], "delay_spread": 1.0}
    if values["startles_into_path"] >= 0.5:
        changes |= {"startles": 1.0, "startles_into_path": 1.0}
    if not changes:
        return None if own is None else dict(own)
    return {**hearing, **changes}


def _lapse_parameters(person: Mapping[str, Any]) -> dict[str, Parameter]:
    """Return the parameters of somebody who forgets the robot after a look, or sets off then.

    A person who stands in the scenario sets off in any direction.
    """
    parameters = {
        "lapse_after_s": Parameter.of(0.0, _NEVER_LAPSES_S, _NEVER_LAPSES_S),
        "lapse_looks_away": Parameter.of(0.0, 1.0, 0.0),
        "lapse_halts": Parameter.of(0.0, 1.0, 0.0),
    }
    if len(person["route"]) == 1:
        own_mps = person["speed_mps"]
        parameters |= SETS_OFF
        parameters["sets_off_mps"] = Parameter.of(SLOWEST_MPS, FASTEST_WALK_MPS, own_mps)
    return parameters


def _add_lapse(person: dict[str, Any], values: Mapping[str, float]) -> None:
    after_s = values.get("lapse_after_s", _NEVER_LAPSES_S)
    if after_s >= _NEVER_LAPSES_S:
        return
    way = np.array([values.get("sets_off_x_m", 0.0), values.get("sets_off_y_m", 0.0)])
    sets_off = bool(np.hypot(*way) >= _SHORTEST_WAY_M)
    if sets_off:
        x, y = (person_path(person)[0] + way).tolist()
        person["route"] = [*person["route"], {"x_m": x, "y_m": y}]
        person["speed_mps"] = values["sets_off_mps"]
    person["lapse"] = {
        "after_look_s": after_s,
        "looks_away": values["lapse_looks_away"] >= 0.5,
        "halts": sets_off or values["lapse_halts"] >= 0.5,
    }


def _change_glances(glances: dict[str, Any], values: Mapping[str, float]) -> None:
    for name in ("notices_within_m", "first_glance_delay_s", "away_yaw_deg"):
        if name in values:
            glances[name] = values[name]
    for name in ("glance", "away"):
        median = values.get(f"{name}_median_s")
        if median is not None:
            ratio = median / glances[f"{name}_median_s"]
            low, high = glances[f"{name}_quartiles_s"]
            glances[f"{name}_median_s"] = median
            glances[f"{name}_quartiles_s"] = [ratio * low, ratio * high]
    looks = values.get("looks", 1.0)
    if looks < 2.0 / 3.0:  # never or always; else the seed draws
        glances["looker_share"] = 0.0 if looks < 1.0 / 3.0 else 1.0
    after_s = values.get("gives_up_after_s")
    if after_s is not None and after_s < _LOOKS_ON_S:
        glances["gives_up_after_s"] = after_s


def _possible_reactions(person: Mapping[str, Any]) -> list[str]:
    """Return the reactions that the scenario allows the person."""
    return [name for name in _REACTIONS if person["reactions"][name] > 0.0]


def _shifted_path(points_m: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return a path bent by the values of :data:`_ENDS` and :data:`_ON_THE_WAY`."""
    shifts = (values.get(f"aside_{place}_m", 0.0) for place in ("first", "middle", "last"))
    return bent_path(points_m, *shifts)


def bent_path(points_m: FloatArray, first_m: float, middle_m: float, last_m: float) -> FloatArray:
    """Return a path (N, 2) shifted to its left, linearly interpolated between three shifts.

    A path of two points gets a third one halfway. A path of one point is moved by ``first_m`` in x
    and ``last_m`` in y.
    """
    if len(points_m) == 1:
        return np.asarray(points_m + np.array([first_m, last_m]))
    if len(points_m) == 2 and middle_m != 0.0:
        points_m = np.array([points_m[0], points_m.mean(axis=0), points_m[1]])
    pieces = np.diff(points_m, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    share = along / max(along[-1], 1e-9)
    units = pieces / np.maximum(lengths, 1e-9)[:, None]
    ahead = np.concatenate([units[:1], units[:-1] + units[1:], units[-1:]])
    norm = np.linalg.norm(ahead, axis=1)
    # A corner where the path turns back on itself has no left side and stays.
    ahead = ahead / np.maximum(norm, 1e-9)[:, None] * (norm > 0.1)[:, None]
    shift = np.interp(share, [0.0, 0.5, 1.0], [first_m, middle_m, last_m])
    return np.asarray(points_m + shift[:, None] * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1))


def clearance_m(points_m: FloatArray, boxes_odom_m: FloatArray) -> float:
    """Return the smallest distance of a path from boxes (N, 4) x_min, y_min, x_max, y_max."""
    line = shapely.Point(points_m[0]) if len(points_m) == 1 else shapely.LineString(points_m)
    boxes = shapely.box(*np.asarray(boxes_odom_m, dtype=np.float64).T)
    return float(np.min(shapely.distance(line, boxes), initial=np.inf))
