"""Processor time per frame: of each tracker, and of ours with two sensors against one."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from awarenav.baseline import MeasuredValue
from perception import PersonObservation
from tracking import AwarenessFilterConfig, PersonTracker, SensorConfig, TrackerConfig

from ._measurements import OPEN, SimulatedRecording, record
from ._trackers import T_ODOM_CAMERA, Contender, observations

#: Crowds whose cost is measured: from one person before a robot to a stadium's entrance.
PEOPLE: Final = (1, 2, 5, 20, 50, 100, 300)
FRAMES, REPEATS = 150, 3
#: Most processor time of ours relative to norfair's, the making of the input included.
_MOST_OF_NORFAIR: Final = 1.15
#: An update with two sensors takes at most this much longer than with the camera alone: a range
#: that is measured may match any place on a ray.
_MOST_FOR_TWO_SENSORS: Final = 2.3
_TWO_SENSORS_PEOPLE: Final = 20
_SCAN_STD_M: Final = 0.05
_FrameOf = tuple[float, tuple[PersonObservation, ...], str]


def cost_table(
    seed: int, makers: Mapping[str, Callable[[], Contender]]
) -> tuple[list[MeasuredValue], list[str]]:
    """Print the processor time of the trackers; return ratios to ours, and missed targets.

    Bare times depend on the computer; only ratios have a target.
    """
    print(f"\n{'processor time':16s}{'people':>6s}{'update, ms':>12s}{'with input':>12s}", end="")
    print(f"{'ours over it':>14s}")
    metrics: list[MeasuredValue] = []
    missed: list[str] = []
    for people in PEOPLE:
        recording = record(people, FRAMES, np.random.default_rng([seed, people]), OPEN)
        alone, cost = cost_ms([make() for make in makers.values()], recording, REPEATS)
        for tracker, value in cost.items():
            line = f"{tracker:16s}{people:6d}{alone[tracker]:12.3f}{value:12.3f}"
            if tracker == "ours" or "ours" not in cost:
                print(line, flush=True)
                continue
            ratio = cost["ours"] / value
            print(f"{line}{ratio:14.3f}", flush=True)
            name = f"cost_{people}_with_input_over_{tracker}"
            metrics.append(MeasuredValue(name, ratio, "x", "lower", 0.4))
            if tracker == "norfair" and ratio > _MOST_OF_NORFAIR:
                missed.append(
                    f"cost at {people} people: {ratio:.2f} of norfair's, "
                    f"{_MOST_OF_NORFAIR:g} wanted"
                )
    return metrics, missed


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
    median = {name: [1e3 * _settled(row) for row in times] for name, times in least.items()}
    return (
        {name: alone for name, (alone, _) in median.items()},
        {name: whole for name, (_, whole) in median.items()},
    )


def two_sensor_table(seed: int) -> tuple[list[MeasuredValue], list[str]]:
    """Print the processor time of an update with camera and scanner, against the camera alone.

    The scanner is as fast as the camera, and its frames lie between those of the camera. With two
    sensors there are twice as many updates per second.
    """
    rng = np.random.default_rng([seed, _TWO_SENSORS_PEOPLE])
    both = _frames_of_two(record(_TWO_SENSORS_PEOPLE, FRAMES, rng, OPEN))
    noticing = TrackerConfig(awareness=AwarenessFilterConfig(noticed_memory_s=5.0))
    scanner = {"laser": SensorConfig()}
    makers: dict[str, tuple[Callable[[], PersonTracker], list[_FrameOf]]] = {
        "camera": (PersonTracker, [frame for frame in both if frame[2] == "camera"]),
        "camera and scanner": (lambda: PersonTracker(sensors=scanner), both),
        "… and noticed": (lambda: PersonTracker(noticing, sensors=scanner), both),
    }
    least = {name: np.full(len(frames), np.inf) for name, (_, frames) in makers.items()}
    for _ in range(REPEATS):
        for name, (make, frames) in makers.items():
            tracker = make()
            gc.collect()
            for index, (stamp_s, people, sensor) in enumerate(frames):
                began = time.thread_time()
                tracker.update(people, stamp_s, T_ODOM_CAMERA, sensor=sensor)
                least[name][index] = min(least[name][index], time.thread_time() - began)
    print(f"\n{'processor time, 20 people':28s}{'update, ms':>12s}{'over camera':>14s}")
    missed = []
    one = _settled(least["camera"])
    for name, times in least.items():
        ratio = _settled(times) / one
        print(f"{name:28s}{1e3 * _settled(times):12.3f}{ratio:14.3f}", flush=True)
        if ratio > _MOST_FOR_TWO_SENSORS:
            missed.append(f"an update with {name} takes {ratio:.2f} times as long")
    ratio = _settled(least["camera and scanner"]) / one
    name = f"cost_{_TWO_SENSORS_PEOPLE}_two_sensors_over_one"
    return [MeasuredValue(name, ratio, "x", "lower", 0.4)], missed


def _settled(times: np.ndarray) -> float:
    """Return the median without the first frames, which have no tracks yet."""
    return float(np.median(times[len(times) // 10 :]))


def _frames_of_two(recording: SimulatedRecording) -> list[_FrameOf]:
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
