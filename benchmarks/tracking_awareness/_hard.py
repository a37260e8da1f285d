"""A harder simulation, independent of the other: passers-by, missed frames, a wrong σ.

It shares containers with ``_attention`` and ``_camera``, but no model. The README describes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ._attention import Attention, BoolArray, FloatArray, autoregressive
from ._camera import Measured, spells

RATES_HZ: Final = (5.0, 10.0, 15.0, 30.0)
CHEST_M: Final = -0.1

# Walks: range at which a person comes into view (m), pace (m/s), lateral offset of somebody who
# comes towards the robot and range of somebody who crosses (m), and pause until the next one (s).
START_M, PACE_MPS = (6.0, 9.0), (0.8, 1.6)
LATERAL_M, CROSSING_M = (0.6, 2.0), (2.0, 5.0)
CROSSING_SHARE: Final = 0.3
BEARING_RAD, NEAR_M = math.radians(33.0), 0.8
PAUSE_S: Final = (3.5, 6.0)

# Semi-Markov attention: mean (s) and shape of gamma-distributed stretches; turns of the head (s).
LOOK_S, AWAY_S = (1.2, 2.0), (2.2, 2.0)
TURN_S: Final = (0.15, 0.35)
LOOK_ALPHA: Final = (0.55, 1.0)
# Looks away: share that passes the robot narrowly, and α of those.
NEAR_MISSES, NEAR_ALPHA = 0.25, (0.0, 0.2)

# Error of α: standard deviation by person, rise with range, share that lasts and for how long.
ERROR_STD: Final = (0.13, 0.26)
LASTING_SHARE, LASTING_S = 0.6, (0.2, 0.6)
# Wrong heads, such as a back taken for a face: mean time between, shortest, longest (s), and α.
WRONG_S, WRONG_ALPHA = (6.0, 0.1, 0.3), (0.3, 1.0)
# Reported σ: the true one times a factor that wanders between these, with this correlation time.
STD_FACTOR, STD_FACTOR_S = (0.5, 2.0), 1.5

# Missed frames: share per person; bursts and hidden spells: mean time between, shortest, longest.
MISSES: Final = (0.2, 0.3)
BURST_S, HIDDEN_S = (4.0, 0.1, 0.4), (8.0, 0.5, 2.0)
# Share of the frames of a person who looks away in which the face does not show.
AWAY_WITHOUT_FACE: Final = 0.3


@dataclass(frozen=True, slots=True)
class HardSet:
    """Passers-by and their measurements.

    Attributes:
        rate_hz: of the camera.
        attention: true α; NaN while nobody is there.
        measured: what the camera shows of them.
        in_sight: (T, N) True where a person is there and not hidden, detected or not.
    """

    rate_hz: float
    attention: Attention
    measured: Measured
    in_sight: BoolArray


def make_hard_set(seed: int, rate_hz: float, people: int, duration_s: float) -> HardSet:
    """Return a set of passers-by, which depends on its arguments alone."""
    rng = np.random.default_rng([seed, 20, round(rate_hz)])
    stamps = np.arange(round(duration_s * rate_hz)) / rate_hz
    shape = (len(stamps), people)
    heads, alpha, there = np.empty((*shape, 3)), np.empty(shape), np.empty(shape, dtype=bool)
    for person in range(people):
        heads[:, person], there[:, person] = _passes(rng, stamps)
        alpha[:, person] = _looks(rng, stamps)
    hidden = spells(rng, stamps, people, HIDDEN_S)
    in_sight = there & ~hidden
    missed = rng.random(shape) < rng.uniform(*MISSES, people)
    seen = in_sight & ~missed & ~spells(rng, stamps, people, BURST_S)
    measured_alpha, std = _measured_alpha(rng, stamps, alpha, np.linalg.norm(heads, axis=2))
    faceless = (alpha < 0.2) & (rng.random(shape) < AWAY_WITHOUT_FACE)
    blind = ~seen | faceless
    measured_alpha[blind], std[blind] = np.nan, np.nan
    reach = np.linalg.norm(heads, axis=2)[..., None]
    ray = heads / reach
    noise = 0.01 * reach * rng.standard_normal(heads.shape)
    noise += 0.04 * reach * ray * rng.standard_normal(reach.shape)
    covariance = reach[..., None] ** 2 * (
        0.01**2 * np.eye(3) + 0.04**2 * ray[..., :, None] * ray[..., None, :]
    )
    truth = np.where(there, alpha, np.nan)
    angles = np.zeros((*shape, 2))
    return HardSet(
        rate_hz,
        Attention(stamps, heads, angles, angles, truth),
        Measured(seen, measured_alpha, std, heads + noise, covariance, np.zeros(shape)),
        in_sight,
    )


def _passes(rng: np.random.Generator, stamps_s: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return places (T, 3) of one passer-by after another and (T,) where somebody is there."""
    places = np.tile((0.0, CHEST_M, START_M[1]), (len(stamps_s), 1))
    there = np.zeros(len(stamps_s), dtype=bool)
    now_s = rng.uniform(0.0, PAUSE_S[1])
    while now_s < stamps_s[-1]:
        pace, side = rng.uniform(*PACE_MPS), rng.choice((-1.0, 1.0))
        if rng.random() < CROSSING_SHARE:
            z = rng.uniform(*CROSSING_M)
            start = np.array([side * z * math.tan(BEARING_RAD), z])
            velocity = np.array([-side * pace, 0.0])
        else:
            start = np.array([side * rng.uniform(*LATERAL_M), rng.uniform(*START_M)])
            velocity = np.array([0.0, -pace])
        path = start + (stamps_s - now_s)[:, None] * velocity
        bearing = np.abs(np.arctan2(path[:, 0], path[:, 1]))
        inside = (stamps_s >= now_s) & (bearing <= BEARING_RAD + 1e-9) & (path[:, 1] > NEAR_M)
        there |= inside
        places[inside] = np.insert(path[inside], 1, CHEST_M, axis=1)
        end_s = stamps_s[inside][-1] if inside.any() else now_s
        now_s = end_s + rng.uniform(*PAUSE_S)
    return places, there


def _looks(rng: np.random.Generator, stamps_s: FloatArray) -> FloatArray:
    """Return true α (T,): semi-Markov looks at the robot and away, with turns in between."""
    times, levels = [0.0], [0.0]
    looks = bool(rng.random() < 0.4)
    now_s = 0.0
    while now_s <= stamps_s[-1]:
        mean_s, shape = LOOK_S if looks else AWAY_S
        turn_s = rng.uniform(*TURN_S)
        end_s = now_s + max(rng.gamma(shape, mean_s / shape), 0.5)
        if looks:
            level = rng.uniform(*LOOK_ALPHA)
        else:
            level = rng.uniform(*NEAR_ALPHA) if rng.random() < NEAR_MISSES else 0.0
        times += [now_s + turn_s, end_s]
        levels += [level, level]
        now_s, looks = end_s, not looks
    return np.interp(stamps_s, times, levels)


def _measured_alpha(
    rng: np.random.Generator, stamps_s: FloatArray, alpha: FloatArray, range_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return measured α and its reported σ, both (T, N)."""
    people = alpha.shape[1]
    std = rng.uniform(*ERROR_STD, people) * (0.6 + 0.1 * range_m)
    lasting = autoregressive(rng, stamps_s, rng.uniform(*LASTING_S, people), 1)[..., 0]
    noise = math.sqrt(LASTING_SHARE) * lasting
    noise += math.sqrt(1.0 - LASTING_SHARE) * rng.standard_normal(alpha.shape)
    measured = np.clip(alpha + std * noise, 0.0, 1.0)
    wrong = spells(rng, stamps_s, people, WRONG_S)
    measured[wrong] = rng.uniform(*WRONG_ALPHA, int(wrong.sum()))
    # A uniform share of the way between the least and the largest factor, in logarithms.
    wander = autoregressive(rng, stamps_s, np.full(people, STD_FACTOR_S), 1)[..., 0]
    share = 0.5 * (1.0 + np.tanh(0.8 * wander))
    return measured, std * STD_FACTOR[0] * (STD_FACTOR[1] / STD_FACTOR[0]) ** share
