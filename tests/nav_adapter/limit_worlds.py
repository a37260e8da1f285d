"""Worlds with adversarial people in continuous time, and the limit by brute force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nav_adapter import RobotProfile, RobotState
from nav_adapter.limit import Course, course_of, limit_mps
from nav_adapter.reach import Reach
from perception.arrays import FloatArray

BODY_M = 0.30
CLEARANCE_M = 0.10
_STEP_S = 0.01


@dataclass(frozen=True)
class Outcome:
    """What happened in some worlds."""

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
    robot = drawn_robot(rng)
    turn_rad = math.radians(rng.uniform(0.0, 45.0))
    tau, delay = rng.uniform(0.3, 0.8), rng.uniform(0.0, 0.3)
    age = rng.choice([0.0, 0.1])
    T, a = robot.reaction_time_s, robot.max_deceleration_mps2
    speeds, yaw, places, velocities, tops = [], [], [], [], []
    while len(speeds) < worlds:
        top = float(rng.choice([0.0, 0.5, 1.5]))
        angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(0.3, 5.0)
        place = distance * math.cos(angle), distance * math.sin(angle)
        heading, walk = rng.uniform(-math.pi, math.pi), rng.uniform(0.0, max(top, 1.0))
        velocity = walk * math.cos(heading), walk * math.sin(heading)
        person = Reach(
            *(*place, *velocity, top, tau, delay), elapsed_s=age, margin_m=BODY_M + CLEARANCE_M
        )
        rate = float(rng.choice([0.0, rng.uniform(-1.0, 1.0)]))
        speed = robot.max_speed_mps
        for _ in range(4):
            state = RobotState(0.0, np.zeros(2), 0.0, speed, rate)
            limit = min(limit_mps(person, course_of(robot, state, turn_rad)), robot.max_speed_mps)
            if speed <= limit:
                break
            speed = limit
        speeds.append(speed * speed_factor)
        yaw.append(rate)
        places.append(place)
        velocities.append(velocity)
        tops.append(top)
    v0, w0 = np.array(speeds), np.array(yaw)
    place, velocity = np.array(places), np.array(velocities)
    top = np.array(tops) * faster
    heading = rng.uniform(-turn_rad, turn_rad, worlds)
    curvature = np.where(v0 > 0.01, w0 / np.maximum(v0, 0.01), 0.0)
    brakes_s = rng.uniform(0.0, 1.0, worlds) ** 0.3 * T
    # Where somebody aims who wants to meet the robot.
    meets_s = rng.uniform(0.2, T + 0.2 + v0 / a)
    at = _way_m(v0, brakes_s, meets_s, a)
    aim, _ = _pose(at, curvature, heading)
    aim += rng.normal(0.0, 0.3, aim.shape)
    angle = rng.uniform(-math.pi, math.pi, (3, worlds))
    drawn = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * rng.uniform(0.0, 1.0, (3, worlds, 1))
    aims = rng.uniform(0.0, 1.0, worlds) < 0.7
    corners = robot.footprint_m
    front, rear, half = corners[:, 0].max(), corners[:, 0].min(), corners[:, 1].max()
    # The motion that the track showed dies away; what people drive at is added to it, since before
    # anybody could notice.
    added_m, added_mps = np.zeros((worlds, 2)), np.zeros((worlds, 2))
    touched, fastest = np.zeros(worlds, dtype=bool), 0.0
    start_s, end_s = -(age + delay), T + robot.max_speed_mps / a
    decay = math.exp(-_STEP_S / tau)
    for step in range(math.ceil((end_s - start_s) / _STEP_S)):
        t = start_s + step * _STEP_S
        seen_m = place + velocity * (tau * -math.expm1(-max(t + age, 0.0) / tau))
        if t >= 0.0:
            speed = np.where(t < brakes_s, v0, np.maximum(v0 - a * (t - brakes_s), 0.0))
            base, h = _pose(_way_m(v0, brakes_s, np.full(worlds, t), a), curvature, heading)
            off = seen_m + added_m - base
            fx = np.cos(h) * off[:, 0] + np.sin(h) * off[:, 1]
            fy = np.abs(np.cos(h) * off[:, 1] - np.sin(h) * off[:, 0])
            ahead = np.maximum(np.maximum(rear - fx, fx - front), 0.0)
            gap = np.hypot(ahead, np.maximum(fy - half, 0.0))
            touches = (gap < BODY_M) & (speed > 1e-3) & (fx >= rear) & ~touched
            fastest = max(fastest, float(speed[touches].max(initial=0.0)))
            touched |= touches
        towards = aim - (seen_m + added_m)
        towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
        piece = drawn[min(int(3.0 * (t - start_s) / (end_s - start_s)), 2)]
        target = np.where(aims[:, None], towards, piece) * top[:, None]
        # Exact for a target that is held for the step.
        added_m += target * _STEP_S + (added_mps - target) * (tau * (1.0 - decay))
        added_mps = target + (added_mps - target) * decay
    return Outcome(worlds, int((v0 > 0.05).sum()), int(touched.sum()), fastest)


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
    reach = reach + np.sqrt(np.maximum(a0 + m * (a1 + m * a2), 0.0))
    dx = person.x_m + person.velocity_x_mps * m - course.x_m
    dy = person.y_m + person.velocity_y_mps * m - course.y_m
    x, y = course.cos * dx + course.sin * dy, course.cos * dy - course.sin * dx
    met = np.zeros(speeds - 1, dtype=bool)
    for f in np.linspace(-fan, fan, 41):
        fx = math.cos(f) * x + math.sin(f) * y - way
        fy = np.abs(math.cos(f) * y - math.sin(f) * x) + 0.0 * fx
        beside = np.maximum(fy - course.half_m - person.margin_m, 0.0)
        behind = np.hypot(np.maximum(course.rear_m - fx, 0.0), beside)
        corner = np.hypot(np.maximum(fx - course.front_m, 0.0), np.maximum(fy - course.half_m, 0.0))
        gap = np.where(fx > course.front_m, np.maximum(corner - person.margin_m, 0.0), behind)
        met |= ((gap < reach + 1e-9) & moves).any(axis=1)
    found = np.flatnonzero(met)
    return course.maximum_mps if not len(found) else float(v[found[0] - 1, 0]) if found[0] else 0.0
