"""People of a population in place of scripted workers, who cannot start or look by chance."""

from __future__ import annotations

import itertools
import math
from typing import Any, Final

from ..actors.behaviour import PersonSpec, WorkerScript

# A worker whose script looks at the robot sees it from this far.
_SEES_WITHIN_M: Final = 25.0


def person_of_script(script: WorkerScript, name: str) -> PersonSpec:
    """Return a person with the task of a scripted worker: route, pauses, speed and start.

    Somebody whose script looks at the robot watches it; anybody else never looks at it. Headings
    on the way are left out.
    """
    points, pauses, moving_s, length_m = [script.path[0]], [], 0.0, 0.0
    start_s = script.path[0].t_s
    for before, after in itertools.pairwise(script.path):
        step_m = math.dist((before.x_m, before.y_m), (after.x_m, after.y_m))
        if step_m > 0.0:
            if length_m == 0.0:
                start_s = before.t_s  # after a wait at the first point
            points.append(after)
            moving_s += after.t_s - before.t_s
            length_m += step_m
        elif length_m > 0.0:
            pauses.append({"at_m": length_m, "for_s": after.t_s - before.t_s})
    watches = any(key.look == "robot" for key in script.gaze)
    data: dict[str, Any] = {
        "name": name,
        "stature_m": script.stature_m,
        "look": script.look,
        "route": [{"x_m": point.x_m, "y_m": point.y_m} for point in points],
        "start_s": max(start_s, 0.0),
        "pauses": pauses,
        "activity": script.activities[0].activity if script.activities else "none",
        "hearing": script.hearing,
        "glances": {"notices_within_m": _SEES_WITHIN_M if watches else 0.0, "watches": watches},
    }
    if moving_s > 0.0:
        data["speed_mps"] = length_m / moving_s
    elif script.heading:
        data["heading_deg"] = script.heading[0].heading_deg
    return PersonSpec.model_validate(data)
