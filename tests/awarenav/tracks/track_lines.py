"""Lines of an estimates file about people who walk as told, seen by a camera that may drive."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from awarenav.records import write_records
from awarenav.tracks._recording import Recording, read_recording

Place = Callable[[float], tuple[float, float]]


def pose(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> np.ndarray:
    """T_odom_camera of a level camera 1.4 m above the floor."""
    T = np.eye(4)
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    T[:3, :3] = [[sine, 0.0, cosine], [-cosine, 0.0, sine], [0.0, -1.0, 0.0]]
    T[:3, 3] = [x_m, y_m, 1.4]
    return T


def person(
    place: tuple[float, float],
    T: np.ndarray,
    *,
    awareness: float | None = 0.9,
    id: int | None = None,
    std_m: float = 0.05,
) -> dict[str, Any]:
    """Someone at (x, y) in odom, chest at 1.3 m."""
    position = (np.array([*place, 1.3]) - T[:3, 3]) @ T[:3, :3]
    return {
        "id": id,
        "position_camera_m": position.tolist(),
        "position_covariance_m2": (std_m**2 * np.eye(3)).tolist(),
        "awareness": awareness,
        "awareness_std": None if awareness is None else 0.1,
    }


def lines(
    places: Sequence[Place],
    *,
    frames: int = 40,
    rate_hz: float = 10.0,
    hidden: Callable[[int, int], bool] = lambda frame, who: False,
    named: bool = False,
    camera: Callable[[float], np.ndarray] = lambda stamp_s: pose(),
    awareness: Callable[[float], float | None] = lambda stamp_s: 0.9,
) -> list[dict[str, Any]]:
    """One line a frame; ``named`` gives people their index as id, as in a truth file."""
    records = []
    for frame in range(frames):
        stamp_s = frame / rate_hz
        T = camera(stamp_s)
        records.append(
            {
                "frame": f"{frame:06d}",
                "stamp_s": stamp_s,
                "T_odom_camera": T.tolist(),
                "people": [
                    person(
                        place(stamp_s), T, awareness=awareness(stamp_s), id=who if named else None
                    )
                    for who, place in enumerate(places)
                    if not hidden(frame, who)
                ],
            }
        )
    return records


def standing(x_m: float, y_m: float) -> Place:
    """Someone who stands."""
    return lambda stamp_s: (x_m, y_m)


def walking(x_m: float, y_m: float, vx_mps: float, vy_mps: float) -> Place:
    """Someone who walks straight on."""
    return lambda stamp_s: (x_m + vx_mps * stamp_s, y_m + vy_mps * stamp_s)


def recorded(
    folder: Path, records: list[dict[str, Any]], name: str = "estimates.jsonl"
) -> Recording:
    """Write lines into a file, and read it."""
    write_records(folder / name, records)
    return read_recording(folder / name)
