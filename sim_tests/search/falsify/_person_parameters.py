"""Parameters of a person; the person is a mapping, the YAML of ``PersonSpec``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray

from ...actors.body import STAYING
from ._variation import (
    ENDS,
    FASTEST_WALK_MPS,
    ON_THE_WAY,
    SETS_OFF,
    SHORTEST_PAUSE_S,
    SHORTEST_WAY_M,
    SLOWEST_MPS,
    Parameter,
    shifted_path,
)

#: A person walks no faster backwards.
FASTEST_BACKWARDS_MPS: Final = 1.2
_EARLIER_S: Final = 4.0
# A person with this value or more never forgets the robot.
_NEVER_LAPSES_S: Final = 6.0
# A person with this value or more never gives up looking.
_LOOKS_ON_S: Final = 10.0
# The time from a request to the answer.
_ANSWERS_AFTER_S: Final = (0.2, 3.0)
_REACTIONS: Final = ("walk_on", "wait", "hurry", "pass_behind", "claim")


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
    parameters = dict(ENDS)
    if walks:
        fastest = FASTEST_BACKWARDS_MPS if person["backwards"] else fastest_mps
        # Of somebody who sets off near the robot, that distance is varied: a distribution.
        if person.get("sets_off_within_m") is None:
            earliest_s = max(start_s - _EARLIER_S, 0.0)
            parameters["start_s"] = Parameter.of(earliest_s, start_s + _EARLIER_S, start_s)
        parameters["speed_mps"] = Parameter.of(SLOWEST_MPS, fastest, speed_mps)
        parameters |= ON_THE_WAY
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
    points = shifted_path(person_path(person), values)
    changed["route"] = [{"x_m": x, "y_m": y} for x, y in points.tolist()]
    if values.get("pause_s", 0.0) > SHORTEST_PAUSE_S:
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
    sets_off = bool(np.hypot(*way) >= SHORTEST_WAY_M)
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
