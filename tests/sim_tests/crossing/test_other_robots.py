"""Crossings with other robots: their body, limits and planner, from start to goal."""

from __future__ import annotations

import math

import pytest

from sim_tests import SimError, run_crossing, shipped_scenarios
from sim_tests.study.measures import Conduct

ROBOTS = ("forklift", "omni", "delivery")
PLANNED = [name for name in shipped_scenarios() if name != "paper_encounter"]


@pytest.mark.parametrize(
    ("robot", "scenario", "seed"),
    [
        pytest.param("forklift", "blind_corner", 0),
        *(
            pytest.param(robot, scenario, seed, marks=pytest.mark.full)
            for seed in range(2)
            for robot in ROBOTS
            for scenario in PLANNED
        ),
    ],
)
def test_a_robot_arrives_and_keeps_its_limits(robot: str, scenario: str, seed: int) -> None:
    bumps = []
    result = run_crossing(
        scenario,
        policy="balanced",
        robot=robot,
        seed=seed,
        observer=lambda _, stage: bumps.append(stage.amr.bumps),
    )
    assert result.scenario == f"{scenario}_{robot}"
    assert result.success
    assert result.contact_by != "robot"
    assert bumps[-1] == 0
    conduct = Conduct.of(result)
    assert conduct.limit_excess_mps is not None
    # The measure expects corners to brake like wheels. Those of a robot that turns on the spot
    # brake at its yaw acceleration: 0.97 m/s² instead of 1.2 m/s² (delivery).
    assert conduct.limit_excess_mps <= 0.05
    if conduct.fastest_point_excess_mps is not None:
        assert conduct.fastest_point_excess_mps <= 0.05
    radius_m = result.robot.min_turning_radius_m
    for frame in result.frames:
        state = frame.robot_state
        if radius_m is not None:
            assert abs(state.yaw_rate_radps) <= abs(state.speed_mps) / radius_m + 1e-9
        if result.robot.drive != "holonomic":
            assert frame.lateral_command_mps == 0.0


class EnoughError(Exception):
    """Ends a crossing from its observer."""


class Sideways:
    """A planner that moves to the left."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.0, 0.5, 0.0


def test_a_planner_may_move_a_holonomic_robot_sideways_and_no_other() -> None:
    scenario = "crossing_from_left"
    frames = []

    def observe(frame, stage):
        frames.append(frame)
        if frame.t_s >= 1.0:
            raise EnoughError

    with pytest.raises(EnoughError):
        run_crossing(
            scenario, policy="balanced", planner=Sideways(), robot="omni", observer=observe
        )
    assert frames[-1].lateral_command_mps == 0.5
    assert frames[-1].command == (0.0, 0.0)
    x, y = frames[-1].robot_state.position_odom_m
    assert abs(x) < 1e-9
    assert y > 0.2
    with pytest.raises(SimError, match=r"must return \(speed_mps, yaw_rate_radps\)"):
        run_crossing(scenario, policy="balanced", planner=Sideways(), robot="forklift")


@pytest.mark.full
def test_scanners_and_camera_of_a_robot_see_people_and_not_itself() -> None:
    """The forks and the mast of the forklift are no people; the worker ahead is one."""
    seen = []

    def observe(frame, stage):
        seen.append([track for track in frame.tracks if track.status == "confirmed"])
        for point in frame.scan_points_odom_m:
            assert math.dist(point, frame.robot_state.position_odom_m) > 0.4
        if frame.t_s >= 2.5:
            raise EnoughError

    with pytest.raises(EnoughError):
        run_crossing(
            "head_on_in_aisle",
            policy="balanced",
            robot="forklift",
            perception="keypoints+scanner",
            observer=observe,
        )
    assert len(seen[-1]) == 1
