"""Segments on one line joined into longer ones, so that fewer are tested against rays."""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray

# Segments whose lines differ by less than this, in radians and metres, are on one line, and so are
# those with a smaller gap between them.
_SAME: Final = 1e-9


def merged_segments(segments_m: FloatArray) -> FloatArray:
    """Return segments that cover the same points as those given, but do not overlap on a line.

    A rack's side is many triangles, and so as many segments on one line.

    Args:
        segments_m: (S, 2, 3) in one plane of constant z.

    Returns:
        (R, 2, 3), R ≤ S; segments of no length are left out.
    """
    along = segments_m[:, 1, :2] - segments_m[:, 0, :2]
    length = np.sqrt((along * along).sum(axis=1))
    kept = np.flatnonzero(length > _SAME)
    if not kept.size:
        return np.empty((0, 2, 3))
    points = segments_m[kept, :, :2]
    unit = along[kept] / length[kept, None]
    # Both directions of a line are one.
    back = (unit[:, 0] < -_SAME) | ((np.abs(unit[:, 0]) <= _SAME) & (unit[:, 1] < 0.0))
    unit[back] *= -1.0
    normal = np.column_stack((-unit[:, 1], unit[:, 0]))
    offset = (normal * points[:, 0]).sum(axis=1)
    ends = np.sort((points * unit[:, None]).sum(axis=2), axis=1)
    direction = np.round(np.arctan2(unit[:, 1], unit[:, 0]) / _SAME)
    line = np.round(offset / _SAME)
    order = np.lexsort((ends[:, 0], line, direction))
    direction, line, ends = direction[order], line[order], ends[order]
    same = (np.diff(direction) == 0.0) & (np.diff(line) == 0.0)
    rows: list[int] = []
    reached: list[float] = []
    for row, (low, high) in enumerate(ends.tolist()):
        if row and same[row - 1] and low <= reached[-1] + _SAME:
            reached[-1] = max(reached[-1], high)
        else:
            rows.append(row)
            reached.append(high)
    first = order[rows]
    out = np.empty((len(rows), 2, 3))
    foot = normal[first] * offset[first, None]
    out[:, 0, :2] = foot + ends[rows, :1] * unit[first]
    out[:, 1, :2] = foot + np.array(reached)[:, None] * unit[first]
    out[..., 2] = segments_m[0, 0, 2]
    return out
