"""Processor time of our tracker with a camera and a scanner, against the camera alone."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable

import numpy as np

from perception import PersonObservation
from tracking import AwarenessFilterConfig, PersonTracker, SensorConfig, TrackerConfig

from ._measurements import SimulatedRecording
from ._ours import T_ODOM_CAMERA, observations

_SCAN_STD_M = 0.05
_FrameOf = tuple[float, tuple[PersonObservation, ...], str]


def two_sensor_cost_ms(
    recording: SimulatedRecording, config: TrackerConfig, repeats: int
) -> dict[str, float]:
    """Return median processor milliseconds per update, with one sensor and with two.

    The scanner is as fast as the camera, and its frames lie between those of the camera. With two
    sensors there are twice as many updates per second.
    """
    both = _frames(recording)
    alone = [frame for frame in both if frame[2] == "camera"]
    memory = AwarenessFilterConfig(**{**config.awareness.model_dump(), "noticed_memory_s": 5.0})
    noticing = config.model_copy(update={"awareness": memory})
    scanner = {"laser": SensorConfig()}
    makers: dict[str, tuple[Callable[[], PersonTracker], list[_FrameOf]]] = {
        "camera": (lambda: PersonTracker(config), alone),
        "camera and scanner": (lambda: PersonTracker(config, sensors=scanner), both),
        "… and noticed": (lambda: PersonTracker(noticing, sensors=scanner), both),
    }
    least = {name: np.full(len(frames), np.inf) for name, (_, frames) in makers.items()}
    for _ in range(repeats):
        for name, (make, frames) in makers.items():
            tracker = make()
            gc.collect()
            for index, (stamp_s, people, sensor) in enumerate(frames):
                began = time.thread_time()
                tracker.update(people, stamp_s, T_ODOM_CAMERA, sensor=sensor)
                least[name][index] = min(least[name][index], time.thread_time() - began)
    return {
        name: 1e3 * float(np.median(times[len(times) // 10 :])) for name, times in least.items()
    }


def _frames(recording: SimulatedRecording) -> list[_FrameOf]:
    """Return the frames of a camera and of a scanner between them, in order."""
    rng = np.random.default_rng(0)
    stamps_s = recording.stamps_s.tolist()
    half_s = 0.5 * float(np.diff(recording.stamps_s).mean())
    frames: list[_FrameOf] = []
    for stamp_s, places_m in zip(stamps_s, recording.measured_m, strict=True):
        seen = observations(places_m, stamp_s, recording.noise_std_m)
        frames.append((stamp_s, seen, "camera"))
        scanned_m = places_m + rng.normal(0.0, _SCAN_STD_M, places_m.shape)
        scan = observations(scanned_m, stamp_s + half_s, recording.noise_std_m)
        frames.append((stamp_s + half_s, scan, "laser"))
    return frames
