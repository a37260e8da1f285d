"""The work of ``awarenav policy show``: a table and a drawing of policies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.ros2 import RobotFile
from perception.arrays import finite_number

from ..errors import AwarenavError
from ..files import json_text
from ._effect import BESIDE_M, effect_of

_FORMATS: Final = (".png", ".svg", ".pdf")
_AWARENESS: Final = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_DISTANCES_M: Final = (1.0, 2.0, 3.0, 5.0)
#: The robot of the tables in docs/policies.md.
ROBOT: Final = RobotProfile(
    footprint_m=np.array(((0.35, 0.25), (-0.35, 0.25), (-0.35, -0.25), (0.35, -0.25))),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
    drive="differential",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowOptions:
    """The options of ``awarenav policy show``."""

    policies: tuple[str, ...]
    out: Path
    as_json: bool
    robot: Path | None
    max_speed: float | None
    deceleration: float | None
    reaction_time: float | None
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
    effect = effect_of(policy, robot, np.array(_AWARENESS), np.array(_DISTANCES_M))
    return {
        "awareness": list(_AWARENESS),
        "radius_m": effect.radius_m.tolist(),
        "human_speed_mps": effect.human_speed_mps.tolist(),
        "distance_m": list(_DISTANCES_M),
        "limit_ahead_mps": effect.ahead_mps.tolist(),
        "beside_m": BESIDE_M,
        "limit_beside_mps": effect.beside_mps.tolist(),
    }


def table_lines(name: str, policy: AwarenessPolicy, robot: RobotProfile) -> list[str]:
    """Return the table of radius, U and speed limits as lines of text."""
    table = _table(policy, robot)
    distances = "  ".join(f"{distance:3g} m" for distance in _DISTANCES_M)
    width = len(distances)
    lines = [
        name,
        f"{'':27}  {'limit (m/s), ahead at':{width}}  {BESIDE_M:g} m beside, at",
        f"awareness  radius         U  {distances}  {distances}",
    ]
    for row, alpha in enumerate(_AWARENESS):
        cells = [f"{alpha:9.1f}", f"{table['radius_m'][row]:4.2f} m"]
        cells.append(f"{table['human_speed_mps'][row]:4.2f} m/s")
        limits = table["limit_ahead_mps"][row] + table["limit_beside_mps"][row]
        lines.append("  ".join(cells + [f"{limit:5.2f}" for limit in limits]))
    return [*lines, ""]


def _robot(options: ShowOptions) -> RobotProfile:
    """Return the robot of the file, or that of the page, with the numbers of the options."""
    robot = ROBOT if options.robot is None else RobotFile.from_yaml(options.robot).profile()
    given = {
        "max_speed_mps": ("--max-speed (m/s)", options.max_speed),
        "max_deceleration_mps2": ("--deceleration (m/s²)", options.deceleration),
        "reaction_time_s": ("--reaction-time (s)", options.reaction_time),
    }
    numbers: dict[str, Any] = {
        name: finite_number(
            option,
            value,
            AwarenavError,
            minimum=0.0,
            exclusive_minimum=name != "reaction_time_s",
        )
        for name, (option, value) in given.items()
        if value is not None
    }
    return replace(robot, **numbers)
