"""The work of ``awarenav policy show``: a table and a drawing of policies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.settled import settled_human_speed_mps, settled_radius_m, settled_speed_limit_mps
from perception.arrays import finite_number

from ..errors import AwarenavError
from ..files import json_text

_FORMATS: Final = (".png", ".svg", ".pdf")
_AWARENESS: Final = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_DISTANCES_M: Final = (1.0, 2.0, 3.0, 5.0)
#: The robot of the tables in docs/policies.md. Distances are measured from its outline, so this
#: matters for rules.walking alone, which counts from the circle around it.
FOOTPRINT_M: Final = ((0.35, 0.25), (-0.35, 0.25), (-0.35, -0.25), (0.35, -0.25))


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowOptions:
    """The options of ``awarenav policy show``."""

    policies: tuple[str, ...]
    out: Path
    as_json: bool
    max_speed: float
    deceleration: float
    reaction_time: float
    farthest: float


def show_command(options: ShowOptions) -> int:
    """Run the command; return the exit status.

    Raises:
        AwarenavError: for options that cannot be used; nothing is written then.
        NavError: for a policy or a robot that cannot be used.
    """
    out = None if str(options.out) == "none" else options.out
    if out is not None and out.suffix.lower() not in _FORMATS:
        raise AwarenavError(f"--out must end in {', '.join(_FORMATS)} or be none, got {out}")
    farthest_m = finite_number(
        "--farthest (m)", options.farthest, AwarenavError, minimum=0.5, maximum=100.0
    )
    robot = _robot(options)
    policies = [(name, read_policy(name)) for name in options.policies]
    if out is not None:
        if out.is_dir():
            raise AwarenavError(f"--out must be a file, {out} is a folder")
        if out.resolve() in {Path(name).resolve() for name in options.policies}:
            raise AwarenavError(f"--out {out} would replace a policy")
        # Only the drawing needs matplotlib; without it, the command fails before any work.
        from ..figures import save_figure  # noqa: PLC0415
        from ._drawing import policy_figure  # noqa: PLC0415

        save_figure(policy_figure(policies, robot, farthest_m), out)
    if options.as_json:
        print(json_text({name: _table(policy, robot) for name, policy in policies}), end="")
        return 0
    for name, policy in policies:
        print("\n".join(table_lines(name, policy, robot)))
    if out is not None:
        print(f"Written to {out}")
    return 0


def read_policy(name: str) -> AwarenessPolicy:
    """Return the policy of a YAML file, or the preset if the name ends in neither .yaml nor .yml.

    Raises:
        NavError: for a file that cannot be used, or a name that is not a preset.
    """
    if Path(name).suffix.lower() in (".yaml", ".yml"):
        return AwarenessPolicy.from_yaml(name)
    return AwarenessPolicy.preset(name)


def _table(policy: AwarenessPolicy, robot: RobotProfile) -> dict[str, Any]:
    """Return the contents of the table as plain data."""
    awareness = np.array(_AWARENESS)
    limits = settled_speed_limit_mps(policy, robot, np.array(_DISTANCES_M), awareness[:, None])
    return {
        "awareness": list(_AWARENESS),
        "radius_m": settled_radius_m(policy, awareness).tolist(),
        "human_speed_mps": settled_human_speed_mps(policy, awareness).tolist(),
        "distance_m": list(_DISTANCES_M),
        "speed_limit_mps": limits.tolist(),
    }


def table_lines(name: str, policy: AwarenessPolicy, robot: RobotProfile) -> list[str]:
    """Return the table of radius, human speed and speed limits as lines of text."""
    awareness = np.array(_AWARENESS)
    radius = settled_radius_m(policy, awareness)
    human = settled_human_speed_mps(policy, awareness)
    limit = settled_speed_limit_mps(policy, robot, np.array(_DISTANCES_M), awareness[:, None])
    heads = [f"limit at {distance:g} m" for distance in _DISTANCES_M]
    lines = [name, "  ".join(["awareness", "radius", "human speed", *heads])]
    for row, alpha in enumerate(_AWARENESS):
        cells = [f"{alpha:9.1f}", f"{radius[row]:4.2f} m", f"{human[row]:7.2f} m/s"]
        cells += [f"{value:8.2f} m/s" for value in limit[row]]
        lines.append("  ".join(cells))
    return [*lines, ""]


def _robot(options: ShowOptions) -> RobotProfile:
    """Return a robot with the speeds, braking and reaction time of the options."""

    def number(option: str, value: float, least: float) -> float:
        return finite_number(
            option,
            value,
            AwarenavError,
            minimum=least,
            exclusive_minimum=option != "--reaction-time (s)",
        )

    deceleration_mps2 = number("--deceleration (m/s²)", options.deceleration, 0.0)
    return RobotProfile(
        footprint_m=np.array(FOOTPRINT_M),
        max_speed_mps=number("--max-speed (m/s)", options.max_speed, 0.0),
        max_acceleration_mps2=deceleration_mps2,
        max_deceleration_mps2=deceleration_mps2,
        reaction_time_s=number("--reaction-time (s)", options.reaction_time, 0.0),
    )
