"""Episodes in the formats of others: SocNav3's JSON trajectory, and NavWareSet's CSV track.

Both are written; tracks are read, too.

SocNav3: Bachiller-Burgos et al., Towards Data-Driven Metrics for Social Robot Navigation
Benchmarking (arXiv:2509.01251), and ``schema.json`` of the repository SocNav3-simdata-generator.
NavWareSet: the columns of the repository ``anr-navware/NavWareSet-Quant``.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.errors import MissingExtraError, not_one_of
from awarenav.files import write_text
from perception.arrays import FloatArray

from ...world.errors import SimError, needs
from ._episode import SocialEpisode, wrapped

#: The ends of the files of each format.
FORMATS: Final = {"socnav3": ".json", "navwareset": ".csv"}
# Cells of SocNav3's occupancy grid, and the free space about the path of a grid without walls.
_CELL_M: Final = 0.1
_MARGIN_M: Final = 2.0
# Fields of an episode for which the layout has no place.
_OUTCOME: Final = (
    *("success", "time_to_goal_s", "reference_time_s", "reference_length_m", "human_delay_s"),
    *("robot_radius_m", "person_radius_m"),
)
# The text of NavWareSet takes 0.4 m for both bodies together.
_NAVWARE_RADIUS_M: Final = 0.2
# A slower body of a track keeps its heading.
_MOVES_MPS: Final = 0.05


def format_of(path: Path) -> str:
    """Return the name of the format that a file has by the end of its name."""
    for name, suffix in FORMATS.items():
        if path.suffix.lower() == suffix:
            return name
    ends = ", ".join(f"{suffix} ({name})" for name, suffix in FORMATS.items())
    raise SimError(f"an episode is a file that ends in {ends}, got {path}")


def write_episode(path: Path, episode: SocialEpisode, format: str = "") -> None:
    """Write an episode; without a format in that of the file's end.

    Raises:
        SimError: an unknown format, the file cannot be written, or the goal of the robot is not
            known, which SocNav3 needs.
    """
    name = format or format_of(path)
    if name not in FORMATS:
        raise SimError(not_one_of("format", name, FORMATS))
    text = _socnav3_text if name == "socnav3" else _navwareset_text
    write_text(path, text(episode), SimError)


def _socnav3_text(episode: SocialEpisode) -> str:
    """Return the JSON of a trajectory: grid, walls, and a frame for each instant.

    The robot's speeds are along its own axes, forward and left. The people's velocities are an
    addition to the layout, and so is ``awarenav`` with the outcome; other readers ignore them.
    """
    if episode.goal_m is None:
        raise SimError("a SocNav3 trajectory needs the robot's goal, which this episode has not")
    towards = episode.goal_m - episode.robot_m[0]
    length, width = episode.robot_size_m
    goal = {
        **{"type": "go-to", "human": None, "x": episode.goal_m[0], "y": episode.goal_m[1]},
        "angle": math.atan2(towards[1], towards[0]),
        **{"pos_threshold": episode.goal_tolerance_m, "angle_threshold": math.pi},
    }
    frames = []
    for row, t_s in enumerate(episode.t_s.tolist()):
        people = [
            {
                "id": person,
                **dict(zip("xy", episode.people_m[row, person].tolist(), strict=True)),
                "angle": float(episode.people_heading_rad[row, person]),
                "speed_x": float(episode.people_mps[row, person, 0]),
                "speed_y": float(episode.people_mps[row, person, 1]),
            }
            for person in np.flatnonzero(episode.present[row]).tolist()
        ]
        robot = {
            **dict(zip("xy", episode.robot_m[row].tolist(), strict=True)),
            "angle": float(episode.robot_heading_rad[row]),
            "speed_x": float(episode.robot_base_mps[row, 0]),
            "speed_y": float(episode.robot_base_mps[row, 1]),
            "speed_a": float(episode.yaw_rate_radps[row]),
            "shape": {"type": "rectangle", "width": width, "length": length},
        }
        frames.append(
            {"timestamp": t_s, "robot": robot, "goal": goal, "people": people, "objects": []}
        )
    document = {
        "metadata": episode.name,
        "grid": _grid(episode),
        "walls": episode.walls_m.tolist(),
        "awarenav": {name: getattr(episode, name) for name in _OUTCOME},
        "sequence": frames,
    }
    return json.dumps(document, ensure_ascii=False) + "\n"


def _grid(episode: SocialEpisode) -> dict[str, Any]:
    """Return the occupancy grid: 1 in boxes, 0 elsewhere; the first row has the largest y."""
    extent = np.concatenate([episode.walls_m.reshape(-1, 2), episode.robot_m])
    low, high = extent.min(axis=0), extent.max(axis=0)
    if not len(episode.walls_m):
        low, high = low - _MARGIN_M, high + _MARGIN_M
    columns, rows = np.maximum(np.ceil((high - low) / _CELL_M - 1e-9), 1).astype(int).tolist()
    x = low[0] + _CELL_M * (np.arange(columns) + 0.5)
    y = low[1] + _CELL_M * (np.arange(rows) + 0.5)
    data = np.zeros((rows, columns), dtype=int)
    for x0, y0, x1, y1 in episode.boxes_m.tolist():
        data[np.ix_((y >= y0) & (y <= y1), (x >= x0) & (x <= x1))] = 1
    return {
        **{"width": columns, "height": rows, "cell_size": _CELL_M},
        **{"x_orig": float(low[0]), "y_orig": float(low[1]), "angle_orig": 0.0},
        "data": data[::-1].tolist(),
    }


def _navwareset_text(episode: SocialEpisode) -> str:
    """Return a track with a row for each person and time, in nanoseconds from its start.

    Without people it has a row for each time, and no columns of people.
    """
    lines = ["timestamp,x,y,column,robot_x,robot_y,robot_yaw_rad"]
    if not episode.people:
        lines = ["timestamp,robot_x,robot_y,robot_yaw_rad"]
    for row, t_s in enumerate(episode.t_s.tolist()):
        stamp_ns = round(t_s * 1e9)
        robot = [*episode.robot_m[row].tolist(), float(episode.robot_heading_rad[row])]
        people = [
            [*episode.people_m[row, person].tolist(), int(person) + 1]
            for person in np.flatnonzero(episode.present[row])
        ]
        for one in people if episode.people else [[]]:
            lines.append(",".join(map(repr, [stamp_ns, *one, *robot])))
    return "\n".join(lines) + "\n"


def import_pandas(what: str) -> Any:
    """Return pandas; raise MissingExtraError, which names what needs it, if it is missing."""
    with needs(what, "pandas", MissingExtraError):
        import pandas as pd  # noqa: PLC0415 - an optional dependency
    return pd


def read_track(path: Path) -> SocialEpisode:
    """Return the episode of a NavWareSet track, with rows of people or of x1, y1, x2, y2, ….

    Velocities come from the positions, and the headings of people from their motion; so does that
    of a robot without ``robot_yaw_rad``. Goal and success are not known.

    Raises:
        SimError: the file cannot be read, or does not have these columns.
        MissingExtraError: pandas is not installed.
    """
    pd = import_pandas("reading tracks of NavWareSet")
    try:
        table = pd.read_csv(path, skipinitialspace=True)
        needed = ["timestamp", "robot_x", "robot_y", *(("x", "y") if "column" in table else ())]
        if missing := [name for name in needed if name not in table]:
            raise ValueError(f"the column {missing[0]} is missing")
        if table.empty or table[needed].isna().any(axis=None):
            raise ValueError(f"every row must hold {', '.join(needed)}, and there must be rows")
        rows = table.groupby("timestamp")
        robot = rows[[*("robot_x", "robot_y"), *({"robot_yaw_rad"} & set(table))]].first()
        if "column" in table:
            people = table.pivot(index="timestamp", columns="column", values=["x", "y"])
            people_m = np.stack([people["x"], people["y"]], axis=-1)
        else:
            numbers = sorted(int(name[1:]) for name in table if name[1:].isdecimal())
            people_m = np.stack(
                [rows[[f"{axis}{n}" for n in dict.fromkeys(numbers)]].first() for axis in "xy"],
                axis=-1,
            )
        t_s = 1e-9 * (robot.index.to_numpy() - robot.index[0]).astype(np.float64)
        robot_m = robot.to_numpy(np.float64)
        people_m = people_m.astype(np.float64)
    except OSError as cause:
        raise SimError(f"cannot read {path}: {cause.strerror or cause}") from cause
    except (ValueError, TypeError) as cause:
        raise SimError(f"{path} is not a NavWareSet track: {str(cause).strip()}") from cause
    robot_mps, people_mps = _velocities(t_s, robot_m[:, :2]), _velocities(t_s, people_m)
    heading = robot_m[:, 2] if robot_m.shape[1] == 3 else _headings(robot_mps)
    rates = wrapped(np.diff(heading)) / np.diff(t_s)
    return SocialEpisode(
        t_s=t_s,
        robot_m=robot_m[:, :2],
        robot_heading_rad=heading,
        robot_mps=robot_mps,
        yaw_rate_radps=np.concatenate([rates[:1], rates]) if len(rates) else np.zeros(1),
        people_m=people_m,
        people_heading_rad=np.where(np.isnan(people_m[..., 0]), np.nan, _headings(people_mps)),
        people_mps=people_mps,
        robot_size_m=(2.0 * _NAVWARE_RADIUS_M, 2.0 * _NAVWARE_RADIUS_M),
        robot_radius_m=_NAVWARE_RADIUS_M,
        person_radius_m=_NAVWARE_RADIUS_M,
        name=path.stem,
    )


def _velocities(t_s: FloatArray, positions_m: FloatArray) -> FloatArray:
    """Return velocities of the shape of ``positions_m``, by differences to the instant before.

    The first instant after an absence takes the velocity of the next. Absent instants keep NaN, and
    a single instant has velocity 0.
    """
    pd = import_pandas("a track")
    course = pd.DataFrame(positions_m.reshape(len(t_s), -1))
    steps_s = np.diff(t_s, prepend=np.nan)
    found = course.diff().div(steps_s, axis=0).bfill().fillna(0.0).where(course.notna())
    return np.asarray(found).reshape(positions_m.shape)


def _headings(velocities_mps: FloatArray) -> FloatArray:
    """Return the (N, ...) directions of (N, ..., 2) motions, radians.

    A slow body keeps its heading; one that has not moved yet faces along its first motion, or along
    x.
    """
    pd = import_pandas("a track")
    headings = np.arctan2(velocities_mps[..., 1], velocities_mps[..., 0])
    moves = np.hypot(velocities_mps[..., 0], velocities_mps[..., 1]) > _MOVES_MPS
    known = pd.DataFrame(np.where(moves, headings, np.nan).reshape(len(headings), -1))
    return np.asarray(known.ffill().bfill().fillna(0.0)).reshape(headings.shape)
