"""Starts, displacements and looks of simulated people who stand beside a robot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray
from sim_tests.actors.behaviour import (
    LOOK_WITHIN_S,
    Person,
    PersonSpec,
    RobotBody,
    Surroundings,
    habits_of,
)

#: Measured on 229 standing people within 4 m of a mobile robot: time, 99th percentile, maximum.
DISPLACEMENTS: Final = ((0.5, 0.28, 0.61), (1.0, 0.60, 1.20), (1.5, 1.00, 2.02), (2.0, 1.46, 2.83))
#: Shares of crossing pedestrians who had looked within the last s.
LOOKED: Final = ((0.5, 0.41), (1.0, 0.54), (2.0, 0.75), (3.0, 0.82))
#: Standard deviation of the yaw of the eyes in the head, shuttle data.
EYE_YAW_DEG: Final = 11.3

_RATE_HZ: Final = 20.0
_NO_BOXES: Final = np.zeros((0, 4))
# Somebody stands who has moved no farther than this in the last half second.
_STILL_M: Final = 0.1
_STOOD_FRAMES: Final = round(0.5 * _RATE_HZ)
# Somebody starts who walks this fast.
_WALKS_MPS: Final = 0.3
# The gaze rests on the robot within this angle.
_ON_TARGET_RAD: Final = math.radians(12.0)


@dataclass(frozen=True)
class Watched:
    """One person at the rate of 20 Hz.

    Attributes:
        place_m: (frames, 2).
        looks: (frames,) whether the gaze rests on the robot.
        eye_yaw_rad: (frames,) yaw of the eyes in the head.
    """

    place_m: FloatArray
    looks: np.ndarray[Any, np.dtype[np.bool_]]
    eye_yaw_rad: FloatArray


def displacements(people: str, count: int = 229, seed: int = 0) -> list[FloatArray]:
    """Return displacements after each time of :data:`DISPLACEMENTS`, of every standing instant.

    People stand 1 to 4 m beside a robot that creeps past, with nowhere to go.
    """
    found: list[list[FloatArray]] = [[] for _ in DISPLACEMENTS]
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        spec = {
            "name": "one",
            "route": [{"x_m": 0.0, "y_m": float(rng.uniform(1.0, 4.0))}],
            "heading_deg": float(rng.uniform(-180.0, 180.0)),
        }
        place_m = _places(_person(people, spec, rng), -2.0, 0.2, 20.0)
        frames = np.flatnonzero(_stands(place_m))
        for row, (after_s, *_) in enumerate(DISPLACEMENTS):
            step = round(after_s * _RATE_HZ)
            at = frames[frames + step < len(place_m)]
            off = place_m[at + step] - place_m[at]
            found[row].append(np.linalg.norm(off, axis=1))
    return [np.concatenate(values) for values in found]


def starts(
    people: str, *, yielding: bool, count: int = 400, seed: int = 0
) -> list[tuple[int, int]]:
    """Return starts and chances by the time since the last look, as in the table of the kerb.

    People on a route stand at the kerb before a robot. Each starts at most once. A chance is a
    second in which somebody stands at its beginning.

    Args:
        people: the population.
        yielding: the robot stands; else it drives.
        count: number of people.
        seed: the same seed gives the same people.
    """
    counts = [[0, 0] for _ in range(len(LOOK_WITHIN_S) + 1)]
    for number in range(count):
        rng = np.random.default_rng([seed, number, int(yielding)])
        spec = {
            "name": "one",
            "route": [{"x_m": 0.0, "y_m": y} for y in (3.0, 2.0, -6.0)],
            "pauses": [{"at_m": 1.0, "for_s": 60.0}],
            "glances": {"looker_share": 0.8, "notices_within_m": 25.0},
        }
        speed_mps = 0.0 if yielding else 0.8
        seen = watch(_person(people, spec, rng), -1.5 if yielding else -10.0, speed_mps, 12.0)
        started = _start_frame(seen.place_m)
        looked_s = -math.inf
        for frame in range(round(4.0 * _RATE_HZ), len(seen.place_m) - round(_RATE_HZ)):
            if seen.looks[frame]:
                looked_s = frame / _RATE_HZ
            if frame % round(0.25 * _RATE_HZ):
                continue
            if started is not None and frame >= started:
                break
            since = frame / _RATE_HZ - looked_s
            row = sum(since > within + 1e-9 for within in LOOK_WITHIN_S)
            counts[row][1] += 1
            counts[row][0] += started is not None and started - frame <= _RATE_HZ
    return [(begun, chances) for begun, chances in counts]


def looked_within(people: str, count: int = 300, seed: int = 0) -> list[float]:
    """Return the shares of :data:`LOOKED` of people who are about to cross before a robot."""
    ages = []
    for number in range(count):
        rng = np.random.default_rng([seed, number, 7])
        spec = {
            "name": "one",
            "route": [{"x_m": 0.0, "y_m": 14.0}, {"x_m": 0.0, "y_m": -2.0}],
            "glances": {"notices_within_m": 25.0},
            "reactions": {"walk_on": 1.0},
        }
        seen = watch(_person(people, spec, rng), -9.0, 0.8, 8.0)
        last = np.flatnonzero(seen.looks)
        ages.append((len(seen.looks) - 1 - last[-1]) / _RATE_HZ if len(last) else math.inf)
    return [float(np.mean(np.array(ages) <= within + 1e-9)) for within, _ in LOOKED]


def eye_yaw_deg(people: str, count: int = 40, seed: int = 0) -> FloatArray:
    """Return the yaw of the eyes in the head, sampled at 20 Hz, of people who cross."""
    found = []
    for number in range(count):
        rng = np.random.default_rng([seed, number, 9])
        spec = {"name": "one", "route": [{"x_m": 0.0, "y_m": y} for y in (6.0, -6.0)]}
        found.append(watch(_person(people, spec, rng), -8.0, 0.8, 9.0).eye_yaw_rad)
    return np.degrees(np.concatenate(found))


def watch(walker: Person, robot_x_m: float, robot_mps: float, for_s: float) -> Watched:
    """Watch a person beside a robot that drives along the x axis at a constant speed."""
    places, looks, eyes = [], [], []
    for frame in range(round(for_s * _RATE_HZ)):
        t_s = frame / _RATE_HZ
        x = robot_x_m + robot_mps * t_s
        motion = walker.step(t_s, _around(x, robot_mps))
        px, py = motion.position_odom_m.tolist()
        gaze = motion.heading_odom_rad + motion.head_yaw_rad + motion.eye_yaw_rad
        off = math.remainder(math.atan2(-py, x - px) - gaze, math.tau)
        places.append((px, py))
        looks.append(math.isfinite(walker.since_look_s) and abs(off) < _ON_TARGET_RAD)
        eyes.append(motion.eye_yaw_rad)
    return Watched(np.array(places), np.array(looks), np.array(eyes))


def _places(walker: Person, robot_x_m: float, robot_mps: float, for_s: float) -> FloatArray:
    """Return (frames, 2) the places of a person who is watched without feet and eyes."""
    places = []
    for frame in range(round(for_s * _RATE_HZ)):
        t_s = frame / _RATE_HZ
        walker.advance(t_s, _around(robot_x_m + robot_mps * t_s, robot_mps))
        places.append(walker.place_odom_m)
    return np.array(places)


def _around(robot_x_m: float, robot_mps: float) -> Surroundings:
    robot = RobotBody(robot_x_m, 0.0, 0.0, robot_mps, 0.0, 0.36, 0.25, (robot_x_m, 0.0, 0.8))
    return Surroundings(robot, (), _always)


def _person(people: str, spec: dict[str, Any], rng: np.random.Generator) -> Person:
    return Person(PersonSpec.model_validate(spec), rng, _NO_BOXES, habits=habits_of(people))


def _stands(place_m: FloatArray) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return (frames,) whether somebody has moved hardly at all for half a second."""
    stands = np.zeros(len(place_m), dtype=bool)
    moved = np.linalg.norm(place_m[_STOOD_FRAMES:] - place_m[:-_STOOD_FRAMES], axis=1)
    stands[_STOOD_FRAMES:] = moved <= _STILL_M
    return stands


def _start_frame(place_m: FloatArray) -> int | None:
    """Return the frame at which somebody who waits at the kerb starts; None for nobody."""
    speed = np.linalg.norm(np.diff(place_m, axis=0), axis=1) * _RATE_HZ
    waits = np.flatnonzero((place_m[:-1, 1] < 2.15) & (speed < 0.05))
    if not len(waits):
        return None
    after = np.flatnonzero(speed[waits[0] :] > _WALKS_MPS)
    return int(waits[0] + after[0]) if len(after) else None


def _always() -> bool:
    return True
