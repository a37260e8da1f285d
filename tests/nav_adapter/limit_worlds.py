"""Worlds with adversarial people in continuous time, and the limit by brute force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nav_adapter import RobotProfile
from nav_adapter.course import Course, course_of
from nav_adapter.limit import limit_mps
from nav_adapter.reach import Reach
from nav_adapter.rigid import Motion
from perception.arrays import FloatArray

BODY_M = 0.30
CLEARANCE_M = 0.10
_STEP_S = 0.01


@dataclass(frozen=True)
class Outcome:
    """The outcome of some worlds: how many robots moved, and who touched one."""

    worlds: int
    moving: int
    contacts: int
    fastest_mps: float


def drawn_robot(rng: np.random.Generator) -> RobotProfile:
    """Draw a rectangular robot whose base need not be in its middle."""
    front, rear, half = rng.uniform(0.1, 0.9), -rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.6)
    return RobotProfile(
        footprint_m=[(front, half), (front, -half), (rear, -half), (rear, half)],
        max_speed_mps=rng.uniform(0.6, 2.5),
        max_acceleration_mps2=1.0,
        max_deceleration_mps2=rng.uniform(0.4, 2.0),
        reaction_time_s=rng.uniform(0.0, 0.6),
        drive="differential",
    )


@dataclass(frozen=True)
class _Worlds:
    """Robots that obey the limit, or drive ``v0`` at least, each beside one person."""

    robot: RobotProfile
    turn_rad: float
    tau: float
    delay: float
    age: float
    v0: FloatArray
    curvature: FloatArray
    place: FloatArray
    velocity: FloatArray
    top: FloatArray


def _drawn(rng: np.random.Generator, worlds: int) -> _Worlds:
    robot = drawn_robot(rng)
    turn_rad = math.radians(rng.uniform(0.0, 45.0))
    tau, delay, age = rng.uniform(0.3, 0.8), rng.uniform(0.0, 0.3), float(rng.choice([0.0, 0.1]))
    rows = []
    for _ in range(worlds):
        top = float(rng.choice([0.0, 0.5, 1.5]))
        distance, walk = rng.uniform(0.3, 5.0), rng.uniform(0.0, max(top, 1.0))
        bearing, direction = rng.uniform(-math.pi, math.pi, 2).tolist()
        where = (distance * math.cos(bearing), distance * math.sin(bearing))
        motion = (walk * math.cos(direction), walk * math.sin(direction))
        person = Reach(
            *(*where, *motion, top, tau, delay, age, BODY_M + CLEARANCE_M),
            within_m=float(rng.choice([0.0, rng.uniform(0.0, CLEARANCE_M), CLEARANCE_M])),
        )
        rate = float(rng.choice([0.0, rng.uniform(-1.0, 1.0)]))
        speed = robot.max_speed_mps
        for _ in range(4):  # the limit depends on how fast the robot drives along its curve
            limit = limit_mps(
                person, course_of(robot, Motion(0.0, 0.0, 0.0, speed, 0.0, rate), turn_rad)
            )
            if speed <= limit:
                break
            speed = limit
        rows.append((speed, rate / max(speed, 0.01) if speed > 0.01 else 0.0, *where, *motion, top))
    v0, curvature, *people, top = np.array(rows).T
    return _Worlds(
        *(robot, turn_rad, tau, delay, age, v0, curvature),
        *(np.stack(people[:2], axis=1), np.stack(people[2:], axis=1), top),
    )


def run_worlds(
    rng: np.random.Generator, worlds: int, *, speed_factor: float = 1.0, faster: float = 1.0
) -> Outcome:
    """Let robots stop that obey the limit, each beside a person who does the worst.

    The robot turns at once by up to the policy's angle, keeps its curve, drives on for at most its
    reaction time and brakes. The person has gone unnoticed for the delay, and changes to targets
    that are drawn, or that lead to where the robot will be.

    Args:
        rng: source of randomness.
        worlds: number of them, all with the same robot.
        speed_factor: the robot drives at the limit times this.
        faster: people reach the speed U times this.
    """
    drawn = _drawn(rng, worlds)
    T, a = drawn.robot.reaction_time_s, drawn.robot.max_deceleration_mps2
    v0, tau = drawn.v0 * speed_factor, drawn.tau
    heading = rng.uniform(-drawn.turn_rad, drawn.turn_rad, worlds)
    brakes_s = rng.uniform(0.0, 1.0, worlds) ** 0.3 * T
    # Where somebody aims who wants to meet the robot.
    meets_s = rng.uniform(0.2, T + 0.2 + v0 / a)
    aim, _ = _pose(_way_m(v0, brakes_s, meets_s, a), drawn.curvature, heading)
    aim += rng.normal(0.0, 0.3, aim.shape)
    aims = rng.uniform(0.0, 1.0, (worlds, 1)) < 0.7
    angle = rng.uniform(-math.pi, math.pi, (3, worlds))
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ways *= rng.uniform(0.0, 1.0, (3, worlds, 1))
    top = drawn.top[:, None] * faster
    # The motion that the track showed dies away; what people drive at is added to it, since before
    # anybody could notice.
    added_m, added_mps = np.zeros((worlds, 2)), np.zeros((worlds, 2))
    touched, fastest = np.zeros(worlds, dtype=bool), 0.0
    start_s, end_s = -(drawn.age + drawn.delay), T + drawn.robot.max_speed_mps / a
    decay = math.exp(-_STEP_S / tau)
    for step in range(math.ceil((end_s - start_s) / _STEP_S)):
        t = start_s + step * _STEP_S
        drift_s = tau * -math.expm1(-max(t + drawn.age, 0.0) / tau)
        people = drawn.place + drift_s * drawn.velocity + added_m
        if t >= 0.0:
            speed = np.where(t < brakes_s, v0, np.maximum(v0 - a * (t - brakes_s), 0.0))
            base, h = _pose(_way_m(v0, brakes_s, np.full(worlds, t), a), drawn.curvature, heading)
            meets = _touching(drawn.robot, people - base, h) & (speed > 1e-3) & ~touched
            fastest = max(fastest, float(speed[meets].max(initial=0.0)))
            touched |= meets
        towards = aim - people
        towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
        piece = ways[min(int(3.0 * (t - start_s) / (end_s - start_s)), 2)]
        target = top * np.where(aims, towards, piece)
        # Exact for a target that is held for the step.
        added_m += target * _STEP_S + (added_mps - target) * (tau * (1.0 - decay))
        added_mps = target + (added_mps - target) * decay
    return Outcome(worlds, int((v0 > 0.05).sum()), int(touched.sum()), fastest)


def _touching(robot: RobotProfile, off: FloatArray, heading: FloatArray) -> NDArray[np.bool_]:
    """Return who touches the robot and is not behind its rear edge."""
    front, half = robot.footprint_m.max(axis=0)
    rear = robot.footprint_m[:, 0].min()
    fx = np.cos(heading) * off[:, 0] + np.sin(heading) * off[:, 1]
    fy = np.abs(np.cos(heading) * off[:, 1] - np.sin(heading) * off[:, 0])
    ahead = np.maximum(np.maximum(rear - fx, fx - front), 0.0)
    return np.asarray((np.hypot(ahead, np.maximum(fy - half, 0.0)) < BODY_M) & (fx >= rear))


def _way_m(v0: FloatArray, brakes_s: FloatArray, t: FloatArray, a: float) -> FloatArray:
    """Return how far robots have driven by t that brake from ``brakes_s`` on."""
    braking_s = np.clip(t - brakes_s, 0.0, v0 / a)
    return np.asarray(v0 * np.minimum(t, brakes_s) + v0 * braking_s - 0.5 * a * braking_s**2)


def _pose(
    way_m: FloatArray, curvature: FloatArray, heading: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return places (N, 2) and headings (N,) on arcs from the origin."""
    turned = curvature * way_m
    chord = way_m * np.sinc(0.5 * turned / math.pi)
    towards = heading + 0.5 * turned
    return np.stack([chord * np.cos(towards), chord * np.sin(towards)], axis=1), heading + turned


def brute_force_mps(person: Reach, course: Course, speeds: int = 151, times: int = 400) -> float:
    """Return the limit by trying speeds, times and headings of a fan, without the closed form."""
    fan = math.acos(max(-1.0, min(1.0, course.fan_cos)))
    v = np.linspace(0.0, course.maximum_mps, speeds)[1:, None]
    a, T = course.deceleration_mps2, course.reaction_s + person.elapsed_s
    t = np.linspace(0.0, T + course.maximum_mps / a, times)[None, :]
    late = np.maximum(t - T, 0.0)
    way, moves = v * t - 0.5 * a * late**2, v > a * late + 1e-9
    tau, since = person.time_constant_s, t + person.elapsed_s
    m, s = tau * -np.expm1(-since / tau), since + person.delay_s
    a0, a1, a2 = person.variances
    reach = person.speed_mps * (s + tau * np.expm1(-s / tau))
    margin = person.margin_m - np.minimum(reach, person.within_m)
    reach = reach + np.sqrt(np.maximum(a0 + m * (a1 + m * a2), 0.0))
    dx = person.x_m + person.velocity_x_mps * m - course.x_m
    dy = person.y_m + person.velocity_y_mps * m - course.y_m
    x, y = course.cos * dx + course.sin * dy, course.cos * dy - course.sin * dx
    met = np.zeros(speeds - 1, dtype=bool)
    for f in np.linspace(-fan, fan, 41):
        fx = math.cos(f) * x + math.sin(f) * y - way
        fy = np.abs(math.cos(f) * y - math.sin(f) * x) + 0.0 * fx
        beside = np.maximum(fy - course.half_m - margin, 0.0)
        behind = np.hypot(np.maximum(course.rear_m - fx, 0.0), beside)
        corner = np.hypot(np.maximum(fx - course.front_m, 0.0), np.maximum(fy - course.half_m, 0.0))
        gap = np.where(fx > course.front_m, np.maximum(corner - margin, 0.0), behind)
        met |= ((gap < reach + 1e-9) & moves).any(axis=1)
    found = np.flatnonzero(met)
    return course.maximum_mps if not len(found) else float(v[found[0] - 1, 0]) if found[0] else 0.0
