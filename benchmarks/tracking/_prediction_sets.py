"""Tracks of recorded and simulated people, each with the places where the person was later."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from tracking import PersonTracker, TrackerConfig

from ._consistency import open_gates
from ._ours import T_ODOM_CAMERA, observations
from ._recorded import recordings_in, walks_of
from ._walkers import FloatArray, walk

#: Horizons of the table, seconds.
HORIZONS_S: Final = np.array([0.2, 0.5, 1.0, 1.5, 2.0])
MISS_PROBABILITY: Final = 0.1
# Tracks are judged from this age on, every so often.
_WARM_UP_S, _EVERY_S = 1.0, 0.1
# Simulated crowds: people, length of a run, and rate of the truth.
_WALKERS, _WALKERS_S, _TRUTH_HZ = 12, 15.0, 30.0
# All people of a set share one tracker, so far apart that they never meet.
_TILE_M: Final = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredWalk:
    """One person: the truth, and what a sensor measured of it.

    Attributes:
        group: clip or run that the person belongs to.
        stamps_s: (n,) of the frames, from 0 on.
        measured_m: (n, 2), NaN where the frame missed the person.
        noise_std_m: of a measured position, on each axis.
        truth_s: (m,) stamps of the truth.
        truth_m: (m, 2) places.
        gazes_rad: (m, 2) directions in odom of gaze and body; None where nothing is known of them.
        looks: (m,) whether the person looks at the robot; None likewise.
    """

    group: int
    stamps_s: FloatArray
    measured_m: FloatArray
    noise_std_m: float
    truth_s: FloatArray
    truth_m: FloatArray
    gazes_rad: FloatArray | None = None
    looks: FloatArray | None = None

    def places_m(self, stamps_s: FloatArray) -> FloatArray:
        """Return the true places (T, 2), NaN after the end."""
        places = np.column_stack(
            [np.interp(stamps_s, self.truth_s, self.truth_m[:, axis]) for axis in (0, 1)]
        )
        places[stamps_s > self.truth_s[-1] + 1e-9] = np.nan
        return places


@dataclass(frozen=True, slots=True, eq=False)
class TrackedInstants:
    """K instants of tracked people.

    Attributes:
        groups: (K,) of the walks.
        walks: (K,) index of the walk.
        stamps_s: (K,).
        states: (K, 4) of the tracks, x, y, vx, vy, in the frame of the truth.
        covariances: (K, 4, 4).
        later_m: (K, T, 2) true places at the horizons, NaN after the end.
    """

    groups: FloatArray
    walks: FloatArray
    stamps_s: FloatArray
    states: FloatArray
    covariances: FloatArray
    later_m: FloatArray

    def take(self, keep: FloatArray) -> TrackedInstants:
        """Return the instants where ``keep`` (K,) is True, or those of an index."""
        return TrackedInstants(
            self.groups[keep],
            self.walks[keep],
            self.stamps_s[keep],
            self.states[keep],
            self.covariances[keep],
            self.later_m[keep],
        )


def recorded_walks(
    folder: Path, rate_hz: float, noise_std_m: float, seed: int
) -> list[MeasuredWalk]:
    """Return the people of every CSV in a folder, measured; each file is a group."""
    made = []
    for group, path in enumerate(recordings_in(folder)):
        for person, samples in enumerate(walks_of(path)):
            rng = np.random.default_rng([seed, group, person])
            stamps_s = samples[:, 0] - samples[0, 0]
            made.append(_measured(group, stamps_s, samples[:, 1:], rate_hz, noise_std_m, rng))
    return made


def simulated_walks(rate_hz: float, noise_std_m: float, seeds: Sequence[int]) -> list[MeasuredWalk]:
    """Return the walkers of the benchmark, measured; each seed is a group."""
    made = []
    for seed in seeds:
        rng = np.random.default_rng([seed, 25])
        truth_s = np.arange(0.0, _WALKERS_S, 1.0 / _TRUTH_HZ)
        truth = walk(_WALKERS, truth_s, rng)
        made += [
            _measured(seed, truth_s, truth[:, person, :2], rate_hz, noise_std_m, rng)
            for person in range(_WALKERS)
        ]
    return made


def _measured(
    group: int,
    truth_s: FloatArray,
    truth_m: FloatArray,
    rate_hz: float,
    noise_std_m: float,
    rng: np.random.Generator,
) -> MeasuredWalk:
    stamps_s = np.arange(0.0, truth_s[-1], 1.0 / rate_hz)
    walked = MeasuredWalk(group, stamps_s, np.empty((0, 2)), noise_std_m, truth_s, truth_m)
    measured = walked.places_m(stamps_s) + rng.normal(0.0, noise_std_m, (len(stamps_s), 2))
    measured[rng.random(len(stamps_s)) < MISS_PROBABILITY] = np.nan
    return MeasuredWalk(group, stamps_s, measured, noise_std_m, truth_s, truth_m)


def track(walks: Sequence[MeasuredWalk], config: TrackerConfig) -> TrackedInstants:
    """Track every person alone, without clutter: the motion model is judged, not association."""
    tracker = PersonTracker(open_gates(config))
    tiles = np.column_stack([_TILE_M * np.arange(len(walks)), np.zeros(len(walks))])
    stamps_s = max((each.stamps_s for each in walks), key=len)
    rows: list[tuple[int, float, FloatArray, FloatArray]] = []
    noise_m = walks[0].noise_std_m
    for frame, stamp_s in enumerate(stamps_s.tolist()):
        seen = [
            each.measured_m[frame] + tile
            for each, tile in zip(walks, tiles, strict=True)
            if frame < len(each.stamps_s) and np.isfinite(each.measured_m[frame, 0])
        ]
        frames = observations(np.array(seen).reshape(-1, 2), stamp_s, noise_m)
        tracks = tracker.update(frames, stamp_s, T_ODOM_CAMERA)
        if not _is_judged(stamp_s, stamps_s[1]):
            continue
        for each in tracks:
            index = round(float(each.position_odom_m[0]) / _TILE_M)
            if stamp_s + HORIZONS_S[0] <= walks[index].truth_s[-1]:
                place = each.position_odom_m - tiles[index]
                state = np.concatenate([place, each.velocity_odom_mps])
                rows.append((index, stamp_s, state, each.covariance_odom))
    order = sorted(range(len(rows)), key=lambda row: rows[row][:2])
    chosen = [rows[row] for row in order]
    return TrackedInstants(
        np.array([walks[index].group for index, *_ in chosen]),
        np.array([index for index, *_ in chosen]),
        np.array([stamp_s for _, stamp_s, *_ in chosen]),
        np.array([state for *_, state, _ in chosen]),
        np.array([covariance for *_, covariance in chosen]),
        np.array([walks[index].places_m(stamp_s + HORIZONS_S) for index, stamp_s, *_ in chosen]),
    )


def _is_judged(stamp_s: float, dt_s: float) -> bool:
    """Return whether the frame at a stamp is the first after a multiple of the interval."""
    if stamp_s < _WARM_UP_S:
        return False
    return int(stamp_s / _EVERY_S + 1e-6) > int((stamp_s - dt_s) / _EVERY_S + 1e-6)


def judged_frames(each: MeasuredWalk) -> Iterator[int]:
    """Yield the frames of a walk at which :func:`track` judges."""
    for frame, stamp_s in enumerate(each.stamps_s.tolist()):
        if _is_judged(stamp_s, float(each.stamps_s[1])):
            yield frame
