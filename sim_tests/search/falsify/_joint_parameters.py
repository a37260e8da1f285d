"""Parameters that join people: an exchange of places, a companion, a parked pallet.

They work on the whole scenario; it is a mapping, the YAML of ``Scenario``. They make it hard to
tell who is who: one person hides another from camera and scanner, somebody who never looks comes
out where somebody who looked went behind a rack, or a pallet hides the person's legs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import shapely

from perception.arrays import FloatArray

from ._person_parameters import FASTEST_WALK_MPS, Parameter, bent_path, clearance_m, person_path

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
