"""The Gymnasium environment with another robot, and among other people."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests import SimError, run_crossing
from sim_tests.scenario import Scenario

pytest.importorskip("gymnasium", reason="the environment needs the extra gym")

from sim_tests.learning import CrossingEnv


class Ahead:
    """A planner that drives ahead and turns a little."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        if robot_state.stamp_s > 1.0:
            raise StopIteration
        return 0.7, 0.1


@pytest.mark.parametrize(
    ("scenario", "settings", "fitted"),
    [
        ("crossing_from_left", {"robot": "forklift"}, "crossing_from_left_forklift"),
        ("being_overtaken", {"population": "recorded"}, "being_overtaken"),
    ],
)
def test_an_episode_is_the_crossing_of_the_same_robot_among_the_same_people(
    scenario, settings, fitted
) -> None:
    env, expected, found = CrossingEnv(scenario, normalised_actions=False, **settings), [], []
    with pytest.raises(StopIteration):
        run_crossing(
            scenario,
            policy="balanced",
            planner=Ahead(),
            seed=2,
            observer=lambda frame, _: expected.append(frame),
            **settings,
        )
    env.reset(seed=2)
    for _ in range(20):
        env.step(np.array([0.7, 0.1]))
        found.append(env.frame)
    assert env.crossing.scenario.name == fitted
    assert env.crossing.scenario.population == settings.get("population", "classic")
    if "robot" in settings:
        np.testing.assert_allclose(env.action_space.high, [1.4, 0.9])
        # It steers: no turn is tighter than its turning radius.
        state = env.situation.robot_state
        assert 0.0 < abs(state.yaw_rate_radps) <= state.speed_mps / 1.3 + 1e-9
    env.close()
    for own, other in zip(found, expected, strict=False):
        np.testing.assert_array_equal(
            own.robot_state.position_odom_m, other.robot_state.position_odom_m
        )
        np.testing.assert_array_equal(own.truth[0].position_odom_m, other.truth[0].position_odom_m)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"robot": "omny"}, "did you mean 'omni'"),
        ({"population": "modern"}, "classic, recorded, got 'modern'"),
        ({"reward": {"contacts": 1.0}}, "did you mean 'contact'"),
        ({"control_hz": 0.0}, "control_hz must be in"),
        ({"scenarios": []}, "at least one scenario"),
        ({"render_view": "side"}, "render_view"),
    ],
)
def test_wrong_arguments_are_refused(settings, message) -> None:
    with pytest.raises(SimError, match=message):
        CrossingEnv(**{"scenarios": "late_glance", **settings})


def staged(**changed):
    """A scenario of a robot at the origin, heading along x, and somebody beside it."""
    data = Scenario.shipped("crossing_from_left").model_dump(mode="json")
    del data["robot_model"]
    person = {"name": "stands", "heading_deg": 180.0, "glances": {"notices_within_m": 0.0}}
    person |= {"route": [{"x_m": 0.05, "y_m": 0.53}], "social": False}
    data |= {"people": [person], "robot": {"goal_x_m": 14.0}, "duration_s": 12.0}
    return Scenario.model_validate({**data, **changed})


@pytest.mark.parametrize(
    ("changed", "action", "end"),
    [
        ({}, (0.0, 1.5), "contact"),
        (
            {"robot": {"goal_x_m": 0.4, "goal_y_m": 5.0, "start_heading_deg": 90.0}},
            (0.8, 0.0),
            "bump",
        ),
        ({"robot_model": "forklift", "people": []}, (0.9, 0.5), "bump"),
    ],
)
def test_turning_into_somebody_and_racks_end_an_episode(changed, action, end) -> None:
    if end == "bump":
        changed = {**changed, "people": []}
    scenario = staged(**changed)
    env = CrossingEnv(scenario, policy="scanner", normalised_actions=False)
    profile = scenario.robot_profile
    np.testing.assert_allclose(
        env.action_space.high, [profile.max_speed_mps, profile.max_yaw_rate_radps]
    )
    _, info = env.reset(seed=0)
    margin, ended = 0.0, False
    while not ended:
        _, _, terminated, truncated, info = env.step(np.array(action))
        margin += info["reward_parts"]["margin"]
        ended = terminated or truncated
    assert (terminated, info["end"], info["is_success"]) == (True, end, False)
    assert info["reward_parts"][end] == -20.0
    assert info["bumps"] == (end == "bump")
    assert info["contact"] == ("robot" if end == "contact" else "")
    # The episode began with a standing robot, which violates nothing.
    assert margin == pytest.approx(-2.0 * info["violation_time_s"])
    assert (margin < 0.0) == (end == "contact")
    env.close()


def test_robots_of_several_scenarios_share_the_largest_actions() -> None:
    env = CrossingEnv([staged(), staged(robot_model="forklift")], normalised_actions=False)
    np.testing.assert_allclose(env.action_space.high, [1.5, 1.5])
    env.close()
