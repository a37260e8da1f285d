"""Parameters of a variation: of a person, and those that join people."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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
#: Name of the person who is added.
COMPANION: Final = "companion"
#: Smallest distance of a parked pallet from every route, and from the robot's straight way.
PALLET_CLEARANCE_M: Final = 0.9
PALLET_LANE_CLEARANCE_M: Final = 1.5
#: Half the diagonal of a pallet.
PALLET_RADIUS_M: Final = 0.73
#: People begin at least this far apart.
APART_M: Final = 0.5
# Below the first value there is no companion; up to the second the companion walks alongside, up
# to the third with a box, and above they go on where the person stops.
_KINDS: Final = (0.4, 0.6, 0.7)
_ON: Final = 0.5
_PALLET: Final = "pallet_wrapped"


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
    """Return the parameters of a person: start, speed, route, a pause, gaze, reaction, lapse."""
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


def joint_parameters(people: Sequence[Mapping[str, Any]]) -> dict[str, Parameter]:
    """Return the parameters for the varied people who react; empty if the first one stands."""
    parameters: dict[str, Parameter] = {}
    if not people or not _walks(people[0]):
        return parameters
    parameters |= {
        "companion.kind": Parameter.of(0.0, 1.0, 0.0),
        "companion.aside_m": Parameter.of(-1.2, 1.2, 0.7),
        "companion.ahead_m": Parameter.of(-1.5, 1.5, 0.0),
        "companion.pace": Parameter.of(0.7, 1.3, 1.0),
        "companion.from": Parameter.of(0.1, 0.9, 0.5),
        "pallet.is_there": Parameter.of(0.0, 1.0, 0.0),
        "pallet.along": Parameter.of(0.05, 0.95, 0.5),
        "pallet.aside_m": Parameter.of(-2.5, 2.5, 1.5),
    }
    if len(people) > 1 and _walks(people[1]):
        parameters |= {
            "exchange.happens": Parameter.of(0.0, 1.0, 0.0),
            "exchange.at": Parameter.of(0.1, 0.9, 0.5),
        }
    return parameters


def add_joint(data: dict[str, Any], values: Mapping[str, float]) -> None:
    """Change the people and the hall of a scenario; without a value nothing changes."""
    people: list[dict[str, Any]] = data["people"]
    if values.get("exchange.happens", 0.0) > _ON:
        _exchange(people[0], people[1], values["exchange.at"])
    if values.get("companion.kind", 0.0) > _KINDS[0]:
        people.append(_companion(people[0], values))
    if values.get("pallet.is_there", 0.0) > _ON:
        path = person_path(people[0])
        here = point_at(path, values["pallet.along"])
        ahead = point_at(path, min(values["pallet.along"] + 0.01, 1.0)) - here
        left = np.array([-ahead[1], ahead[0]]) / max(float(np.hypot(*ahead)), 1e-9)
        x, y = (here + values["pallet.aside_m"] * left).tolist()
        yaw_deg = math.degrees(math.atan2(ahead[1], ahead[0]))
        # Props stand along the axes.
        prop = {"kind": _PALLET, "x_m": x, "y_m": y, "yaw_deg": 90.0 * round(yaw_deg / 90.0)}
        data["layout"]["props"] = [*data["layout"]["props"], prop]


def is_joint_possible(
    data: Mapping[str, Any],
    values: Mapping[str, float],
    boxes_odom_m: FloatArray,
    robot_longer_m: float = 0.0,
) -> bool:
    """Return whether people begin apart, and a parked pallet blocks no way.

    Args:
        data: the changed scenario.
        values: as for :func:`add_joint`.
        boxes_odom_m: (N, 4) racks, walls and props of the scenario as written.
        robot_longer_m: how much farther the robot reaches than the Nova Carter.
    """
    paths = [person_path(person) for person in data["people"]]
    if values.get("companion.kind", 0.0) > _KINDS[0]:
        starts = [path[0] for path in paths]
        if min(float(np.hypot(*(each - starts[-1]))) for each in starts[:-1]) < APART_M:
            return False
    if values.get("pallet.is_there", 0.0) <= _ON:
        return True
    prop = data["layout"]["props"][-1]
    place = shapely.Point(prop["x_m"], prop["y_m"])
    if clearance_m(np.array([[prop["x_m"], prop["y_m"]]]), boxes_odom_m) < PALLET_RADIUS_M:
        return False
    task = data["robot"]
    way = [[task["start_x_m"], task["start_y_m"]], [task["goal_x_m"], task["goal_y_m"]]]
    ways = [(np.array(way), PALLET_LANE_CLEARANCE_M + robot_longer_m)]
    ways += [(path, PALLET_CLEARANCE_M) for path in paths]
    return all(place.distance(_line(path)) >= clearance for path, clearance in ways)


def point_at(path_m: FloatArray, share: float) -> FloatArray:
    """Return the point (2,) after a share of the length of a path (N, 2)."""
    return np.array(_line(path_m).interpolate(share, normalized=True).coords[0])


def _walks(person: Mapping[str, Any]) -> bool:
    return len(person["route"]) > 1


def _line(path_m: FloatArray) -> Any:
    return shapely.Point(path_m[0]) if len(path_m) == 1 else shapely.LineString(path_m)


def _parts(path_m: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """Return a path up to a share of its length, and from there."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path_m, axis=0).T))])
    at_m, point = share * lengths[-1], point_at(path_m, share)
    first, second = path_m[lengths < at_m - 1e-6], path_m[lengths > at_m + 1e-6]
    return np.vstack([first, point]), np.vstack([point, second])


def _route(path_m: FloatArray) -> list[dict[str, float]]:
    return [{"x_m": x, "y_m": y} for x, y in path_m.tolist()]


def _exchange(first: dict[str, Any], second: dict[str, Any], share: float) -> None:
    """Each of two people goes on along the way of the other."""
    (begin, end), (other_begin, other_end) = (
        _parts(person_path(person), share) for person in (first, second)
    )
    first["route"] = _route(np.vstack([begin, other_end]))
    second["route"] = _route(np.vstack([other_begin, end]))


def _companion(person: dict[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Return somebody who never looks; where they go on from the person, the person stops there."""
    kind, path = values["companion.kind"], person_path(person)
    later_s = -values["companion.ahead_m"] / person["speed_mps"]
    aside_m = values["companion.aside_m"]
    if kind > _KINDS[2]:
        first, rest = _parts(path, values["companion.from"])
        person["route"] = _route(first)
        length_m = float(np.hypot(*np.diff(first, axis=0).T).sum())
        later_s += length_m / person["speed_mps"]
        path = bent_path(rest, aside_m, 0.5 * aside_m, 0.0)
    else:
        path = bent_path(path, aside_m, aside_m, aside_m)
    return {
        "name": COMPANION,
        "route": _route(path),
        "speed_mps": min(values["companion.pace"] * person["speed_mps"], FASTEST_WALK_MPS),
        "start_s": max(person["start_s"] + later_s, 0.0),
        "activity": "carry_box" if _KINDS[1] < kind <= _KINDS[2] else "none",
        "glances": {"notices_within_m": 0.0},
        "as_written": person["as_written"],
    }
