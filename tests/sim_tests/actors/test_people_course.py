"""People react to the course of the robot as it is now, from whatever side and direction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nav_adapter.rigid import Motion
from sim_tests import run_crossing
from sim_tests.actors.behaviour import MovingBody, Person, PersonSpec, RobotBody, Surroundings
from sim_tests.scenario import Scenario

DT_S = 0.05
CLEAR_M = 1.0  # somebody who waits stands 0.1 m farther away, where they may still be stopping
FORESIGHT_S = 6.0
STOPS_WITHIN = 20  # steps: nobody stops at once
REACTIONS = ("wait", "pass_behind", "hurry", "claim", "walk_on")


@dataclass(frozen=True)
class World:
    """A turn of the world about the origin, then a mirror, then a shift."""

    turn_rad: float = 0.0
    mirrored: bool = False
    shift_m: tuple[float, float] = (0.0, 0.0)

    def place(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return where a place comes to lie."""
        cos, sin = math.cos(self.turn_rad), math.sin(self.turn_rad)
        x_m, y_m = cos * x_m - sin * y_m, sin * x_m + cos * y_m
        return x_m + self.shift_m[0], (-y_m if self.mirrored else y_m) + self.shift_m[1]

    def motion(self, motion: Motion) -> Motion:
        """Return how a motion comes to run."""
        sign = -1.0 if self.mirrored else 1.0
        return Motion(
            *self.place(motion.x_m, motion.y_m),
            sign * (motion.heading_rad + self.turn_rad),
            motion.forward_mps,
            sign * motion.left_mps,
            sign * motion.yaw_rate_radps,
        )


@dataclass(frozen=True)
class Encounter:
    """The robot keeps a curve; somebody's way leads over it, and both are there at one time."""

    robot: Motion
    route: tuple[tuple[float, float], ...]
    reaction: str

    @classmethod
    def drawn(cls, seed: int, reaction: str | None = None) -> Encounter:
        """Return one of many encounters."""
        rng = np.random.default_rng(seed)
        speed, yaw_rate = rng.uniform(0.4, 1.4), rng.uniform(-0.6, 0.6)
        robot = Motion(0.0, 0.0, 0.0, float(speed), 0.0, float(yaw_rate))
        meet = robot.at(float(rng.uniform(3.0, 5.0)))
        from_rad = meet.heading_rad + float(rng.uniform(-math.pi, math.pi))
        ux, uy = math.cos(from_rad), math.sin(from_rad)
        route = tuple((meet.x_m - m * ux, meet.y_m - m * uy) for m in (5.0, -5.0))
        return cls(robot, route, reaction or REACTIONS[seed % len(REACTIONS)])

    def path(self, world: World, *, social: bool, steps: int = 160) -> tuple[np.ndarray, list[str]]:
        """Return the places (T, 2) of the person, and their reaction at each time."""
        points = [
            dict(zip(("x_m", "y_m"), world.place(*point), strict=True)) for point in self.route
        ]
        spec = PersonSpec.model_validate(
            {
                "name": "walker",
                "route": points,
                "glances": {"watches": True},
                "reactions": {self.reaction: 1.0},
                "social": social,
            }
        )
        person = Person(spec, np.random.default_rng(0), np.zeros((0, 4)))
        places, reactions = [], []
        for step in range(steps):
            now = world.motion(self.robot.at(step * DT_S))
            body = RobotBody(
                *now[:3], *now.velocity_mps, 0.36, 0.25, (*now[:2], 1.0), now.yaw_rate_radps
            )
            met = world.motion(Motion(4.0 - step * DT_S, 0.5, math.pi, 1.0))
            others = (MovingBody(*met[:2], *met.velocity_mps),) if social else ()
            person.step(step * DT_S, Surroundings(body, others, lambda: True))
            places.append(person.place_odom_m)
            reactions.append(person.reaction)
        return np.array(places), reactions


@given(
    seed=st.integers(0, 10_000),
    turn_rad=st.floats(-3.0, 3.0),
    mirrored=st.booleans(),
    shift=st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)),
)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_reactions_do_not_depend_on_where_the_world_lies(seed, turn_rad, mirrored, shift):
    """Social forces are left out where the world is mirrored: people step to the right there."""
    encounter, world = Encounter.drawn(seed), World(turn_rad, mirrored, shift)
    social = not mirrored
    usual, reactions = encounter.path(World(), social=social)
    there, same = encounter.path(world, social=social)
    assert same == reactions
    np.testing.assert_allclose(there, [world.place(*each) for each in usual.tolist()], atol=1e-6)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_nobody_who_waits_steps_towards_the_path_of_the_robot(seed):
    encounter = Encounter.drawn(seed, "wait")
    robot = encounter.robot
    places, reactions = encounter.path(World(), social=False)
    radius_m = robot.forward_mps / robot.yaw_rate_radps
    off_m = np.abs(np.hypot(places[:, 0], places[:, 1] - radius_m) - abs(radius_m))
    # The time until the robot is beside the person; up to half of a round.
    at_rad = np.arctan2(places[:, 0] / radius_m, 1.0 - places[:, 1] / radius_m)
    driven_rad = robot.yaw_rate_radps * DT_S * np.arange(len(places))
    comes_s = np.angle(np.exp(1j * (at_rad - driven_rad))) / robot.yaw_rate_radps
    comes = (np.array(reactions) == "wait") & (comes_s > 0.0) & (comes_s < FORESIGHT_S)
    for step in range(STOPS_WITHIN, len(places) - 1):
        if comes[step - STOPS_WITHIN : step + 1].all() and off_m[step] < CLEAR_M:
            assert off_m[step + 1] > off_m[step] - 0.002


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("yaw_rate", [-0.2, -0.06, 0.06, 0.2])
def test_whoever_overtakes_a_robot_and_leaves_keeps_to_the_way(side, yaw_rate):
    """A robot that creeps and turns a little drives an arc, which is not in their way."""
    route = [{"x_m": x, "y_m": side * 0.85} for x in (-3.0, 14.0)]
    habits = {"glances": {"watches": True}, "reactions": {"wait": 1.0}, "social": False}
    spec = PersonSpec.model_validate(
        {"name": "overtakes", "route": route, "speed_mps": 2.0, **habits}
    )
    person = Person(spec, np.random.default_rng(0), np.zeros((0, 4)))
    robot, reacted = Motion(0.0, 0.0, 0.0, 1.0), False
    for step in range(140):
        if person.place_odom_m[0] > robot.x_m:
            robot = robot._replace(forward_mps=0.1, yaw_rate_radps=yaw_rate)
            if step % 20 < 10:
                robot = robot._replace(yaw_rate_radps=-yaw_rate)
        body = RobotBody(
            *robot[:3], *robot.velocity_mps, 0.36, 0.25, (*robot[:2], 1.0), robot.yaw_rate_radps
        )
        person.step(step * DT_S, Surroundings(body, (), lambda: True))
        reacted |= person.reaction == "wait"
        assert side * person.place_odom_m[1] > 0.8
        robot = robot.at(DT_S)
    assert reacted
    assert person.place_odom_m[0] > 6.0


class _Turns:
    """A planner that drives ahead, and turns left by a right angle once it is past x."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        turns = robot_state.position_odom_m[0] > 5.2 and robot_state.heading_odom_rad < 1.5
        return 0.8, 0.8 if turns else 0.0


@pytest.mark.parametrize("start_s", [1.0, 2.5])
def test_a_robot_that_turns_strikes_nobody_who_waits(start_s):
    person = {
        "name": "waits",
        "route": [{"x_m": 7.0, "y_m": 8.0}, {"x_m": 7.0, "y_m": -6.0}],
        "speed_mps": 1.3,
        "start_s": start_s,
        "glances": {"watches": True},
        "reactions": {"wait": 1.0},
    }
    hall = {"x_min_m": -6, "x_max_m": 20, "y_min_m": -10, "y_max_m": 14}
    task = {"goal_x_m": 14.0}
    data = {"name": "corner", "duration_s": 11.0, "layout": hall, "robot": task, "people": [person]}
    result = run_crossing(Scenario.model_validate(data), policy="scanner", planner=_Turns())
    assert result.people[0].reaction == "wait"
    assert not result.contacts
