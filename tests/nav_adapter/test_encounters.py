"""Robots that obey in closed loop, on any constant curve and from a stand in any direction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from limit_worlds import BODY_M, drawn_robot

from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile, RobotState
from nav_adapter.motion import clip_twists_ahead
from nav_adapter.rigid import Motion
from tracking import PersonTrack

POLICY = AwarenessPolicy.preset("balanced")
CERTAIN = np.diag([1e-4] * 4)
CYCLE_S = 0.05
# A robot that moves slower than this counts as standing.
MOVES_MPS = 0.02


def seen(stamp_s: float, place: np.ndarray, velocity: np.ndarray, alpha: float) -> PersonTrack:
    return PersonTrack(
        *(1, stamp_s, "confirmed", place, velocity, CERTAIN, alpha, 0.02, alpha, 1.7, 0.0)
    )


def state_of(stamp_s: float, motion: Motion) -> RobotState:
    return RobotState(
        *(stamp_s, [motion.x_m, motion.y_m], motion.heading_rad),
        *(motion.forward_mps, motion.yaw_rate_radps, [motion.forward_mps, motion.left_mps]),
    )


def gap_m(robot: RobotProfile, motion: Motion, place: np.ndarray) -> tuple[float, float, float]:
    """Return the gap between footprint and body, and the place of the body from the base."""
    dx, dy = place[0] - motion.x_m, place[1] - motion.y_m
    cos, sin = math.cos(motion.heading_rad), math.sin(motion.heading_rad)
    x, y = cos * dx + sin * dy, cos * dy - sin * dx
    (front, half), rear = robot.footprint_m.max(axis=0), robot.footprint_m[:, 0].min()
    return math.hypot(max(x - front, rear - x, 0.0), max(abs(y) - half, 0.0)) - BODY_M, x, y


def nearer(value: float, wanted: float, change: float) -> float:
    return min(max(wanted, value - change), value + change)


@dataclass
class Encounter:
    """Somebody who walks straight on, and a robot on a curve that leads it to them."""

    robot: RobotProfile
    motion: Motion
    place: np.ndarray
    velocity: np.ndarray
    meets_s: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Encounter:
        # The loop below acts within the shortest reaction time (assumption 3).
        robot = replace(
            drawn_robot(rng),
            reaction_time_s=rng.uniform(0.15, 0.6),
            brakes_on_curve=rng.random() < 0.5,
        )
        speed = rng.uniform(0.3, 1.0) * robot.max_speed_mps
        motion = Motion(0.0, 0.0, rng.uniform(-3.1, 3.1), speed, 0.0, rng.uniform(-1.0, 1.0))
        stop_s = robot.reaction_time_s + speed / robot.max_deceleration_mps2
        meets_s = stop_s + rng.uniform(0.5, 3.0)
        there, way = motion.at(meets_s), rng.uniform(-math.pi, math.pi)
        velocity = rng.uniform(0.0, 1.6) * np.array([math.cos(way), math.sin(way)])
        met = np.array([there.x_m, there.y_m]) + rng.uniform(-0.4, 0.4, 2)
        return cls(robot, motion, met - meets_s * velocity, velocity, meets_s)

    def contact_mps(self) -> float | None:
        """Return the robot's speed at a contact that it causes, or None if it starts too fast."""
        robot, motion, place = self.robot, self.motion, self.place.copy()
        wanted, curvature = motion.forward_mps, motion.yaw_rate_radps / motion.forward_mps
        adapter = NavAdapter(POLICY, robot)
        # As fast as the reaction time is for a loop: a measurement acts half of it later.
        waits = [wanted] * (1 + int(0.5 * robot.reaction_time_s / CYCLE_S))
        for step in range(int((self.meets_s + 4.0) / CYCLE_S)):
            now = step * CYCLE_S
            track = seen(now, place, self.velocity, 1.0)
            limits = adapter.update([track], state_of(now, motion), now, perception_stamp_s=now)
            if step < 5 and limits.speed_limit_mps < wanted:
                return None  # at first sight nobody counts as aware
            waits.append(min(limits.speed_limit_mps, wanted))
            for _ in range(5):
                change = robot.max_deceleration_mps2 * 0.2 * CYCLE_S
                speed = nearer(motion.forward_mps, waits[0], change)
                motion = motion._replace(forward_mps=speed, yaw_rate_radps=speed * curvature)
                motion, place = motion.at(0.2 * CYCLE_S), place + 0.2 * CYCLE_S * self.velocity
                gap, x, _ = gap_m(robot, motion, place)
                if gap <= 0.0 and speed > MOVES_MPS and x > robot.footprint_m[:, 0].min():
                    return speed
            waits.pop(0)
        return 0.0


def encounters(seed: int, count: int) -> list[float]:
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        contact_mps = Encounter.drawn(rng).contact_mps()
        if contact_mps is not None:
            found.append(contact_mps)
    return found


def test_on_no_curve_a_robot_touches_aware_people_who_walk_straight_on() -> None:
    assert max(encounters(1, 40)) == 0.0


@pytest.mark.full
def test_on_no_curve_in_ten_thousand_encounters() -> None:
    assert max(encounters(2, 10_000)) == 0.0


TWISTS = {
    "backwards": (-0.6, 0.0, 0.0),
    "forwards": (0.8, 0.0, 0.0),
    "sideways": (0.0, 0.6, 0.0),
    "on the spot": (0.0, 0.0, 1.0),
    "back on a curve": (-0.4, 0.0, 0.6),
}


def starting_contact_mps(
    rng: np.random.Generator, wanted: tuple[float, float, float]
) -> tuple[float, float]:
    """Return how fast a robot touches somebody who sets off beside it, and how fast it got.

    It stands, wants a twist from some time on, and asks for it ahead of each cycle. The person has
    not noticed it, stands anywhere around it, and walks at it after a while. Somebody who is behind
    it, as it moves, may run into it.
    """
    drive = "holonomic" if wanted[1] else "differential"
    robot = RobotProfile(drawn_robot(rng).footprint_m, 1.5, 1.0, 1.0, 0.3, drive=drive)
    motion, bearing = Motion(0.0, 0.0, rng.uniform(-3.1, 3.1)), rng.uniform(-math.pi, math.pi)
    place = rng.uniform(0.3, 3.0) * np.array([math.cos(bearing), math.sin(bearing)])
    while gap_m(robot, motion, place)[0] < 0.02:
        place = 1.1 * place
    velocity, begins_s = np.zeros(2), rng.uniform(0.5, 2.5)
    adapter, commands, fastest = NavAdapter(POLICY, robot), [np.zeros(3)] * 3, 0.0
    for step in range(80):
        now = step * CYCLE_S
        state = state_of(now, motion)
        limits = adapter.update([seen(now, place, velocity, 0.0)], state, now)
        asked = wanted if now > 0.5 else (0.0, 0.0, 0.0)
        commands.append(clip_twists_ahead(limits, state, asked, CYCLE_S))
        forward, left, turn = commands.pop(0).tolist()
        towards = np.array([motion.x_m, motion.y_m]) - place
        target = 1.5 * towards / np.linalg.norm(towards) if now > begins_s else np.zeros(2)
        velocity = target + (velocity - target) * math.exp(-CYCLE_S / POLICY.reach.time_constant_s)
        motion = motion._replace(
            forward_mps=nearer(motion.forward_mps, forward, CYCLE_S),
            left_mps=nearer(motion.left_mps, left, CYCLE_S),
            yaw_rate_radps=nearer(motion.yaw_rate_radps, turn, 3.0 * CYCLE_S),
        ).at(CYCLE_S)
        place = place + CYCLE_S * velocity
        speed = motion.fastest_mps(robot.circumscribed_radius_m)
        fastest = max(fastest, speed)
        gap, x, y = gap_m(robot, motion, place)
        if gap <= 0.0:
            ahead, beside = robot.footprint_m.max(axis=0)
            rear = robot.footprint_m[:, 0].min()
            runs_into_it = (
                (motion.forward_mps > 0.0 and x < rear)
                or (motion.forward_mps < 0.0 and x > ahead)
                or (motion.left_mps > 0.0 and y < -beside)
            )
            return (0.0 if runs_into_it else speed), fastest
    return 0.0, fastest


@pytest.mark.parametrize("direction", TWISTS)
def test_a_robot_that_starts_in_any_direction_touches_nobody_while_it_moves(direction: str) -> None:
    rng = np.random.default_rng(7)
    found = np.array([starting_contact_mps(rng, TWISTS[direction]) for _ in range(20)])
    assert found[:, 0].max() <= 0.05
    assert (found[:, 1] > 0.2).sum() > 5  # most of them get going
