"""Processor time per frame of each tracker, on the same frames in the same run."""

from __future__ import annotations

import gc
import time
from collections.abc import Sequence

import numpy as np

from ._contender import Contender
from ._measurements import SimulatedRecording


def cost_ms(
    contenders: Sequence[Contender], recording: SimulatedRecording, repeats: int
) -> dict[str, float]:
    """Return the median processor milliseconds per frame of each tracker.

    The trackers take turns on whole recordings. For each frame the least time over the repeats
    counts, since other programs can only slow it down. Making the input and reading the result are
    not timed.
    """
    frames = len(recording.stamps_s)
    least = {contender.name: np.full(frames, np.inf) for contender in contenders}
    for _ in range(repeats):
        for contender in contenders:
            contender.begin(recording)
            gc.collect()
            for frame in range(frames):
                began = time.thread_time()
                contender.advance(frame)
                took_s = time.thread_time() - began
                least[contender.name][frame] = min(least[contender.name][frame], took_s)
    # The first frames have no tracks yet.
    return {name: 1e3 * float(np.median(times[frames // 10 :])) for name, times in least.items()}
