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
) -> tuple[dict[str, float], dict[str, float]]:
    """Return each tracker's median processor milliseconds per frame: alone, and with its input.

    The trackers take turns on whole recordings. For each frame the least time over the repeats
    counts, since other programs can only slow it down. Reading the result is not timed.
    """
    frames = len(recording.stamps_s)
    least = {contender.name: np.full((2, frames), np.inf) for contender in contenders}
    for _ in range(repeats):
        for contender in contenders:
            contender.begin(recording)
            gc.collect()
            for frame in range(frames):
                began = time.thread_time()
                contender.make(frame)
                made = time.thread_time()
                contender.advance(frame)
                ended = time.thread_time()
                best = least[contender.name][:, frame]
                best[:] = np.minimum(best, (ended - made, ended - began))
    # The first frames have no tracks yet.
    median = {
        name: 1e3 * np.median(times[:, frames // 10 :], axis=1) for name, times in least.items()
    }
    return (
        {name: float(alone) for name, (alone, _) in median.items()},
        {name: float(whole) for name, (_, whole) in median.items()},
    )
