"""Frames and the people in them as JSON Lines: one schema for truth and for estimates.

``{"frame", "stamp_s", "T_odom_camera", "people": [{"id", "box_xyxy_px", "position_camera_m",
"gaze_camera", "awareness", "awareness_std", "score", "keypoints": {name: [u, v, score]}}]}``; more
keys may be present. Boxes count pixels from the picture's corner, maxima exclusive; keypoints are
in the coordinates of :meth:`perception.Camera.project`: a pixel's centre is a whole number.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from .._errors import SimError

Record = dict[str, Any]

_KEYS: Final = ("frame", "stamp_s", "T_odom_camera", "people")


def record_line(record: Record) -> str:
    """One line of a JSON Lines file; refuses what JSON cannot say, such as NaN."""
    try:
        return json.dumps(record, separators=(", ", ": "), allow_nan=False) + "\n"
    except ValueError as cause:
        raise SimError(
            f"frame {record.get('frame')!r} holds a number that is not finite"
        ) from cause


def read_records(path: Path) -> list[Record]:
    """Read a JSON Lines file of frames; a last line that was cut off in writing is left out.

    Raises:
        SimError: for a file that cannot be read or a line that is no frame, with its number.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as cause:
        raise SimError(f"cannot read {path}: {cause}") from cause
    lines = text.split("\n")
    records = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            record = json.loads(line)
        except json.JSONDecodeError as cause:
            if number == len(lines):  # no newline after it: the writer was interrupted
                break
            raise SimError(f"{path}, line {number}: not JSON ({cause})") from cause
        if not isinstance(record, dict) or any(key not in record for key in _KEYS):
            raise SimError(f"{path}, line {number}: a frame needs the keys {', '.join(_KEYS)}")
        records.append(record)
    return records


def write_records(path: Path, records: Iterable[Record]) -> None:
    """Write a whole file at once: readers see the old one or the new one, never half of one."""
    part = path.with_name(path.name + ".part")
    with part.open("w", encoding="utf-8") as file:
        file.writelines(record_line(record) for record in records)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)
