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


def frames_ahead(scenario, **settings):
    """Return the frames of the first second of a crossing that drives ahead, with seed 2."""
    frames = []
    with pytest.raises(StopIteration):
        run_crossing(
            scenario,
            policy="balanced",
            planner=Ahead(),
            seed=2,
            observer=lambda frame, _: frames.append(frame),
            **settings,
        )
    return frames


def test_an_episode_is_the_crossing_of_the_same_robot() -> None:
    env = CrossingEnv("crossing_from_left", robot="forklift", normalised_actions=False)
    np.testing.assert_allclose(env.action_space.high, [1.4, 0.9])
    env.reset(seed=2)
    states = []
    for _ in range(20):
        env.step(np.array([0.7, 0.1]))
        states.append(env.situation.state)
    assert env.crossing.scenario.name == "crossing_from_left_forklift"
    env.close()
    frames = frames_ahead("crossing_from_left", robot="forklift")
    for state, frame in zip(states[:19], frames[1:20], strict=True):
        np.testing.assert_array_equal(state.position_odom_m, frame.robot_state.position_odom_m)
    assert 0.0 < states[-1].speed_mps <= 0.7
    # It steers: no turn is tighter than its turning radius.
    assert all(abs(each.yaw_rate_radps) <= each.speed_mps / 1.3 + 1e-9 for each in states)


def test_an_episode_is_the_crossing_among_the_same_people() -> None:
    env = CrossingEnv("being_overtaken", population="recorded", normalised_actions=False)
    env.reset(seed=2)
    for _ in range(20):
        env.step(np.array([0.7, 0.1]))
    scenario, last = env.crossing.scenario, env.frame
    env.close()
    assert scenario.population == "recorded"
    frames = frames_ahead("being_overtaken", population="recorded")
    (own,), (other,), (first,) = (each.truth for each in (last, frames[19], frames[0]))
    np.testing.assert_array_equal(own.position_odom_m, other.position_odom_m)
    assert np.hypot(*(own.position_odom_m - first.position_odom_m)) > 0.5


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
