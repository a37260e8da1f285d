"""The Gymnasium environment with another robot, and among other people."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests import SimError, run_crossing

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
