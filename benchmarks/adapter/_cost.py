"""Processor time of each step of a control cycle."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, circles, paint_costmap
from nav_adapter.exporters import CostmapPainter

from ._crowd import CELLS, DT_S, ORIGIN_ODOM_M, RESOLUTION_M, ROBOT, crowd, robot_at

#: Steps whose sum is a cycle. The painter and the naive costmap are alternatives to "costmap".
CYCLE = ("update", "circles", "costmap")
_NAIVE_FRAMES = 3
Result = TypeVar("Result")


def cost_ms(people: int, frames: int, repeats: int, seed: int, naive: bool) -> dict[str, float]:
    """Return the median processor milliseconds of each step over the frames.

    The least time of a frame over the repeats counts, since other programs can only slow it down.
    The first half second, in which every person is new, is left out. ``naive`` adds the naive
    costmap, on three frames.
    """
    tracks = crowd(people, frames, np.random.default_rng([seed, people]))
    steps = (*CYCLE, "painter", *(("naive",) if naive else ()))
    least = {step: np.full(frames, np.inf) for step in steps}
    for _ in range(repeats):
        adapter = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT)
        lasting = CostmapPainter(np.zeros(CELLS, dtype=np.uint8), ORIGIN_ODOM_M, RESOLUTION_M)
        gc.collect()
        for frame, current in enumerate(tracks):
            now = frame * DT_S
            state = robot_at(now)
            fresh, other = np.zeros((2, *CELLS), dtype=np.uint8)

            def timed(step: str, work: Callable[[], Result], frame: int = frame) -> Result:
                began = time.thread_time()
                result = work()
                least[step][frame] = min(least[step][frame], time.thread_time() - began)
                return result

            constraints = timed("update", partial(adapter.update, current, state, now))
            timed("circles", partial(circles, constraints))
            timed(
                "costmap",
                partial(paint_costmap, fresh, ORIGIN_ODOM_M, RESOLUTION_M, constraints),
            )
            timed("painter", partial(lasting.update, constraints))
            if naive and frame >= frames - _NAIVE_FRAMES:
                timed("naive", partial(paint_naively, other, constraints))
    settled = slice(min(round(0.5 / DT_S), frames // 2), None)
    return {
        step: 1e3 * float(np.median(times[settled][np.isfinite(times[settled])]))
        for step, times in least.items()
    }


def paint_naively(costmap: NDArray[np.uint8], constraints: NavConstraints) -> None:
    """Paint like :func:`nav_adapter.paint_costmap`, with polygons instead of circles."""
    x = ORIGIN_ODOM_M[0] + RESOLUTION_M * (np.arange(CELLS[1]) + 0.5)
    y = ORIGIN_ODOM_M[1] + RESOLUTION_M * (np.arange(CELLS[0]) + 0.5)
    cells = shapely.points(*np.meshgrid(x, y))
    for obstacle in constraints.obstacles:
        gap_m = shapely.distance(cells, obstacle.polygon)
        cost = np.where(gap_m <= 0.55, 252.0 * np.exp(-10.0 * gap_m), 0.0)
        np.maximum(costmap, cost.astype(np.uint8), out=costmap)
        costmap[gap_m == 0.0] = 254
