"""Nav2's parameters for the robot of the crossings: ``parameters.yaml``, by controller and face."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import yaml

#: Local planners of the controller server.
CONTROLLERS: Final = ("RPP", "DWB", "MPPI")
#: What the stack reads: nothing of awarenav's; its limit; and its grid or its mask besides.
FACES: Final = ("today", "limit", "grid", "mask")
_FILE: Final = Path(__file__).with_suffix(".yaml")


def parameters(controller: str, face: str) -> dict[str, Any]:
    """Return the parameters of all servers, as of a parameter file.

    Args:
        controller: one of :data:`CONTROLLERS`.
        face: one of :data:`FACES`.
    """
    file = yaml.safe_load(_FILE.read_text(encoding="utf-8"))
    servers: dict[str, Any] = file["servers"]
    following, monitor, costmap = (
        each["ros__parameters"]
        for each in (
            servers["controller_server"],
            servers["collision_monitor"],
            servers["local_costmap"]["local_costmap"],
        )
    )
    following["FollowPath"] = file["controllers"][controller]
    if face == "grid":
        costmap["plugins"].insert(0, "people_layer")
    if face == "mask":
        costmap["filters"] = ["speed_filter"]
        following["speed_limit_topic"] = "lower_speed_limit"
    if face == "today":
        monitor["polygons"].remove("StopZone")
        monitor["observation_sources"].remove("people")
        del monitor["StopZone"], monitor["people"]
    return servers
