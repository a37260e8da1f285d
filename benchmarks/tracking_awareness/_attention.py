"""Simulated people who walk about in front of a robot and glance at it: the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception import AttentionCone

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RANGE_M: Final = (1.5, 8.0)
BEARING_RAD: Final = math.radians(28.0)
HEAD_ABOVE_CAMERA_M: Final = 0.4
CHEST_ABOVE_CAMERA_M: Final = 0.1

# Lengths of glances and of the pauses between them: median and spread of the logarithm of a
# lognormal whose quartiles come nearest to 0.47 and 1.50 s, and to 0.63 and 1.98 s.
GLANCE_S: Final = (0.83, 0.86)
LOOK_AWAY_S: Final = (1.03, 0.85)
TURN_S: Final = (0.2, 0.3)
# A glance need not hit the robot's centre; a person who looks away looks about where they walk.
GLANCE_OFFSET_RAD: Final = (math.radians(8.0), math.radians(5.0))
LOOK_AWAY_SPREAD_RAD: Final = math.radians(30.0)
# Least angle off the robot while looking away: nearer would be a glance.
LOOK_AWAY_RAD: Final = (math.radians(45.0), math.radians(90.0))
# Eyes wander about the head's direction, sideways and up and down, as the renderer moves them.
EYE_STD_RAD: Final = (math.radians(7.0), math.radians(3.4))
EYE_CORRELATION_S: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Attention:
    """True attention of N people over T frames, in the frame of a level camera that stands still.

    Each person is alone with the robot. Angles are (T, N, 2): yaw to the robot's left and pitch up,
    against the line from the head to the camera. (0, 0) looks straight at the robot.

    Attributes:
        stamps_s: (T,).
        heads_camera_m: (T, N, 3) points between the eyes.
        gaze_rad: direction of the eyes, which defines the true α.
        head_rad: direction of the head, which a camera can measure.
        awareness: (T, N) true α, the cone's score of the gaze.
    """

    stamps_s: FloatArray
    heads_camera_m: FloatArray
    gaze_rad: FloatArray
    head_rad: FloatArray
    awareness: FloatArray


def simulate(rng: np.random.Generator, people: int, duration_s: float, rate_hz: float) -> Attention:
    """Simulate people who walk between random places in view, stop at times, and glance about."""
    stamps = np.arange(round(duration_s * rate_hz)) / rate_hz
    heads = np.empty((len(stamps), people, 3))
    gaze = np.empty((len(stamps), people, 2))
    for person in range(people):
        heads[:, person], heading = _walk(rng, stamps)
        gaze[:, person] = _gaze_angles(rng, stamps, _heading_to_sight(heading, heads[:, person]))
    eyes = autoregressive(rng, stamps, np.full(people, EYE_CORRELATION_S), 2) * EYE_STD_RAD
    scores = AttentionCone().scores(heads, directions(heads, gaze), np.zeros(3))
    return Attention(stamps, heads, gaze, gaze - eyes, scores)


def directions(heads_camera_m: FloatArray, angles_rad: FloatArray) -> FloatArray:
    """Return unit vectors (…, 3), camera frame, of yaw and pitch (…, 2) to the line of sight."""
    sight = -heads_camera_m
    level = np.hypot(sight[..., 0], sight[..., 2])
    yaw = np.arctan2(sight[..., 0], sight[..., 2]) + angles_rad[..., 0]
    pitch = np.arctan2(-sight[..., 1], level) + angles_rad[..., 1]
    flat = np.cos(pitch)
    return np.stack((flat * np.sin(yaw), -np.sin(pitch), flat * np.cos(yaw)), axis=-1)


def autoregressive(
    rng: np.random.Generator, stamps_s: FloatArray, correlation_s: FloatArray, width: int
) -> FloatArray:
    """Return first-order autoregressive noise (T, N, width) of unit variance.

    ``correlation_s`` is (N,).
    """
    noise = rng.standard_normal((len(stamps_s), len(correlation_s), width))
    for step in range(1, len(stamps_s)):
        keep = np.exp(-(stamps_s[step] - stamps_s[step - 1]) / correlation_s)[:, None]
        noise[step] = keep * noise[step - 1] + np.sqrt(1.0 - keep**2) * noise[step]
    return noise


def _walk(rng: np.random.Generator, stamps_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return head (T, 3) and heading (T,), of +z towards +x, of a person who walks about."""
    places, times = [_place(rng)], [0.0]
    while times[-1] <= stamps_s[-1]:
        if rng.random() < 0.2:
            places.append(places[-1])
            times.append(times[-1] + rng.uniform(1.0, 4.0))
        place = _place(rng)
        length = float(np.linalg.norm(place - places[-1]))
        places.append(place)
        times.append(times[-1] + max(length, 0.1) / rng.uniform(0.8, 1.5))
    x, z = (np.interp(stamps_s, times, [place[axis] for place in places]) for axis in (0, 1))
    steps = np.diff(np.array(places), axis=0)
    heading = np.arctan2(steps[:, 0], steps[:, 1])
    leg = np.clip(np.searchsorted(times, stamps_s, side="right") - 1, 0, len(heading) - 1)
    return np.stack((x, np.full_like(x, -HEAD_ABOVE_CAMERA_M), z), axis=1), heading[leg]


def _place(rng: np.random.Generator) -> FloatArray:
    """Return a random place in view: x, z in the camera frame."""
    reach, bearing = rng.uniform(*RANGE_M), rng.uniform(-BEARING_RAD, BEARING_RAD)
    return np.array([reach * math.sin(bearing), reach * math.cos(bearing)])


def _heading_to_sight(heading: FloatArray, heads_camera_m: FloatArray) -> FloatArray:
    """Return the heading (T,) to the line of sight, in [−π, π)."""
    sight = np.arctan2(-heads_camera_m[:, 0], -heads_camera_m[:, 2])
    return (heading - sight + math.pi) % (2.0 * math.pi) - math.pi


def _gaze_angles(rng: np.random.Generator, stamps_s: FloatArray, ahead: FloatArray) -> FloatArray:
    """Return gaze angles (T, 2) that turn smoothly between the robot and elsewhere."""
    gaze = np.empty((len(stamps_s), 2))
    looks = bool(rng.random() < 0.5)
    start_s, current = 0.0, _target(rng, looks, ahead[0])
    while start_s <= stamps_s[-1]:
        median, spread = GLANCE_S if looks else LOOK_AWAY_S
        end_s = start_s + rng.lognormal(math.log(median), spread)
        first, last = np.searchsorted(stamps_s, (start_s, end_s))
        target = _target(rng, looks, ahead[min(first, len(ahead) - 1)])
        turn_s = rng.uniform(*TURN_S)

        since_s = np.append(stamps_s[first:last], end_s) - start_s
        turned = _smooth_turn(since_s / turn_s, current, target)
        gaze[first:last] = turned[:-1]
        start_s, looks, current = end_s, not looks, turned[-1]
    return gaze


def _smooth_turn(share: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return angles (K, 2) after shares (K,) of a turn that begins and ends smoothly."""
    share = np.clip(share, 0.0, 1.0)[:, None]
    return np.asarray(start + share * share * (3.0 - 2.0 * share) * (end - start))


def _target(rng: np.random.Generator, looks: bool, ahead_rad: float) -> FloatArray:
    """Return the gaze angles (2,) of the next glance at the robot or look elsewhere."""
    offset = rng.normal(0.0, GLANCE_OFFSET_RAD)
    if looks:
        return offset
    yaw = (ahead_rad + rng.normal(0.0, LOOK_AWAY_SPREAD_RAD) + math.pi) % (2.0 * math.pi) - math.pi
    if abs(yaw) < LOOK_AWAY_RAD[1]:
        yaw = math.copysign(rng.uniform(*LOOK_AWAY_RAD), yaw)
    return np.array([yaw, offset[1]])
