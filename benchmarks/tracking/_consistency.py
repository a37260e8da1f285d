"""Consistency of the tracker's covariance with its errors: NEES and NIS."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from perception import PersonObservation
from tracking import PersonTracker, TrackerConfig

from ._measurements import SimulatedRecording
from ._ours import T_ODOM_CAMERA, observations
from ._walkers import FloatArray

NOISE_STD_M = 0.15


@dataclass(frozen=True, slots=True)
class Consistency:
    """Mean normalised squared errors, and the 95 % band that they should lie in.

    Attributes:
        nees: of position and velocity, mean over walkers and frames; 4 if consistent.
        nees_inside: share of frames in which the mean over walkers lies in its 95 % band.
        nis: of the innovations, mean over all; 2 if consistent.
        nis_band: 95 % band of that mean.
    """

    nees: float
    nees_inside: float
    nis: float
    nis_band: tuple[float, float]


def on_own_model(
    dt_s: float, walkers: int, frames: int, rng: np.random.Generator, config: TrackerConfig
) -> Consistency:
    """Track walkers who move by the tracker's own model, exact white acceleration.

    Every walker has a tracker of their own, so that only the filter is judged.
    """
    nees, nis = np.empty((walkers, frames)), np.empty((walkers, frames - 1))
    for walker in range(walkers):
        truth = white_acceleration_walk(dt_s, frames, rng, config)
        measured = truth[:, :2] + rng.normal(0.0, NOISE_STD_M, (frames, 2))
        nees[walker], nis[walker] = _follow_one(truth, measured, dt_s, config)
    # Walkers are independent, frames of one walker are not: one band per frame, over walkers.
    low, high = chi2.ppf([0.025, 0.975], 4 * walkers) / walkers
    mean = nees.mean(axis=0)
    band = chi2.ppf([0.025, 0.975], 2 * nis.size) / nis.size
    return Consistency(
        float(nees.mean()),
        float(((mean >= low) & (mean <= high)).mean()),
        float(nis.mean()),
        (float(band[0]), float(band[1])),
    )


def white_acceleration_walk(
    dt_s: float, frames: int, rng: np.random.Generator, config: TrackerConfig
) -> FloatArray:
    """Return states (frames, 4) drawn from the tracker's motion model and velocity prior."""
    q = config.acceleration_density_m2ps3
    root = np.linalg.cholesky(q * np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]]))
    truth = np.zeros((frames, 4))
    truth[0, 2:] = rng.normal(0.0, config.initial_velocity_std_mps, 2)
    for frame in range(1, frames):
        noise = root @ rng.normal(size=(2, 2))
        truth[frame, :2] = truth[frame - 1, :2] + dt_s * truth[frame - 1, 2:] + noise[0]
        truth[frame, 2:] = truth[frame - 1, 2:] + noise[1]
    return truth


def _follow_one(
    truth: FloatArray, measured: FloatArray, dt_s: float, config: TrackerConfig
) -> tuple[FloatArray, FloatArray]:
    """Return NEES (frames,) and NIS (frames - 1,) of one walker."""
    tracker = PersonTracker(config)
    nees, nis = np.empty(len(truth)), np.empty(len(truth) - 1)
    R = NOISE_STD_M**2 * np.eye(2)
    for frame, (state, z) in enumerate(zip(truth, measured, strict=True)):
        stamp_s = frame * dt_s
        if frame:
            (expected,) = tracker.predict(stamp_s)
            innovation = z - expected.position_odom_m
            S = expected.covariance_odom[:2, :2] + R
            nis[frame - 1] = innovation @ np.linalg.solve(S, innovation)
        (track,) = tracker.update(
            observations(z[None], stamp_s, NOISE_STD_M), stamp_s, T_ODOM_CAMERA
        )
        error = state - np.concatenate([track.position_odom_m, track.velocity_odom_mps])
        nees[frame] = error @ np.linalg.solve(track.covariance_odom, error)
    return nees, nis


def open_gates(config: TrackerConfig) -> TrackerConfig:
    """Return the settings with gates wide open, since gates cut off the tails."""
    return config.model_copy(
        update={
            "gate_probability": 1.0 - 1e-12,
            "gate_distance_m": 50.0,
            "miss_cost": 1e3,
            "confirm_hits": 1,
        }
    )


def on_walkers(recording: SimulatedRecording, config: TrackerConfig) -> dict[str, float]:
    """Return mean NEES of position (2) and of position and velocity (4) on simulated people.

    Each person is tracked alone, without clutter: the motion model is judged, not association.
    """
    rng = np.random.default_rng(0)
    four: list[float] = []
    two: list[float] = []
    predicted: list[float] = []
    ahead_s = 0.5
    dt_s = float(recording.stamps_s[1])
    ahead = round(ahead_s / dt_s)
    for person in range(recording.truth.shape[1]):
        truth = recording.truth[:, person]
        tracker = PersonTracker(open_gates(config))
        for frame, state in enumerate(truth[:-ahead]):
            stamp_s = float(recording.stamps_s[frame])
            seen: tuple[PersonObservation, ...] = ()
            if recording.visible[frame, person]:
                z = state[:2] + rng.normal(0.0, recording.noise_std_m, 2)
                seen = observations(z[None], stamp_s, recording.noise_std_m)
            tracks = tracker.update(seen, stamp_s, T_ODOM_CAMERA)
            if not tracks or frame < 20:
                continue
            track = tracks[0]
            error = state - np.concatenate([track.position_odom_m, track.velocity_odom_mps])
            four.append(float(error @ np.linalg.solve(track.covariance_odom, error)))
            P = track.covariance_odom[:2, :2]
            two.append(float(error[:2] @ np.linalg.solve(P, error[:2])))
            (later, *_) = tracker.predict(stamp_s + ahead_s)
            off = truth[frame + ahead, :2] - later.position_odom_m
            predicted.append(float(off @ np.linalg.solve(later.covariance_odom[:2, :2], off)))
    return {
        "nees_position_velocity_of_4": _mean(four),
        "nees_position_of_2": _mean(two),
        "nees_position_half_a_second_ahead_of_2": _mean(predicted),
    }


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else math.nan
