"""The work of ``awarenav policy show``: a table and a drawing of policies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.ros2 import RobotFile

from ..errors import AwarenavError
from ..files import check_plot, json_text
from ._effect import BESIDE_M, effect_of

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


def show_command(
    names: Sequence[str],
    out: Path | None,
    robot_file: Path | None,
    *,
    overwrite: bool,
    as_json: bool,
) -> int:
    """Run the command; return the exit status.

    Args:
        names: presets and YAML files of policies.
        out: the drawing; None for none.
        robot_file: the robot; None for that of docs/policies.md.
        overwrite: replaces an existing drawing.
        as_json: prints the tables as JSON.

    Raises:
        AwarenavError: for options that cannot be used; nothing is written then.
        NavError: for a policy or a robot that cannot be used.
    """
    check_plot(out, map(Path, names))
    if out is not None and out.exists() and not overwrite:
        raise AwarenavError(f"{out} exists already: --overwrite replaces it")
    robot = ROBOT if robot_file is None else RobotFile.from_yaml(robot_file).profile()
    policies = [(name, AwarenessPolicy.named(name)) for name in names]
    if out is not None:
        from ..figures import save_figure  # noqa: PLC0415 - slow
        from ._drawing import policy_figure  # noqa: PLC0415

        save_figure(policy_figure(policies, robot), out)
    if as_json:
        print(json_text({name: _table(policy, robot) for name, policy in policies}), end="")
        return 0
    for name, policy in policies:
        print("\n".join(table_lines(name, policy, robot)))
    if out is not None:
        print(f"Written to {out}")
    return 0


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
    distances = " ".join(f"{distance:3g} m" for distance in _DISTANCES_M)
    width = len(distances)
    lines = [
        name,
        f"{'':27}  {'limit (m/s), ahead at':{width}}  {BESIDE_M:g} m beside, at",
        f"awareness  radius         U  {distances}  {distances}",
    ]
    for row, alpha in enumerate(_AWARENESS):
        cells = [f"{alpha:9.1f}", f"{table['radius_m'][row]:4.2f} m"]
        cells.append(f"{table['human_speed_mps'][row]:4.2f} m/s")
        limits = (table["limit_ahead_mps"][row], table["limit_beside_mps"][row])
        cells += [" ".join(f"{limit:5.2f}" for limit in each) for each in limits]
        lines.append("  ".join(cells))
    return [*lines, ""]
