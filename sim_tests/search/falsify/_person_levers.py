"""What may be changed about a person who reacts; persons as mappings, the YAML of PersonSpec."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray

from ._way import Lever, bent

#: Fast walking; who runs in the scenario may run as fast as there.
FASTEST_WALK_MPS: Final = 2.0
FASTEST_BACKWARDS_MPS: Final = 1.2
_SLOWEST_MPS: Final = 0.5
_EARLIER_S: Final = 4.0
_ASIDE_M: Final = 0.8
_LONGEST_PAUSE_S: Final = 3.0
# A pause or a time of looking that is longer than this is none, or is without end.
_SHORTEST_PAUSE_S: Final = 0.15
_LOOKS_ON_S: Final = 10.0
_REACTIONS: Final = ("walk_on", "wait", "hurry", "pass_behind", "claim")


def person_levers(person: Mapping[str, Any]) -> dict[str, Lever]:
    """The levers of a person: start, speed, way, a pause, gaze and reaction."""
    start_s, speed_mps = float(person["start_s"]), float(person["speed_mps"])
    walks = len(person["route"]) > 1
    levers = {
        "aside_first_m": Lever.of(-_ASIDE_M, _ASIDE_M, 0.0),
        "aside_last_m": Lever.of(-_ASIDE_M, _ASIDE_M, 0.0),
    }
    if walks:
        fastest = FASTEST_BACKWARDS_MPS if person["backwards"] else FASTEST_WALK_MPS
        levers |= {
            "start_s": Lever.of(max(start_s - _EARLIER_S, 0.0), start_s + _EARLIER_S, start_s),
            "speed_mps": Lever.of(_SLOWEST_MPS, fastest, speed_mps),
            "aside_middle_m": Lever.of(-_ASIDE_M, _ASIDE_M, 0.0),
            "pause_at": Lever.of(0.05, 0.95, 0.5),
            "pause_s": Lever.of(0.0, _LONGEST_PAUSE_S, 0.0),
        }
    glances = person["glances"]
    if glances["notices_within_m"] > 0.0:  # who never looks up does not begin to
        levers |= {
            "notices_within_m": Lever.of(1.0, 15.0, glances["notices_within_m"]),
            "first_glance_delay_s": Lever.of(0.0, 3.0, glances["first_glance_delay_s"]),
            "gives_up_after_s": Lever.of(
                0.3, _LOOKS_ON_S, min(glances["gives_up_after_s"] or _LOOKS_ON_S, _LOOKS_ON_S)
            ),
            "away_yaw_deg": Lever.of(-80.0, 80.0, glances["away_yaw_deg"]),
        }
        if not glances["watches"]:
            levers |= {
                "glance_median_s": Lever.of(0.3, 3.0, glances["glance_median_s"]),
                "away_median_s": Lever.of(0.3, 4.0, glances["away_median_s"]),
            }
        if 0.0 < glances["looker_share"] < 1.0:
            levers["looks"] = Lever.of(0.0, 1.0, 1.0)
        if len(_possible(person)) > 1:
            levers["reaction"] = Lever.of(0.0, 1.0, 1.0)
    return levers


def changed_person(person: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """The person with the levers at these values; those that are not given stay."""
    changed: dict[str, Any] = {**person, "glances": dict(person["glances"])}
    for name in ("start_s", "speed_mps"):
        if name in values:
            changed[name] = values[name]
    points = bent(
        way_of(person),
        values.get("aside_first_m", 0.0),
        values.get("aside_middle_m", 0.0),
        values.get("aside_last_m", 0.0),
    )
    changed["route"] = [{"x_m": x, "y_m": y} for x, y in points.tolist()]
    if values.get("pause_s", 0.0) > _SHORTEST_PAUSE_S:
        length_m = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        stop = {"at_m": values["pause_at"] * length_m, "for_s": values["pause_s"]}
        changed["pauses"] = sorted([*person["pauses"], stop], key=lambda pause: pause["at_m"])
    _look(changed["glances"], values)
    if "reaction" in values:
        possible = _possible(person)
        row = int(values["reaction"] * (len(possible) + 1))
        if row < len(possible):  # else as the seed draws
            changed["reactions"] = {**dict.fromkeys(_REACTIONS, 0.0), possible[row]: 1.0}
    return changed


def way_of(person: Mapping[str, Any]) -> FloatArray:
    """(N, 2) the corners of the route."""
    return np.array([[point["x_m"], point["y_m"]] for point in person["route"]], dtype=np.float64)


def _look(glances: dict[str, Any], values: Mapping[str, float]) -> None:
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
    if looks < 2.0 / 3.0:  # never, or surely; else as the seed draws
        glances["looker_share"] = 0.0 if looks < 1.0 / 3.0 else 1.0
    after_s = values.get("gives_up_after_s")
    if after_s is not None and after_s < _LOOKS_ON_S:
        glances["gives_up_after_s"] = after_s


def _possible(person: Mapping[str, Any]) -> list[str]:
    """Reactions that the scenario allows the person."""
    return [name for name in _REACTIONS if person["reactions"][name] > 0.0]
