"""Value of gaze and body heading for the prediction, on the simulator's people."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from sim_tests.actors.behaviour import (
    DECISION_PERIOD_S,
    MovingBody,
    PersonSpec,
    RobotBody,
    Surroundings,
    Walker,
)
from tracking import TrackerConfig

from ._prediction_sets import HORIZONS_S, MISS_PROBABILITY, MeasuredWalk, track
from ._walkers import FloatArray

_PEOPLE, _SECONDS = 6, 16.0
_HALF_SIDE_M: Final = 7.0
_NOISE_M, _RATE_HZ = 0.05, 20.0
#: A head pose that is estimated from a good view.
_GAZE_STD_RAD: Final = math.radians(6.0)
_LOOKS_WITHIN_RAD: Final = math.radians(12.0)
_WALKING_MPS: Final = 0.3
#: Predictors by name: which of the columns of :func:`_features` they use.
PREDICTORS: Final = {
    "gaze": (2,),
    "gaze, looks at the robot": (2, 3),
    "body heading": (1,),
    "body heading, gaze": (1, 2),
}


def gaze_gains(seeds_fit: range, seeds_judged: range) -> dict[str, FloatArray]:
    """Return the mean error (T,) in metres of each predictor, fitted and judged on other crowds.

    Every predictor adds a linear correction to constant velocity, along the walking direction and
    across it. ``"constant velocity"`` is the error without one.
    """
    fitted, judged = _cases(seeds_fit), _cases(seeds_judged)
    found = {"constant velocity": np.nanmean(np.linalg.norm(judged[1], axis=2), axis=0)}
    for name, columns in PREDICTORS.items():
        errors = np.empty(len(HORIZONS_S))
        for column, horizon_s in enumerate(HORIZONS_S.tolist()):
            known = ~np.isnan(fitted[1][:, column, 0])
            inputs = horizon_s * fitted[0][known][:, :, columns]
            left = judged[1][:, column].copy()
            for axis in (0, 1):
                weights, *_ = np.linalg.lstsq(
                    inputs[:, axis], fitted[1][known, column, axis], rcond=None
                )
                left[:, axis] -= horizon_s * judged[0][:, axis][:, columns] @ weights
            errors[column] = np.nanmean(np.linalg.norm(left, axis=1))
        found[name] = errors
    return found


def gazing_walks(seed: int) -> list[MeasuredWalk]:
    """Return people of the simulator who cross before a robot, with their gaze and heading."""
    rng = np.random.default_rng([seed, 90])
    people = [
        Walker(_spec(index, rng), rng.spawn(1)[0], np.empty((0, 4))) for index in range(_PEOPLE)
    ]
    stamps_s = np.arange(0.0, _SECONDS, DECISION_PERIOD_S)
    places = np.zeros((_PEOPLE, len(stamps_s), 2))
    angles, looks = np.zeros_like(places), np.zeros(places.shape[:2])
    bodies = [MovingBody(50.0 + index, 0.0, 0.0, 0.0) for index in range(_PEOPLE)]
    for frame, stamp_s in enumerate(stamps_s.tolist()):
        robot = _robot(stamp_s)
        now = list(bodies)
        for index, person in enumerate(people):
            others = tuple(now[:index] + now[index + 1 :])
            motion = person.motion(stamp_s, Surroundings(robot, others, lambda: True))
            x, y = motion.position_odom_m.tolist()
            bodies[index] = MovingBody(x, y, *motion.velocity_odom_mps.tolist())
            gaze = motion.heading_odom_rad + motion.head_yaw_rad + motion.eye_yaw_rad
            places[index, frame] = x, y
            angles[index, frame] = gaze, motion.heading_odom_rad
            towards = math.atan2(robot.y_m - y, robot.x_m - x)
            off = abs(math.remainder(gaze - towards, math.tau))
            looks[index, frame] = float(off < _LOOKS_WITHIN_RAD)
    made = []
    for index in range(_PEOPLE):
        measured = places[index] + rng.normal(0.0, _NOISE_M, places[index].shape)
        measured[rng.random(len(stamps_s)) < MISS_PROBABILITY] = np.nan
        seen = angles[index] + _GAZE_STD_RAD * rng.normal(size=(len(stamps_s), 2))
        made.append(
            MeasuredWalk(
                seed, stamps_s, measured, _NOISE_M, stamps_s, places[index], seen, looks[index]
            )
        )
    return made


def _spec(index: int, rng: np.random.Generator) -> PersonSpec:
    corners = rng.uniform(-_HALF_SIDE_M, _HALF_SIDE_M, (5, 2))
    route = [{"x_m": x, "y_m": y} for x, y in corners.tolist()]
    pauses = [{"at_m": float(rng.uniform(2.0, 8.0)), "for_s": float(rng.uniform(1.0, 3.0))}]
    return PersonSpec.model_validate(
        {
            "name": f"person {index}",
            "route": route,
            "speed_mps": float(np.clip(rng.normal(1.34, 0.2), 0.7, 2.0)),
            "pauses": pauses if rng.random() < 0.4 else [],
        }
    )


def _robot(stamp_s: float) -> RobotBody:
    """Return a robot that drives back and forth through the middle at 1 m/s."""
    phase = stamp_s % (4.0 * _HALF_SIDE_M)
    there = phase < 2.0 * _HALF_SIDE_M
    x = phase - _HALF_SIDE_M if there else 3.0 * _HALF_SIDE_M - phase
    speed = 1.0 if there else -1.0
    heading = 0.0 if there else math.pi
    return RobotBody(x, 0.0, heading, speed, 0.0, 0.36, 0.25, (x, 0.0, 1.4))


def _cases(seeds: range) -> tuple[FloatArray, FloatArray]:
    """Return features (K, 2, F) and errors (K, T, 2) of walking people, along and across."""
    walks = [each for seed in seeds for each in gazing_walks(seed)]
    instants = track(walks, TrackerConfig())
    speeds = np.hypot(instants.states[:, 2], instants.states[:, 3])
    instants = instants.take(speeds > _WALKING_MPS)
    velocity = instants.states[:, 2:]
    speeds = np.hypot(velocity[:, 0], velocity[:, 1])
    ahead = velocity / speeds[:, None]
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    frames = np.round(instants.stamps_s / DECISION_PERIOD_S).astype(int)
    angles, looks = np.empty((len(frames), 2)), np.empty(len(frames))
    for row, (walk, frame) in enumerate(zip(instants.walks, frames, strict=True)):
        each = walks[walk]
        assert each.gazes_rad is not None
        assert each.looks is not None
        angles[row], looks[row] = each.gazes_rad[frame], each.looks[frame]
    features = _features(velocity, speeds, angles, looks)
    straight = instants.states[:, None, :2] + HORIZONS_S[:, None] * velocity[:, None]
    error = instants.later_m - straight
    turned = np.stack([(error * ahead[:, None]).sum(2), (error * aside[:, None]).sum(2)], axis=2)
    return features, turned


def _features(
    velocity: FloatArray, speeds: FloatArray, angles: FloatArray, looks: FloatArray
) -> FloatArray:
    """Return (K, 2, 4): speed, body heading, gaze and a look at the robot, along and across."""
    walking = np.arctan2(velocity[:, 1], velocity[:, 0])
    gaze, body = (angles - walking[:, None]).T
    along = [speeds, speeds * (np.cos(body) - 1.0), speeds * (np.cos(gaze) - 1.0), speeds * looks]
    # Across, a speed alone says nothing about the side.
    across = [0.0 * speeds, speeds * np.sin(body), speeds * np.sin(gaze), looks * np.sin(gaze)]
    return np.stack([np.stack(along, axis=1), np.stack(across, axis=1)], axis=1)
