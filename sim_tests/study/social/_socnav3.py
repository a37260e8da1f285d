"""Episodes as SocNav3 trajectories: one JSON object with grid, walls, and a frame per instant.

Layout: Bachiller-Burgos et al., Towards Data-Driven Metrics for Social Robot Navigation
Benchmarking (arXiv:2509.01251), and ``schema.json`` of the repository SocNav3-simdata-generator.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.files import write_text
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from perception.documents import read_json

from ...world.errors import SimError
from ._episode import Outcome, SocialEpisode, velocities
from ._schema import TRAJECTORY_SCHEMA, problems

# Cells of the occupancy grid; racks and walls are drawn into it.
_CELL_M: Final = 0.1
# Side and free space about the path of a grid without walls.
_MARGIN_M: Final = 2.0
_ANY_ANGLE_RAD: Final = math.pi


def header_of(episode: SocialEpisode) -> dict[str, Any]:
    """Return what a trajectory holds beside its frames: metadata, grid, walls, outcome.

    ``awarenav`` holds what the published layout has no place for; other readers ignore it.
    """
    outcome = {each.name: getattr(episode.outcome, each.name) for each in fields(Outcome)}
    return {
        "metadata": episode.name,
        "grid": _grid(episode),
        "walls": episode.walls_m.tolist(),
        "awarenav": {
            **outcome,
            "robot_radius_m": episode.robot_radius_m,
            "person_radius_m": episode.person_radius_m,
        },
    }


def frames_of(episode: SocialEpisode) -> Iterator[dict[str, Any]]:
    """Yield the frames of a trajectory.

    The robot's speeds are those along its own axes, forward and left. The people's velocities along
    the fixed axes are an addition to the published layout.

    Raises:
        SimError: the goal of the robot is not known, which the layout needs.
    """
    if episode.goal_m is None:
        raise SimError("a SocNav3 trajectory needs the robot's goal, which this episode has not")
    goal_x, goal_y = episode.goal_m.tolist()
    first_x, first_y = episode.robot_m[0].tolist()
    goal = {
        "type": "go-to",
        "human": None,
        "x": goal_x,
        "y": goal_y,
        "angle": math.atan2(goal_y - first_y, goal_x - first_x),
        "pos_threshold": episode.goal_tolerance_m,
        "angle_threshold": _ANY_ANGLE_RAD,
    }
    length, width = episode.robot_size_m
    shape = {"type": "rectangle", "width": width, "length": length}
    speeds = episode.robot_base_mps.tolist()
    for row, t_s in enumerate(episode.t_s.tolist()):
        x, y = episode.robot_m[row].tolist()
        there = np.flatnonzero(episode.present[row]).tolist()
        yield {
            "timestamp": t_s,
            "robot": {
                "x": x,
                "y": y,
                "angle": float(episode.robot_heading_rad[row]),
                "speed_x": speeds[row][0],
                "speed_y": speeds[row][1],
                "speed_a": float(episode.yaw_rate_radps[row]),
                "shape": shape,
            },
            "goal": goal,
            "people": [_person(episode, row, person) for person in there],
            "objects": [],
        }


def write_socnav3(path: Path, episode: SocialEpisode) -> None:
    """Write an episode as a SocNav3 trajectory.

    Raises:
        SimError: the file cannot be written, or the goal of the robot is not known.
    """
    document = {**header_of(episode), "sequence": list(frames_of(episode))}
    write_text(path, json.dumps(document, ensure_ascii=False) + "\n", SimError)


def check_socnav3(path: Path) -> list[str]:
    """Return what is wrong with a SocNav3 file, one sentence for each field; empty if nothing is.

    Raises:
        SimError: the file cannot be read, or is not JSON.
    """
    return trajectory_problems(read_json(path, SimError))


def read_socnav3(path: Path) -> SocialEpisode:
    """Return the episode of a SocNav3 file.

    Raises:
        SimError: the file cannot be read or does not follow the layout.
    """
    document = read_json(path, SimError)
    found = trajectory_problems(document)
    if found:
        raise SimError(f"{path} is not a SocNav3 trajectory: {found[0]}")
    return episode_from(document, document["sequence"], path.stem)


def trajectory_problems(document: Any) -> list[str]:
    """Return what is wrong with a trajectory: layout, grid, order of times, identifiers, shapes."""
    found = list(problems(document, TRAJECTORY_SCHEMA))
    return found or [*_grid_problems(document["grid"]), *_sequence_problems(document["sequence"])]


def episode_from(
    header: dict[str, Any], frames: Sequence[dict[str, Any]], name: str
) -> SocialEpisode:
    """Return the episode of a checked trajectory.

    Velocities come from the positions, unless the file is one of ours: others write the speeds of
    the robot along different axes.
    """
    ours = header.get("awarenav")
    t_s = np.array([frame["timestamp"] for frame in frames], dtype=np.float64)
    robots = [frame["robot"] for frame in frames]
    robot = np.array([[each[key] for key in ("x", "y", "angle")] for each in robots], np.float64)
    heading = robot[:, 2]
    yaw_rates = np.array([each["speed_a"] for each in robots], np.float64)
    robot_mps = velocities(t_s, robot[:, :2])
    if ours is not None:
        cos, sin = np.cos(heading), np.sin(heading)
        forward, left = np.array([[each["speed_x"], each["speed_y"]] for each in robots]).T
        robot_mps = np.stack([cos * forward - sin * left, sin * forward + cos * left], axis=1)
    people, people_mps = _people(t_s, frames)
    goal, shape = frames[-1]["goal"], robots[0]["shape"]
    size = (float(shape.get("length", shape.get("height", shape["width"]))), float(shape["width"]))
    ours = ours or {}
    radius = ours.get("robot_radius_m")
    if radius is None:
        radius = size[1] / 2.0 if shape["type"] == "circle" else math.hypot(*size) / 2.0
    goal_m = np.array([goal["x"], goal["y"]], np.float64)
    tolerance_m = float(goal.get("pos_threshold", 0.25))
    outcome = Outcome(**{each.name: ours.get(each.name) for each in fields(Outcome)})
    if not ours:
        arrived = float(np.hypot(*(robot[-1, :2] - goal_m))) <= tolerance_m
        outcome = Outcome(arrived, float(t_s[-1] - t_s[0]) if arrived else None)
    return SocialEpisode(
        t_s=t_s,
        robot_m=robot[:, :2],
        robot_heading_rad=heading,
        robot_mps=robot_mps,
        yaw_rate_radps=yaw_rates,
        people_m=people[..., :2],
        people_heading_rad=people[..., 2],
        people_mps=people_mps,
        robot_size_m=size,
        robot_radius_m=radius,
        person_radius_m=ours.get("person_radius_m", BODY_RADIUS_M),
        goal_m=goal_m,
        goal_tolerance_m=tolerance_m,
        walls_m=np.array(header["walls"], np.float64).reshape(-1, 4),
        outcome=outcome,
        name=str(header.get("metadata") or name),
    )


def _person(episode: SocialEpisode, row: int, person: int) -> dict[str, Any]:
    (x, y), (vx, vy) = episode.people_m[row, person], episode.people_mps[row, person]
    return {
        "id": person,
        "x": float(x),
        "y": float(y),
        "angle": float(episode.people_heading_rad[row, person]),
        "speed_x": float(vx),
        "speed_y": float(vy),
    }


def _people(t_s: FloatArray, frames: Sequence[dict[str, Any]]) -> tuple[FloatArray, FloatArray]:
    """Return (N, P, 3) poses and (N, P, 2) velocities, NaN for people who are not there."""
    names = sorted({person["id"] for frame in frames for person in frame["people"]})
    column = {name: number for number, name in enumerate(names)}
    poses = np.full((len(frames), len(names), 3), np.nan)
    written = np.full((len(frames), len(names), 2), np.nan)
    for row, frame in enumerate(frames):
        for person in frame["people"]:
            poses[row, column[person["id"]]] = [person["x"], person["y"], person["angle"]]
            if "speed_x" in person and "speed_y" in person:
                written[row, column[person["id"]]] = [person["speed_x"], person["speed_y"]]
    return poses, np.where(np.isnan(written), velocities(t_s, poses[..., :2]), written)


def _grid(episode: SocialEpisode) -> dict[str, Any]:
    """Return the occupancy grid: 1 in boxes, 0 elsewhere; the first row has the largest y."""
    boxes = episode.boxes_m
    extent = np.concatenate([episode.walls_m.reshape(-1, 2), episode.robot_m])
    low, high = extent.min(axis=0), extent.max(axis=0)
    if not len(episode.walls_m):
        low, high = low - _MARGIN_M, high + _MARGIN_M
    columns, rows = np.maximum(np.ceil((high - low) / _CELL_M - 1e-9), 1).astype(int).tolist()
    x = low[0] + _CELL_M * (np.arange(columns) + 0.5)
    y = low[1] + _CELL_M * (np.arange(rows) + 0.5)
    data = np.zeros((rows, columns), dtype=int)
    for x0, y0, x1, y1 in boxes.tolist():
        data[np.ix_((y >= y0) & (y <= y1), (x >= x0) & (x <= x1))] = 1
    return {
        "width": columns,
        "height": rows,
        "cell_size": _CELL_M,
        "x_orig": float(low[0]),
        "y_orig": float(low[1]),
        "angle_orig": 0.0,
        "data": data[::-1].tolist(),
    }


def _grid_problems(grid: dict[str, Any]) -> Iterator[str]:
    if len(grid["data"]) != grid["height"]:
        yield f"grid.height is {grid['height']}, but grid.data has {len(grid['data'])} rows"
    for number, row in enumerate(grid["data"]):
        if len(row) != grid["width"]:
            yield f"grid.width is {grid['width']}, but grid.data[{number}] has {len(row)} cells"
            return


def _sequence_problems(sequence: Sequence[dict[str, Any]]) -> Iterator[str]:
    for number, (before, after) in enumerate(pairwise(sequence), start=1):
        if after["timestamp"] <= before["timestamp"]:
            yield (
                f"sequence[{number}].timestamp must be later than the one before, "
                f"{before['timestamp']:g}, got {after['timestamp']:g}"
            )
    for number, frame in enumerate(sequence):
        names = [person["id"] for person in frame["people"]]
        if len(set(names)) < len(names):
            yield f"sequence[{number}].people has an id twice: {names!r:.60}"
        shapes = [("robot", frame["robot"]["shape"])]
        shapes += [(f"objects[{i}]", each["shape"]) for i, each in enumerate(frame["objects"])]
        for name, shape in shapes:
            if shape["type"] != "polygon" and not {"length", "height"} & set(shape):
                yield f"sequence[{number}].{name}.shape.length is missing"
