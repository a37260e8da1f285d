"""Parameters of a scripted worker; the script is a mapping, the YAML of ``WorkerScript``."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from scipy.interpolate import PchipInterpolator

from perception.arrays import FloatArray

from ._person_parameters import FASTEST_WALK_MPS
from ._variation import Parameter, bent_path

#: Largest acceleration of a worker, unless the script has a larger one.
LARGEST_ACCELERATION_MPS2: Final = 3.0
_ASIDE_M: Final = 0.8
_SHORTEST_PAUSE_S: Final = 0.15
# Least time between two activities of the hands.
_CHANGE_S: Final = 0.6
# Step at which speed and acceleration are sampled.
_SAMPLE_S: Final = 0.02


def script_parameters(script: Mapping[str, Any]) -> dict[str, Parameter]:
    """Return the parameters of a worker: start, pace, path, a pause and the time of the gaze."""
    parameters = {
        "aside_first_m": Parameter.of(-_ASIDE_M, _ASIDE_M, 0.0),
        "aside_last_m": Parameter.of(-_ASIDE_M, _ASIDE_M, 0.0),
    }
    if len(script["path"]) > 1:
        parameters |= {
            "later_s": Parameter.of(-4.0, 4.0, 0.0),
            "pace": Parameter.of(0.6, 1.6, 1.0),
            "aside_middle_m": Parameter.of(-_ASIDE_M, _ASIDE_M, 0.0),
            "pause_at": Parameter.of(0.05, 0.95, 0.5),
            "pause_s": Parameter.of(0.0, 3.0, 0.0),
        }
    if len(script["gaze"]) > 1:
        parameters["gaze_later_s"] = Parameter.of(-3.0, 3.0, 0.0)
    return parameters


def changed_script(script: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Return the script with the given values; parameters without a value stay."""
    path = [[key["t_s"], key["x_m"], key["y_m"]] for key in script["path"]]
    begin, end = path[0][0], path[-1][0]
    pause_s = values.get("pause_s", 0.0)
    pause_s = pause_s if pause_s > _SHORTEST_PAUSE_S and len(path) > 1 else 0.0
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
    points = bent_path(
        rows[:, 1:],
        values.get("aside_first_m", 0.0),
        values.get("aside_middle_m", 0.0),
        values.get("aside_last_m", 0.0),
    )
    keys = [[when(t_s), *point] for t_s, point in zip(rows[:, 0], points.tolist(), strict=True)]
    if pause_s > 0.0:
        row = int(np.argmin(np.abs(rows[:, 0] - halt_s)))
        keys.insert(row + 1, [keys[row][0] + pause_s, *keys[row][1:]])
    gaze_s = values.get("gaze_later_s", 0.0)
    return {
        **script,
        "path": [{"t_s": float(t), "x_m": float(x), "y_m": float(y)} for t, x, y in keys],
        "heading": _retimed(script["heading"], when),
        "gaze": _retimed(script["gaze"], lambda t_s: when(t_s) + gaze_s),
        "activities": _spaced(_retimed(script["activities"], when)),
    }


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
