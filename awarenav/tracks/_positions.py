"""A CSV of people's positions as a recording: ``t_s, id, x_m, y_m``, and ``std_m`` if known."""

from __future__ import annotations

import itertools
import re
from operator import attrgetter
from pathlib import Path
from typing import Final

import numpy as np

from perception import PersonObservation

from ..errors import AwarenavError
from ._people_table import PersonRow, read_people_table
from ._recording import ASSUMED_POSITION_STD_M, RecordedFrame, Recording

_STD: Final = "std_m"
_WHOLE: Final = re.compile(r"-?[0-9]+")
_MOST_NAMED: Final = 20
# Observations need a sensor's frame: this one looks straight down from above the people. Its x is
# odom's x, its y is against odom's y.
_ABOVE_M: Final = 8.0
_CHEST_M: Final = 1.2
_T_ODOM_ABOVE: Final = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, _ABOVE_M],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def is_positions(path: Path) -> bool:
    """Return whether a file holds positions, by its suffix."""
    return path.suffix.lower() == ".csv"


def read_positions(path: Path) -> Recording:
    """Read a CSV of positions on the floor, in metres of any fixed frame.

    Rows of the same time are one frame. Ids that are no whole numbers are numbered.

    Raises:
        AwarenavError: for a file that cannot be read, without the columns, with a value that is not
            valid, or in other units; see :func:`read_people_table`.
    """
    rows = sorted(read_people_table(path, (_STD,)).rows, key=attrgetter("t_s"))
    for row in rows:
        std_m = row.more.get(_STD)
        if std_m is not None and std_m <= 0.0:
            raise AwarenavError(f"{path}, line {row.line}: {_STD} must be above 0 m, got {std_m:g}")
    ids, remark = _numbered([row.id for row in rows])
    frames = [
        _frame(stamp_s, list(group), ids)
        for stamp_s, group in itertools.groupby(rows, attrgetter("t_s"))
    ]
    assumed = sum(row.more.get(_STD) is None for row in rows)
    return Recording(path, tuple(frames), remark, assumed, has_camera=False)


def _numbered(ids: list[str]) -> tuple[dict[str, int], tuple[str, ...]]:
    """Return the number of each id, and a remark if some are no whole numbers."""
    numbers = {id: int(id) for id in ids if _WHOLE.fullmatch(id)}
    first = max(numbers.values(), default=0) + 1
    others = [id for id in dict.fromkeys(ids) if id not in numbers]
    texts = {id: first + index for index, id in enumerate(others)}
    if not texts:
        return numbers, ()
    named = ", ".join(f"{number} is {id!r}" for id, number in list(texts.items())[:_MOST_NAMED])
    more = ", …" if len(texts) > _MOST_NAMED else ""
    return {**numbers, **texts}, (f"ids that are no whole numbers are numbered: {named}{more}",)


def _frame(stamp_s: float, rows: list[PersonRow], ids: dict[str, int]) -> RecordedFrame:
    observations = tuple(
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([row.x_m, -row.y_m, _ABOVE_M - _CHEST_M]),
            position_covariance_m2=(row.more.get(_STD) or ASSUMED_POSITION_STD_M) ** 2 * np.eye(3),
            gaze_camera=None,
            awareness=None,
            awareness_std=None,
            score=1.0,
        )
        for row in rows
    )
    return RecordedFrame(
        name=f"{stamp_s:g} s",
        stamp_s=stamp_s,
        T_odom_camera=_T_ODOM_ABOVE,
        observations=observations,
        ids=tuple(ids[row.id] for row in rows),
        tracks=None,
    )
