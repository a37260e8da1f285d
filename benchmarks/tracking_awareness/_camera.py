"""A simulated camera: measured α ± σ and positions, with the errors of the shipped networks.

The direction error has three parts: a bias of each person in each pose, an error that lasts for
some tenths of a second, and one that is new in every frame. Their size is that of the first shipped
networks on people they have not seen: median 4.9°, 90th percentile 13°, from 3.7° for faces in
front to 8.3° for backs. α and σ follow from the errors by the pipeline's own mathematics.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception import AttentionCone, HeadPose, PersonObservation
from perception.awareness import estimate_awareness
from tracking import PersonTracker, TrackerConfig

from ._attention import (
    CHEST_ABOVE_CAMERA_M,
    EYE_STD_RAD,
    HEAD_ABOVE_CAMERA_M,
    Attention,
    BoolArray,
    FloatArray,
    autoregressive,
    directions,
)

# Standard deviation of either angle for a near head in front view, in profile and from behind.
ASPECT_RAD: Final = np.radians((0.0, 90.0, 180.0))
ASPECT_STD_RAD: Final = np.radians((3.1, 4.1, 7.0))
# Shares of the variance of the bias and of the lasting error.
BIAS_SHARE, LASTING_SHARE = 0.3, 0.4
LASTING_S: Final = (0.2, 0.5)
OUTLIERS: Final = 0.015
PERSON_SPREAD: Final = 0.3
#: Factor on the reported σ, chosen so that 68 % of the errors of α lie within it.
REPORTED_STD_FACTOR: Final = 1.15
MISSES: Final = 0.1
FOCAL_PX: Final = 554.0  # 640 pixels at 60°
FACE_WIDTH_M: Final = 0.156
FACE_EDGE_RAD, FACE_SOFTNESS_RAD = math.radians(98.0), math.radians(5.0)
# Spells: mean time between them, shortest and longest (s).
UNSEEN_S: Final = (8.0, 0.5, 2.0)
NO_FACE_S: Final = (10.0, 0.3, 1.5)
_BATCH: Final = 2000


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Measurements of N people in T frames.

    Attributes:
        seen: (T, N) True where the frame shows the person.
        awareness: (T, N) measured α; NaN where no face or no person is seen.
        awareness_std: (T, N) σ of α; NaN likewise.
        chests_camera_m: (T, N, 3) measured positions.
        chest_covariances_m2: (T, N, 3, 3) covariances of the positions.
        error_rad: (T, N) angle between the measured and the true direction of the head.
    """

    seen: BoolArray
    awareness: FloatArray
    awareness_std: FloatArray
    chests_camera_m: FloatArray
    chest_covariances_m2: FloatArray
    error_rad: FloatArray


def measure(attention: Attention, rng: np.random.Generator) -> Measured:
    """Measure simulated people."""
    frames, people = attention.awareness.shape
    stamps, heads = attention.stamps_s, attention.heads_camera_m
    aspect = _angle(attention.head_rad)
    distance = np.linalg.norm(heads, axis=2)
    extra = math.radians(20.0) * (12.0 * distance / (FOCAL_PX * FACE_WIDTH_M)) ** 4
    std = np.interp(aspect, ASPECT_RAD, ASPECT_STD_RAD)
    std *= np.sqrt(0.5 + 0.5 * (distance / 4.0) ** 2)
    # The pipeline's term for small faces is cautious: the true error is half of it.
    true_std = np.sqrt(std**2 + (0.5 * extra) ** 2)
    # Some people are measured better than others; the reported σ does not show that.
    true_std *= np.exp(rng.normal(0.0, PERSON_SPREAD, people))
    lasting = autoregressive(rng, stamps, np.asarray(rng.uniform(*LASTING_S, people)), 2)
    noise = (
        math.sqrt(BIAS_SHARE) * _bias(rng, attention.head_rad[..., 0])
        + math.sqrt(LASTING_SHARE) * lasting
        + math.sqrt(1.0 - BIAS_SHARE - LASTING_SHARE) * rng.standard_normal(lasting.shape)
    )
    angles = attention.head_rad + noise * true_std[..., None]
    wrong = rng.random((frames, people)) < OUTLIERS
    angles[wrong, 0] = rng.uniform(-math.pi, math.pi, int(wrong.sum()))
    reported_std = REPORTED_STD_FACTOR * std * np.exp(rng.normal(0.0, 0.2, std.shape))

    missed = rng.random((frames, people)) < MISSES
    unseen = missed | spells(rng, stamps, people, UNSEEN_S)
    no_face = unseen | spells(rng, stamps, people, NO_FACE_S)
    alpha, alpha_std = _awareness(heads, angles, reported_std, extra, ~no_face)
    chests, covariances = _measured_chests(rng, heads)
    measured, true = directions(heads, angles), directions(heads, attention.head_rad)
    error = np.arccos(np.clip((measured * true).sum(axis=2), -1.0, 1.0))
    return Measured(~unseen, alpha, alpha_std, chests, covariances, error)


def track(
    attention: Attention, measured: Measured, config: TrackerConfig
) -> tuple[FloatArray, FloatArray]:
    """Return awareness and awareness_lower (T, N) of the real tracker; 0 without a track.

    Each person has a lane far from the others', so that all can share one tracker. Where a person
    has two tracks, the awareness is that of the track seen last, and the bound is the higher one.
    """
    lane_m = 100.0
    T_odom_camera = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1.0]])
    tracker = PersonTracker(config)
    awareness = np.zeros(attention.awareness.shape)
    lower = np.zeros(attention.awareness.shape)
    for row, stamp_s in enumerate(attention.stamps_s.tolist()):
        observations = [
            _observation(measured, row, person, stamp_s, lane_m)
            for person in np.flatnonzero(measured.seen[row]).tolist()
        ]
        since_s = np.full(measured.seen.shape[1], math.inf)
        for one in tracker.update(observations, stamp_s, T_odom_camera):
            if one.status != "tentative":
                person = round(-float(one.position_odom_m[1]) / lane_m)
                if one.time_since_seen_s <= since_s[person]:
                    awareness[row, person], since_s[person] = one.awareness, one.time_since_seen_s
                lower[row, person] = max(lower[row, person], one.awareness_lower)
    return awareness, lower


def _observation(
    measured: Measured, row: int, person: int, stamp_s: float, lane_m: float
) -> PersonObservation:
    alpha = float(measured.awareness[row, person])
    known = not math.isnan(alpha)
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=measured.chests_camera_m[row, person] + (person * lane_m, 0.0, 0.0),
        position_covariance_m2=measured.chest_covariances_m2[row, person],
        gaze_camera=None,
        awareness=alpha if known else None,
        awareness_std=float(measured.awareness_std[row, person]) if known else None,
        score=0.9,
    )


def _angle(angles_rad: FloatArray) -> FloatArray:
    """Return the angle (…,) of yaw and pitch (…, 2) to the nearly level line of sight."""
    cosine = np.cos(angles_rad[..., 0]) * np.cos(angles_rad[..., 1])
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _bias(rng: np.random.Generator, yaw_rad: FloatArray) -> FloatArray:
    """Return an error (T, N, 2) of unit variance: for each person a smooth function of the pose."""
    people, waves = yaw_rad.shape[1], np.arange(1, 4)
    weights = rng.standard_normal((2, people, 2, len(waves))) / math.sqrt(len(waves))
    phase = yaw_rad[..., None, None] * waves
    return np.asarray((weights[0] * np.cos(phase) + weights[1] * np.sin(phase)).sum(axis=-1))


def spells(
    rng: np.random.Generator, stamps_s: FloatArray, people: int, kind: tuple[float, float, float]
) -> BoolArray:
    """Return (T, N), True within spells that come at random."""
    between_s, shortest_s, longest_s = kind
    inside = np.zeros((len(stamps_s), people), dtype=bool)
    for person in range(people):
        now_s = rng.exponential(between_s)
        while now_s < stamps_s[-1]:
            end_s = now_s + rng.uniform(shortest_s, longest_s)
            inside[(stamps_s >= now_s) & (stamps_s < end_s), person] = True
            now_s = end_s + rng.exponential(between_s)
    return inside


def _awareness(
    heads: FloatArray, angles: FloatArray, std: FloatArray, extra: FloatArray, shown: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return measured α and σ by the pipeline's mathematics, NaN where no face is seen."""
    alpha, alpha_std = np.full(std.shape, np.nan), np.full(std.shape, np.nan)
    rows, people = np.nonzero(shown)
    gaze = directions(heads, angles)[rows, people]
    right = np.cross((0.0, 1.0, 0.0), gaze)
    right /= np.linalg.norm(right, axis=1)[:, None]
    rotations = np.stack((np.cross(gaze, right), gaze, right), axis=2)
    covariances = np.zeros((len(rows), 6, 6))
    axes = np.arange(6)
    covariances[:, axes[:3], axes[:3]] = std[rows, people, None] ** 2
    covariances[:, axes[3:], axes[3:]] = 0.02**2
    face = 1.0 / (1.0 + np.exp((_angle(angles[rows, people]) - FACE_EDGE_RAD) / FACE_SOFTNESS_RAD))
    for first in range(0, len(rows), _BATCH):
        part = slice(first, first + _BATCH)
        made = estimate_awareness(
            AttentionCone(),
            [
                HeadPose(place, rotation, covariance, 1.0)
                for place, rotation, covariance in zip(
                    heads[rows[part], people[part]], rotations[part], covariances[part], strict=True
                )
            ],
            np.zeros((1, 3)),
            extra_std_rad=extra[rows[part], people[part]],
            eye_in_head_std_rad=EYE_STD_RAD,
            face_seen=face[part],
        )
        alpha[rows[part], people[part]] = [one.awareness for one in made]
        alpha_std[rows[part], people[part]] = [one.awareness_std for one in made]
    return alpha, alpha_std


def _measured_chests(rng: np.random.Generator, heads: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return measured chests and their covariances: 4 % of the range along the ray, 1 % across."""
    chests = heads + np.array([0.0, HEAD_ABOVE_CAMERA_M - CHEST_ABOVE_CAMERA_M, 0.0])
    reach = np.linalg.norm(chests, axis=2)[..., None]
    ray = chests / reach
    noise = reach * 0.01 * rng.standard_normal(chests.shape)
    noise += ray * reach * math.sqrt(0.04**2 - 0.01**2) * rng.standard_normal(reach.shape)
    outer = ray[..., :, None] * ray[..., None, :]
    covariance = (reach[..., None] ** 2) * (0.01**2 * np.eye(3) + (0.04**2 - 0.01**2) * outer)
    return chests + noise, covariance
