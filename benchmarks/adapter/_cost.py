"""Processor time of each step of a control cycle."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, circles, paint_costmap
from nav_adapter.exporters import CostmapPainter

from ._crowd import CELLS, DT_S, ORIGIN_ODOM_M, RESOLUTION_M, ROBOT, crowd, robot_at
from ._naive import paint_naively

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
