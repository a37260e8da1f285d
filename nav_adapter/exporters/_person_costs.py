"""Costs of the cells around people, one window of the costmap at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._shapes import circles

Cells = NDArray[np.uint8]

# nav2_costmap_2d/cost_values.hpp
LETHAL: Final = 254
INSCRIBED: Final = 253
_UNKNOWN: Final = 255
_RING_COST: Final = 252.0
# Rounding error of single precision, as a share of a length; obstacles are enlarged by it.
_ROUNDING: Final = 4e-7
# The gap where nobody is near; finite, so that products with it are defined.
_FAR_M: Final = np.float32(1e9)
# With a steeper decay the cost falls to 0 within a millimetre.
_STEEPEST_PER_M: Final = 1e5
# Number of windows computed together; 32 of 60 × 60 cells take half a megabyte.
_WINDOWS_AT_ONCE: Final = 32
# Windows whose sizes differ by at most this ratio are computed together.
_SIMILAR_SIZE_RATIO: Final = 1.3
# The fixed cost of a window, in cells.
_CELLS_PER_WINDOW: Final = 8000


class CostProfile(NamedTuple):
    """The cost over distance from an obstacle; made by :func:`checked_profile`.

    ``ring_m`` ≥ 0 is the width of the zone with a cost beyond the obstacle (``inflation_radius``),
    ``inscribed_radius_m`` ≥ 0 of the robot that of the zone with cost 253, and ``decay_per_m`` > 0
    the ``cost_scaling_factor``.
    """

    ring_m: float
    inscribed_radius_m: float
    decay_per_m: float


def checked_profile(ring_m: float, inscribed_radius_m: float, decay_per_m: float) -> CostProfile:
    """Return the profile, or raise NavError for numbers out of bounds."""
    ring = finite_number("ring_m", ring_m, NavError, minimum=0.0)
    inscribed = finite_number("inscribed_radius_m", inscribed_radius_m, NavError, minimum=0.0)
    decay = finite_number("decay_per_m", decay_per_m, NavError, minimum=0.0, exclusive_minimum=True)
    return CostProfile(max(ring, inscribed), inscribed, decay)


def checked_costmap(costmap: Any) -> Cells:
    """Return the array itself, or raise NavError if it cannot be painted into."""
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
    """Return origin (2,) and resolution, or raise NavError if they are not those of a grid."""
    origin = finite_array("origin_odom_m", origin_odom_m, (2,), NavError)
    return origin, finite_number(
        "resolution_m", resolution_m, NavError, minimum=0.0, exclusive_minimum=True
    )


def cost_windows(
    shape: tuple[int, int],
    origin: FloatArray,
    resolution: float,
    constraints: NavConstraints,
    profile: CostProfile,
) -> Iterator[tuple[tuple[slice, slice], Cells]]:
    """Yield windows (rows, columns) and the costs in them, 0 for no cost.

    People close to each other share a window. The costs do not depend on that.
    """
    rows = circles(constraints)
    if not len(rows):
        return
    size = np.array(shape[::-1])
    center, radius = rows[:, :2] - origin, rows[:, 4]
    lower, upper = center - radius[:, None], center + radius[:, None]
    # Clipped as floats, since an obstacle far off the map would overflow an integer.
    low = np.clip(np.floor((lower - profile.ring_m) / resolution), 0, size).astype(np.int64)
    high = np.clip(np.ceil((upper + profile.ring_m) / resolution), 0, size).astype(np.int64)
    on_map = np.flatnonzero((low < high).all(axis=1))
    if not len(on_map):
        return
    for group in _groups(low[on_map], high[on_map]):
        people = on_map[group]
        yield _cost_window(
            center[people],
            radius[people],
            low[people],
            high[people],
            resolution,
            profile,
        )


def paint(window: Cells, cost: Cells) -> None:
    """Paint costs into the cells of their window, in place; the higher cost counts.

    Unknown cells (255) stay unknown, except that they become lethal inside an obstacle.
    """
    np.maximum(window, cost, out=window)
    was_unknown = (window == _UNKNOWN) & (cost == LETHAL)
    np.subtract(window, was_unknown.view(np.uint8), out=window)


def _groups(low: NDArray[np.int64], high: NDArray[np.int64]) -> list[slice]:
    """Return the people of each window: one window for all if that is cheaper, else one each."""
    separate = int((high - low).prod(axis=1).sum())
    shared = int((high.max(axis=0) - low.min(axis=0)).prod())
    if shared <= separate + _CELLS_PER_WINDOW * len(low):
        return [slice(None)]
    return [slice(index, index + 1) for index in range(len(low))]


def _cost_window(
    center: FloatArray,
    radius: FloatArray,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    resolution: float,
    profile: CostProfile,
) -> tuple[tuple[slice, slice], Cells]:
    """Return one window that holds all the given people, and its costs."""
    corner = low.min(axis=0)
    (left, bottom), (right, top) = corner, high.max(axis=0)
    gap = np.full((top - bottom, right - left), _FAR_M, dtype=np.float32)
    for batch in _batches((high - low).max(axis=1)):
        _lower_gaps(gap, corner, center[batch], radius[batch], low[batch], high[batch], resolution)
    # The cell with an obstacle's centre counts as inside, so that a coarse grid misses nobody.
    column, row = np.floor(center / resolution).T
    in_window = (column >= left) & (column < right) & (row >= bottom) & (row < top)
    gap[row[in_window].astype(int) - bottom, column[in_window].astype(int) - left] = -1.0
    # The longest lengths: a radius, which the map may cut off, and a window.
    rounding_m = _ROUNDING * (float(radius.max()) + resolution * float((high - low).max()))
    window = slice(int(bottom), int(top)), slice(int(left), int(right))
    return window, _costs(gap, profile, rounding_m)


def _batches(sizes: NDArray[np.int64]) -> Iterator[NDArray[np.intp]]:
    """Yield indices of windows of similar size, to be computed together."""
    order = np.argsort(sizes, kind="stable")
    ascending = sizes[order].tolist()
    first = 0
    for last in range(1, len(ascending) + 1):
        ends = last == len(ascending) or last - first == _WINDOWS_AT_ONCE
        if ends or ascending[last] > _SIMILAR_SIZE_RATIO * ascending[first]:
            yield order[first:last]
            first = last


def _lower_gaps(
    gap: NDArray[np.float32],
    corner: NDArray[np.int64],
    center: FloatArray,
    radius: FloatArray,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    resolution: float,
) -> None:
    """Lower the gaps (m) to those from the circles of some people, in place.

    Their windows are enlarged to the same size, so that one numpy call computes all of them.
    """
    width, height = (high - low).max(axis=0).tolist()
    low = np.minimum(low - corner, [gap.shape[1] - width, gap.shape[0] - height])
    # Double precision up to the squares, so that a far origin costs no precision.
    x = (low[:, :1] + corner[0] + np.arange(width) + 0.5) * resolution - center[:, :1]
    y = (low[:, 1:] + corner[1] + np.arange(height) + 0.5) * resolution - center[:, 1:]
    gaps = np.add(
        np.square(x).astype(np.float32)[:, None, :], np.square(y).astype(np.float32)[:, :, None]
    )
    np.sqrt(gaps, out=gaps)
    gaps -= radius.astype(np.float32)[:, None, None]
    for own_gap, (x0, y0) in zip(gaps, low.tolist(), strict=True):
        view = gap[y0 : y0 + height, x0 : x0 + width]
        np.minimum(view, own_gap, out=view)


def _costs(gap: NDArray[np.float32], profile: CostProfile, rounding_m: float) -> Cells:
    """Return the cost for each gap (m) between cell and obstacle."""
    rounding = np.float32(rounding_m)
    decay = np.float32(-min(profile.decay_per_m, _STEEPEST_PER_M))
    cost = gap - np.float32(profile.inscribed_radius_m)
    np.abs(cost, out=cost)  # nearer cells are overwritten below
    np.multiply(cost, decay, out=cost)
    np.exp(cost, out=cost)
    np.multiply(cost, np.float32(_RING_COST), out=cost)
    cells: Cells = cost.astype(np.uint8)  # truncates, as Nav2 does
    # Arithmetic with masks takes a tenth of the time of masked assignment.
    cells *= (gap <= np.float32(profile.ring_m) + rounding).view(np.uint8)
    if profile.inscribed_radius_m > 0.0:
        inscribed = gap <= np.float32(profile.inscribed_radius_m) + rounding
        np.maximum(cells, inscribed.view(np.uint8) * np.uint8(INSCRIBED), out=cells)
    inside = gap <= rounding
    np.maximum(cells, inside.view(np.uint8) * np.uint8(LETHAL), out=cells)
    return cells
