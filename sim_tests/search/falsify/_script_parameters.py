"""Parameters of a scripted worker; the script is a mapping, the YAML of ``WorkerScript``."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from scipy.interpolate import PchipInterpolator

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

#: Largest acceleration of a worker, unless the script has a larger one.
LARGEST_ACCELERATION_MPS2: Final = 3.0
# Least time between two activities of the hands.
_CHANGE_S: Final = 0.6
# A worker with this value or more stays where the script ends.
_STAYS_S: Final = 6.0
_WALK_MPS: Final = 1.34
# A worker with this value or more looks where the script says.
_LOOKS_ON_S: Final = 15.0
# Time in which head or body turns.
_TURN_S: Final = 0.4
# Two keys are at least this far apart.
_KEY_S: Final = 0.1
# Step at which speed and acceleration are sampled.
_SAMPLE_S: Final = 0.02


def script_parameters(script: Mapping[str, Any]) -> dict[str, Parameter]:
    """Return the parameters of a worker.

    They are start, pace, path, a pause, setting off again after the end of the script, the time of
    the gaze and, where the script looks at the robot, looking away for good.
    """
    parameters = dict(ENDS)
    if len(script["path"]) > 1:
        parameters["later_s"] = Parameter.of(-4.0, 4.0, 0.0)
        parameters["pace"] = Parameter.of(0.6, 1.6, 1.0)
        parameters |= ON_THE_WAY
    if len(script["gaze"]) > 1:
        parameters["gaze_later_s"] = Parameter.of(-3.0, 3.0, 0.0)
    if not any(key["activity"] in STAYING for key in script["activities"]):
        parameters["sets_off_after_s"] = Parameter.of(0.0, _STAYS_S, _STAYS_S)
        parameters |= SETS_OFF
        parameters["sets_off_mps"] = Parameter.of(SLOWEST_MPS, FASTEST_WALK_MPS, _WALK_MPS)
    if any(key["look"] == "robot" for key in script["gaze"]):
        parameters |= {
            "looks_away_after_s": Parameter.of(0.0, _LOOKS_ON_S, _LOOKS_ON_S),
            "away_yaw_deg": Parameter.of(-80.0, 80.0, 0.0),
        }
    return parameters


def changed_script(script: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Return the script with the given values; parameters without a value stay."""
    path = [[key["t_s"], key["x_m"], key["y_m"]] for key in script["path"]]
    begin, end = path[0][0], path[-1][0]
    pause_s = values.get("pause_s", 0.0)
    pause_s = pause_s if pause_s > SHORTEST_PAUSE_S and len(path) > 1 else 0.0
    halt_s = begin + values.get("pause_at", 0.5) * (end - begin)
    pace, later_s = values.get("pace", 1.0), values.get("later_s", 0.0)

    def when(t_s: float) -> float:
        return float(later_s + begin + (t_s - begin) / pace + (pause_s if t_s > halt_s else 0.0))

    rows = np.array(path, dtype=np.float64)
    if pause_s > 0.0:
        here = PchipInterpolator(rows[:, 0], rows[:, 1:])(halt_s)
        rows = np.array([*rows[rows[:, 0] <= halt_s], [halt_s, *here], *rows[rows[:, 0] > halt_s]])
        rows = rows[np.concatenate([[True], np.diff(rows[:, 0]) > 1e-6])]
    elif len(rows) == 2 and values.get("aside_middle_m", 0.0) != 0.0:
        rows = np.array([rows[0], rows.mean(axis=0), rows[1]])
    points = shifted_path(rows[:, 1:], values)
    keys = [[when(t_s), *point] for t_s, point in zip(rows[:, 0], points.tolist(), strict=True)]
    if pause_s > 0.0:
        row = int(np.argmin(np.abs(rows[:, 0] - halt_s)))
        keys.insert(row + 1, [keys[row][0] + pause_s, *keys[row][1:]])
    gaze_s = values.get("gaze_later_s", 0.0)
    changed = {
        **script,
        "path": [{"t_s": float(t), "x_m": float(x), "y_m": float(y)} for t, x, y in keys],
        "heading": _retimed(script["heading"], when),
        "gaze": _retimed(script["gaze"], lambda t_s: when(t_s) + gaze_s),
        "activities": _spaced(_retimed(script["activities"], when)),
    }
    _set_off(changed, values)
    _look_away(changed, values)
    return changed


def _set_off(script: dict[str, Any], values: Mapping[str, float]) -> None:
    """Let the worker walk on some time after the end of the path."""
    after_s = values.get("sets_off_after_s", _STAYS_S)
    way = values.get("sets_off_x_m", 0.0), values.get("sets_off_y_m", 0.0)
    length_m = math.hypot(*way)
    if after_s >= _STAYS_S or length_m < SHORTEST_WAY_M:
        return
    here = script["path"][-1]
    begin_s = here["t_s"] + max(after_s, _KEY_S)
    # A cubic from rest to rest: its largest speed is 1.5 times the mean, its largest acceleration
    # 6 times way over time squared.
    lasts_s = max(
        1.5 * length_m / values["sets_off_mps"],
        math.sqrt(6.0 * length_m / LARGEST_ACCELERATION_MPS2) + _SAMPLE_S,
    )
    there = {"x_m": here["x_m"] + way[0], "y_m": here["y_m"] + way[1]}
    script["path"] = [
        *script["path"],
        {**here, "t_s": begin_s},
        {**there, "t_s": begin_s + lasts_s},
        {**there, "t_s": begin_s + lasts_s + _KEY_S},
    ]
    keys = [key for key in script["heading"] if key["t_s"] <= begin_s - _KEY_S]
    if keys:  # else the body faces along the walk
        now = keys[-1]["heading_deg"]
        turn = math.remainder(math.degrees(math.atan2(way[1], way[0])) - now, 360.0)
        keys.append({"t_s": begin_s, "heading_deg": now})
        keys.append({"t_s": begin_s + _TURN_S, "heading_deg": now + turn})
        script["heading"] = keys


def _look_away(script: dict[str, Any], values: Mapping[str, float]) -> None:
    """Let the worker look elsewhere for good from some time after the start of the path."""
    after_s = values.get("looks_away_after_s", _LOOKS_ON_S)
    if after_s >= _LOOKS_ON_S:
        return
    at_s = script["path"][0]["t_s"] + after_s
    kept = [key for key in script["gaze"] if key["t_s"] <= at_s - _KEY_S]
    if kept:
        kept.append({**kept[-1], "t_s": at_s})
    away = {"t_s": at_s + _TURN_S, "look": "ahead", "yaw_deg": values["away_yaw_deg"]}
    script["gaze"] = [*kept, away]


def peak_speed_and_acceleration(script: Mapping[str, Any]) -> tuple[float, float]:
    """Return the highest speed (m/s) and acceleration (m/s²) of the scripted walk."""
    rows = np.array([[key["t_s"], key["x_m"], key["y_m"]] for key in script["path"]])
    if len(rows) < 2:
        return 0.0, 0.0
    times = np.arange(rows[0, 0], rows[-1, 0], _SAMPLE_S)
    velocity = PchipInterpolator(rows[:, 0], rows[:, 1:]).derivative()(times)
    rates = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / _SAMPLE_S
    fastest = np.max(np.linalg.norm(velocity, axis=1), initial=0.0)
    return float(fastest), float(np.max(rates, initial=0.0))


def is_human(script: Mapping[str, Any], original: Mapping[str, Any]) -> bool:
    """Return whether a walk keeps to human limits, or to higher ones of the original."""
    speed, rate = peak_speed_and_acceleration(script)
    most_speed, most_rate = peak_speed_and_acceleration(original)
    return speed <= max(most_speed, FASTEST_WALK_MPS) + 1e-6 and (
        rate <= max(most_rate, LARGEST_ACCELERATION_MPS2) + 1e-6
    )


def script_path(script: Mapping[str, Any]) -> FloatArray:
    """Return the (N, 2) waypoints."""
    return np.array([[key["x_m"], key["y_m"]] for key in script["path"]], dtype=np.float64)


def _retimed(keys: Any, when: Callable[[float], float]) -> list[dict[str, Any]]:
    return [{**key, "t_s": float(when(key["t_s"]))} for key in keys]


def _spaced(keys: list[dict[str, Any]]) -> list[dict[str, Any]]:
    for before, key in itertools.pairwise(keys):
        key["t_s"] = max(key["t_s"], before["t_s"] + _CHANGE_S)
    return keys
