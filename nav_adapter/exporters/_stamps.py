"""Costs of the cells about people, window by window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._outlines import long_outlines
from ._shapes import circles

Cells = NDArray[np.uint8]

# nav2_costmap_2d/cost_values.hpp
LETHAL: Final = 254
INSCRIBED: Final = 253
_UNKNOWN: Final = 255
_RING_COST: Final = 252.0
# Single precision is off by less than this share of a length; the doubt widens the obstacle.
_ROUNDING: Final = 4e-7
# The gap where nobody is near; finite, so that no product with it is undefined.
_NOBODY_M: Final = np.float32(1e9)
# Steeper than this a ring is gone within a millimetre.
_STEEPEST_PER_M: Final = 1e5
# So many windows of 60 × 60 cells take half a megabyte.
_AT_ONCE: Final = 32
# Windows whose sides differ by no more are treated as equal.
_LIKE_SIZE: Final = 1.3
# Beginning a window takes about as long as so many cells of it.
_CELLS_PER_WINDOW: Final = 8000


@dataclass(frozen=True, slots=True)
class Brush:
    """How people are painted; made by :func:`checked_brush`.

    Attributes:
        ring_m: ≥ 0, width of the zone with a cost beyond the obstacle (``inflation_radius``).
        inscribed_radius_m: ≥ 0, of the robot: width of the zone that costs 253.
        decay_per_m: > 0 (``cost_scaling_factor``).
    """

    ring_m: float
    inscribed_radius_m: float
    decay_per_m: float


def checked_brush(ring_m: float, inscribed_radius_m: float, decay_per_m: float) -> Brush:
    """Return the brush, or raise NavError for numbers out of bounds."""
    ring = finite_number("ring_m", ring_m, NavError, minimum=0.0)
    inscribed = finite_number("inscribed_radius_m", inscribed_radius_m, NavError, minimum=0.0)
    decay = finite_number("decay_per_m", decay_per_m, NavError, minimum=0.0, exclusive_minimum=True)
    return Brush(max(ring, inscribed), inscribed, decay)


def checked_costmap(costmap: Any) -> Cells:
    """Return the array itself, or raise NavError if nothing can be painted into it."""
    if not isinstance(costmap, np.ndarray) or costmap.dtype != np.uint8 or costmap.ndim != 2:
        given = (
            f"{costmap.dtype} of shape {costmap.shape}"
            if isinstance(costmap, np.ndarray)
            else type(costmap).__name__
        )
        raise NavError(f"costmap must be a uint8 array of shape (H, W), got {given}")
    if not costmap.flags.writeable:
        raise NavError("costmap must be writable, got a read-only array")
    return costmap


def checked_grid(origin_odom_m: Any, resolution_m: float) -> tuple[FloatArray, float]:
    """Return origin (2,) and resolution, or raise NavError for what is no grid."""
    origin = finite_array("origin_odom_m", origin_odom_m, (2,), NavError)
    return origin, finite_number(
        "resolution_m", resolution_m, NavError, minimum=0.0, exclusive_minimum=True
    )


def stamps(
    shape: tuple[int, int],
    origin: FloatArray,
    resolution: float,
    constraints: NavConstraints,
    brush: Brush,
) -> Iterator[tuple[tuple[slice, slice], Cells]]:
    """Yield windows (rows, columns) and the costs in them, 0 where there is none.

    People close to each other share a window; the costs do not depend on who shares.
    """
    rows = circles(constraints)
    if not len(rows):
        return
    size = np.array(shape[::-1])
    center, radius = rows[:, :2] - origin, rows[:, 4]
    first, last = center - radius[:, None], center + radius[:, None]
    outlines = {i: corners - origin for i, corners in long_outlines(constraints).items()}
    for index, corners in outlines.items():
        first[index] = np.minimum(first[index], corners.min(axis=0))
        last[index] = np.maximum(last[index], corners.max(axis=0))
    # Clipped as floats: an obstacle far off the map must not overflow an integer.
    low = np.clip(np.floor((first - brush.ring_m) / resolution), 0, size).astype(np.int64)
    high = np.clip(np.ceil((last + brush.ring_m) / resolution), 0, size).astype(np.int64)
    seen = np.flatnonzero((low < high).all(axis=1))
    if not len(seen):
        return
    for group in _groups(low[seen], high[seen]):
        who = seen[group]
        long = {i: outlines[k] for i, k in enumerate(who.tolist()) if k in outlines}
        yield _stamp(center[who], radius[who], long, low[who], high[who], resolution, brush)


def paint(window: Cells, cost: Cells) -> None:
    """Put a stamp onto the cells of its window, in place.

    Unknown cells (255) are above every cost and stay, but under an obstacle they become lethal.
    """
    np.maximum(window, cost, out=window)
    was_unknown = (window == _UNKNOWN) & (cost == LETHAL)
    np.subtract(window, was_unknown.view(np.uint8), out=window)


def _groups(low: NDArray[np.int64], high: NDArray[np.int64]) -> list[slice]:
    """Everybody in one window if that is not wasteful, else everybody in their own."""
    single = int((high - low).prod(axis=1).sum())
    shared = int((high.max(axis=0) - low.min(axis=0)).prod())
    if shared <= single + _CELLS_PER_WINDOW * len(low):
        return [slice(None)]
    return [slice(index, index + 1) for index in range(len(low))]


def _stamp(
    center: FloatArray,
    radius: FloatArray,
    outlines: dict[int, FloatArray],
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    resolution: float,
    brush: Brush,
) -> tuple[tuple[slice, slice], Cells]:
    corner = low.min(axis=0)
    (left, bottom), (right, top) = corner, high.max(axis=0)
    gap = np.full((top - bottom, right - left), _NOBODY_M, dtype=np.float32)
    for some in _of_like_size((high - low).max(axis=1)):
        _lower(gap, corner, center[some], radius[some], low[some], high[some], resolution)
    for index, corners in outlines.items():
        (x0, y0), (x1, y1) = (low[index] - corner).tolist(), (high[index] - corner).tolist()
        view = gap[y0:y1, x0:x1]
        x = (np.arange(low[index, 0], high[index, 0]) + 0.5) * resolution
        y = (np.arange(low[index, 1], high[index, 1]) + 0.5) * resolution
        np.minimum(view, _beyond(corners, x, y), out=view)
    # So that no obstacle slips through a coarse grid: the cell that holds a centre is inside.
    column, row = np.floor(center / resolution).T
    held = (column >= left) & (column < right) & (row >= bottom) & (row < top)
    gap[row[held].astype(int) - bottom, column[held].astype(int) - left] = -1.0
    # Of the longest lengths: a radius, also where the map cuts it off, or an outline.
    doubt_m = _ROUNDING * (float(radius.max()) + resolution * float((high - low).max()))
    return (slice(int(bottom), int(top)), slice(int(left), int(right))), _costs(gap, brush, doubt_m)


def _of_like_size(sizes: NDArray[np.int64]) -> Iterator[NDArray[np.intp]]:
    """Indices of windows that can be treated as equally large without much waste."""
    order = np.argsort(sizes, kind="stable")
    ascending = sizes[order].tolist()
    first = 0
    for last in range(1, len(ascending) + 1):
        ends = last == len(ascending) or last - first == _AT_ONCE
        if ends or ascending[last] > _LIKE_SIZE * ascending[first]:
            yield order[first:last]
            first = last


def _lower(
    gap: NDArray[np.float32],
    corner: NDArray[np.int64],
    center: FloatArray,
    radius: FloatArray,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    resolution: float,
) -> None:
    """Lower the gaps, m, to those from some people's circles, in place.

    Their windows are made equally large, so that one call does for all of them.
    """
    width, height = (high - low).max(axis=0).tolist()
    low = np.minimum(low - corner, [gap.shape[1] - width, gap.shape[0] - height])
    # In double precision up to the squares, which no longer suffer from a far origin.
    x = (low[:, :1] + corner[0] + np.arange(width) + 0.5) * resolution - center[:, :1]
    y = (low[:, 1:] + corner[1] + np.arange(height) + 0.5) * resolution - center[:, 1:]
    parts = np.add(
        np.square(x).astype(np.float32)[:, None, :], np.square(y).astype(np.float32)[:, :, None]
    )
    np.sqrt(parts, out=parts)
    parts -= radius.astype(np.float32)[:, None, None]
    for part, (x0, y0) in zip(parts, low.tolist(), strict=True):
        view = gap[y0 : y0 + height, x0 : x0 + width]
        np.minimum(view, part, out=view)


def _costs(gap: NDArray[np.float32], brush: Brush, doubt_m: float) -> Cells:
    """The cost of each gap, m, between cell and obstacle."""
    doubt = np.float32(doubt_m)
    decay = np.float32(-min(brush.decay_per_m, _STEEPEST_PER_M))
    cost = gap - np.float32(brush.inscribed_radius_m)
    np.abs(cost, out=cost)  # what is nearer is overwritten below
    np.multiply(cost, decay, out=cost)
    np.exp(cost, out=cost)
    np.multiply(cost, np.float32(_RING_COST), out=cost)
    cells: Cells = cost.astype(np.uint8)  # cuts off, as Nav2 does
    # Arithmetic with masks takes a tenth of the time of writing through them.
    cells *= (gap <= np.float32(brush.ring_m) + doubt).view(np.uint8)
    if brush.inscribed_radius_m > 0.0:
        inscribed = gap <= np.float32(brush.inscribed_radius_m) + doubt
        np.maximum(cells, inscribed.view(np.uint8) * np.uint8(INSCRIBED), out=cells)
    inside = gap <= doubt
    np.maximum(cells, inside.view(np.uint8) * np.uint8(LETHAL), out=cells)
    return cells


def _beyond(corners: FloatArray, x: FloatArray, y: FloatArray) -> NDArray[np.float32]:
    """How far outside a convex outline the cells are, m; negative inside, too small off corners."""
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    normals /= np.hypot(edges[:, 0], edges[:, 1])[:, None]
    # From its middle, so that small numbers remain to be rounded.
    middle = corners.mean(axis=0)
    x, y, corners = x - middle[0], y - middle[1], corners - middle
    offsets = (normals * corners).sum(axis=1)
    normals[offsets < 0.0] *= -1.0  # whichever way the corners run
    offsets = np.abs(offsets)
    across_x = (normals[:, :1] * x - offsets[:, None]).astype(np.float32)
    across_y = (normals[:, 1:] * y).astype(np.float32)[:, :, None]
    beyond: NDArray[np.float32] = across_x[0] + across_y[0]
    side = np.empty_like(beyond)
    for along_x, along_y in zip(across_x[1:], across_y[1:], strict=True):
        np.add(along_x, along_y, out=side)
        np.maximum(beyond, side, out=beyond)
    return beyond
